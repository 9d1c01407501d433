"""The version of the package, which results and reports carry."""

__version__ = "0.1.0"
