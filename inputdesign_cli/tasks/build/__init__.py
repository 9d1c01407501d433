"""Spec sections to mathematical objects; after this nothing takes a spec."""
