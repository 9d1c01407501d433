"""Convex designs: the exchange method, its certificates, limits and baselines."""
