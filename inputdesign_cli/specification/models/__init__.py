"""A file for each section of the spec: its keys, and the types of their values."""
