"""What a run leaves: results, its directory, tables, provenance and golden values."""
