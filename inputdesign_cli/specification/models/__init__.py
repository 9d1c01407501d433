"""One file a section of the spec: what it may hold, and the types of its values."""
