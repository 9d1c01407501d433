"""Values and choices in words: "the number 5", "a, b or c", and the nearest known word."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence

from inputdesign_cli.specification.yaml.scalars import clip

# Our word -> common words for it that difflib would not find.
_SYNONYMS = {
    "sample_time": ("Ts", "dt", "sampling_time"),
    "samples": ("N", "length"),
    "numerator": ("num",),
    "denominator": ("den",),
    "variance": ("lambda", "sigma2"),
    "s": ("sec", "secs", "second", "seconds"),
    "ms": ("msec", "milliseconds"),
    "us": ("\u00b5s", "usec", "microseconds"),
    "min": ("mins", "minute", "minutes"),
    "h": ("hr", "hrs", "hour", "hours"),
    "d": ("day", "days"),
    "optimised": ("optimized",),
    "filtered_noise": ("gaussian",),
}


def describe(value: object) -> str:
    """Return a value in words: "the number 5", "a list"."""
    match value:
        case bool():
            return "true" if value else "false"
        case int() | float():
            return f"the number {show(value)}"
        case str():
            return f"the text {clip(value)}"
        case list() | tuple():
            return "a list"
    return "a mapping" if isinstance(value, dict) else "something else"


def show(value: float) -> str:
    """Return a number as a person would write it."""
    if isinstance(value, int) and (abs(value) < 10**9 or abs(value) >= 2**1024):
        return str(value) if abs(value) < 10**9 else clip(str(value))
    return f"{float(value):.6g}"


def count(number: int, noun: str) -> str:
    """Return a number of things: "1 input", "2 inputs"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def choices(known: Sequence[str]) -> str:
    """Return alternatives in a sentence: "a, b or c"."""
    return known[0] if len(known) == 1 else ", ".join(known[:-1]) + " or " + known[-1]


def synonym(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that has the same meaning as another, if there is one."""
    return next((ours for ours in known if word in _SYNONYMS.get(ours, ())), None)


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that was probably meant, if there is one."""
    known = list(known)
    if ours := synonym(word, known):
        return ours
    lower = {k.lower(): k for k in known}
    flat = word[:80].lower().replace("-", "_").replace(" ", "_")
    near = difflib.get_close_matches(flat, lower, n=1, cutoff=0.6)
    return lower[near[0]] if near else None


def unknown_word(value: object, known: Sequence[str]) -> tuple[str, str]:
    """Return message and hint for a value that is no known word."""
    message = f"{{key}} must be {choices(known)}, not {describe(value)}"
    word = value if isinstance(value, str) else ""
    near = nearest(word, known)
    if near is None and len(known) == 1:
        return message, f"write {known[0]}"
    return message, f'did you mean "{near}"?' if near else ""
