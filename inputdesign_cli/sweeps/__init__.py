"""Batch sweeps: many runs of the verbs over a grid of settings, resumable."""
