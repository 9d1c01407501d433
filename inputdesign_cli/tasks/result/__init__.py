"""Mathematical objects to numbers, curves and tables with units."""
