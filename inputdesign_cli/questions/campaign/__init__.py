"""Experiments in parts that are planned anew after each record."""
