"""Compute pieces of work in this process, in others, or on a cluster."""
