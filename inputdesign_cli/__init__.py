"""Optimal experiments for system identification."""

__version__ = "0.1.0"
