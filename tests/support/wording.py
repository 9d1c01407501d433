"""Measure sentences for people."""

import re

LONGEST = 25


def long_sentences(text):
    """Return the sentences of more than 25 words; code in backquotes counts as one word."""
    plain = re.sub(r"`[^`]*`", "code", text)
    return [s for s in re.split(r"(?<=[.!?:;])\s+", plain) if len(s.split()) > LONGEST]
