"""Find a model in a log without a spec."""
