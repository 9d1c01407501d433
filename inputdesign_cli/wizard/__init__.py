"""Turn answers in the user's words into a commented spec."""
