"""What must hold across the sections of a spec."""
