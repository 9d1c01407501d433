"""Turn answers in the user's words into a commented spec: what is asked, what is understood, what follows."""
