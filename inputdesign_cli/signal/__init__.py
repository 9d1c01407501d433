"""Signals: from a spectrum to samples, and the best of several by the accuracy that they achieve."""
