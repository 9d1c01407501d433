"""Designs with proofs: least cost by exchange, regression, loop error, and bounds within an amplitude."""
