"""YAML text to plain data, every key with its place."""
