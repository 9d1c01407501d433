"""Estimate a model from records, and judge whether they meet what is asked."""
