"""Measure sentences for people."""

import re

LONGEST = 25
UNCLEAR = re.compile(
    r"\b(told|tells?|those of|so many|such a|for nothing|by itself|as (it|they) stands?)\b", re.IGNORECASE
)


def long_sentences(text):
    """Return the sentences of more than 25 words; code in backquotes counts as one word."""
    plain = re.sub(r"`[^`]*`", "code", text)
    return [s for s in re.split(r"(?<=[.!?:;])\s+", plain) if len(s.split()) > LONGEST]


def unclear_words(text):
    """Return the words of a text that leave a reader asking what is meant."""
    return [found.group() for found in UNCLEAR.finditer(text)]
