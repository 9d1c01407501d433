"""The verbs: spec in, results out. A spec becomes a task once; nothing after that knows the spec."""
