"""Signals: from a spectrum to samples, and the best of several by what those samples achieve."""
