"""Signals within an amplitude: their possible autocovariances, and the best of them."""
