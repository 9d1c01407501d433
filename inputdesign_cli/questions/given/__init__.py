"""The accuracy that a given excitation gives."""
