"""Records of data, on their way to a room of their own."""
