"""The version of this package: every room tells it, so that it stands below all of them."""

__version__ = "0.1.0"
