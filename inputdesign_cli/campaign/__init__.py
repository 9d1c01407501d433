"""Campaigns on a real plant: a directory that remembers every plan, record and decision."""
