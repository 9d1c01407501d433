"""The accuracy that a given excitation buys."""
