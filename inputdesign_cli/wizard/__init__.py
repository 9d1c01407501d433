"""From answers in the user's words to a commented spec: what is asked, what is understood, what follows."""
