"""Numbers, times and shares in what people write."""

from __future__ import annotations

import re

from inputdesign_cli.wizard.questions import bad_answer

# Nobody means numbers beyond these, which would overflow, or vanish, where they are squared.
LARGEST, SMALLEST = 1e15, 1e-15
NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
_SECONDS = {"ms": 1e-3, "s": 1.0, "sec": 1.0, "seconds": 1.0, "min": 60.0, "minutes": 60.0, "h": 3600.0,
            "hour": 3600.0, "hours": 3600.0, "d": 86400.0}  # fmt: skip


def with_plain_numbers(text: str, key: str) -> str:
    """The text; none of its numbers is beyond what can be meant.

    Raises:
        SpecError: `bad-answer`.
    """
    for found in re.findall(rf"(?<![\w.]){NUMBER}", text):
        if float(found) and not SMALLEST <= abs(float(found)) <= LARGEST:
            raise bad_answer(
                key, f"{found} is beyond what can be meant: sizes lie between {SMALLEST:g} and {LARGEST:g}"
            )
    strange = re.search(r"(?<![\w./])(nan|inf|infinity)(?![\w./])", text, re.I)
    if strange is not None:
        raise bad_answer(key, f"{strange[1]} is no number")
    return text


def number(pattern: str, text: str) -> float | None:
    """What the first group of a pattern holds; None without a match."""
    found = re.search(pattern, text, re.I)
    return None if found is None else float(found.group(1))


def after(text: str, words: str) -> float | None:
    """The number behind the words (a pattern), a few others such as "of" or "about" in between."""
    return number(rf"\b(?:{words})\b[\s:=]*(?:(?:of|about|is|ca\.?|up to)\s*)?{NUMBER}", text)


def after_if_named(text: str, words: str, key: str) -> float | None:
    """The number behind the words; None where they are not there.

    Raises:
        SpecError: `bad-answer`, they are there without a number.
    """
    value = after(text, words)
    named = re.search(rf"\b(?:{words})\b", text, re.I)
    if value is None and named is not None:
        raise bad_answer(key, f'"{named[0]}" has no number behind it')
    return value


def seconds_after(text: str, words: str, key: str) -> float | None:
    """The time behind the words in seconds, which are its unit where it has none."""
    found = re.search(rf"\b(?:{words})\b[\s:=]*(?:(?:of|about|is)\s*)?{NUMBER}\s*([a-z]*)", text, re.I)
    return None if found is None else float(found.group(1)) * _unit(found.group(2), key)


def seconds(text: str, key: str) -> float:
    """A time by itself.

    Raises:
        SpecError: `bad-answer`.
    """
    found = re.fullmatch(rf"(?:about\s*)?{NUMBER}\s*([a-z]*)", text.strip(), re.I)
    if found is None or float(found.group(1)) <= 0.0:
        raise bad_answer(key, f'"{text}" is no time')
    return float(found.group(1)) * _unit(found.group(2), key)


def share(text: str) -> float | None:
    """The per cent of "within 30 %" as a fraction."""
    found = number(rf"{NUMBER}\s*(?:%|per ?cent)", text)
    return None if found is None else found / 100.0


def needed(value: float | None, key: str, what: str) -> float:
    """The value; it must be there and positive.

    Raises:
        SpecError: `bad-answer`.
    """
    if value is None:
        raise bad_answer(key, f"it does not say {what}")
    if not value > 0.0:
        raise bad_answer(key, f"{what} must be positive, not {value:g}")
    return value


def short(value: float) -> str:
    """A number as a spec has it: six digits."""
    return f"{value:.6g}"


def _unit(word: str, key: str) -> float:
    if word.lower() in ("", "and", "each", "within"):
        return 1.0
    if word.lower() not in _SECONDS:
        raise bad_answer(key, f'"{word}" is no unit of time: s, min or h')
    return _SECONDS[word.lower()]
