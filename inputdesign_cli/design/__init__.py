"""Designs: least cost by exchange, with certificates."""
