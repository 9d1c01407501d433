"""The value of an unquoted word by the core rules of YAML 1.2, and why a word is not a number.

PyYAML follows YAML 1.1, where `1e-3` is text, `no` is false, `1:30` is ninety and `010` is eight. Here
`true` and `false` are the only booleans, and `1e-3` is a number. Words that YAML readers read differently
(`010`, `0x10`, `1_000`) stay text, so that a field for a number can refuse them.
"""

from __future__ import annotations

import math
import re

_NULL = frozenset({"", "~", "null", "Null", "NULL"})
_TRUE = frozenset({"true", "True", "TRUE"})
_FALSE = frozenset({"false", "False", "FALSE"})
_INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]*)")
_LEADING_ZERO = re.compile(r"[-+]?0[0-9]+")
NUMBER = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[-+]?\.?(inf|infinity|nan)", re.IGNORECASE)

LARGEST_DIGITS = 309
"""A double has no more than 309 digits before the point; longer integers are not even converted."""

Scalar = str | int | float | bool | None


def resolve(word: str) -> Scalar:
    """Return the value of an unquoted word. Numbers beyond doubles stay text (see `why_not_number`)."""
    if word in _NULL:
        return None
    if word in _TRUE:
        return True
    if word in _FALSE:
        return False
    if _LEADING_ZERO.fullmatch(word) or not NUMBER.fullmatch(word):
        return word
    if _INTEGER.fullmatch(word):
        if len(word) > LARGEST_DIGITS + 1 or math.isinf(float(word)):
            return word
        return int(word)
    value = float(word)
    return word if math.isinf(value) or _vanished(word, value) else value


def plain_number(text: str) -> float:
    """Return the number of a text in digits 0 to 9, or raise `ValueError`; `float` would take `1_0`."""
    if not NUMBER.fullmatch(text.strip()):
        raise ValueError(f"{clip(text)} is no number")
    return float(text)


def why_not_number(word: str) -> tuple[str, str, str]:
    """Return code, message (after the key's name) and hint for a text in place of a number."""
    text = word.strip()
    quoted = clip(word)
    if _NOT_FINITE.fullmatch(text):
        return "not-finite", f"must be finite, not {quoted}", "write an ordinary number, or remove the key"
    if _LEADING_ZERO.fullmatch(text):
        plain = re.sub(r"(?<![0-9])0+(?=[0-9])", "", text)
        return (
            "not-a-number",
            f"must be a number without leading zeros, not {quoted}",
            f"some programs read {quoted} as an octal number; write {plain}, or 0.{text} if a decimal comma "
            "was meant: a comma begins the next number",
        )
    if NUMBER.fullmatch(text):
        value = float(text)
        if math.isinf(value):
            return "not-finite", f"is too large: {quoted}", "numbers must stay below 1.8e308"
        if _vanished(text, value):
            return "not-finite", f"is too small: {quoted}", "numbers other than 0 must stay above 5e-324"
        return "not-a-number", f"must be a number, not the quoted text {quoted}", "remove the quotes"
    return "not-a-number", f"must be a number, not the text {quoted}", _number_hint(text)


def clip(text: str, width: int = 40) -> str:
    """Return the text in double quotes on one line, cut off when it is long."""
    flat = "".join(c if c.isprintable() else " " for c in text)
    return f'"{flat[:width]}..."' if len(flat) > width else f'"{flat}"'


def _number_hint(text: str) -> str:
    if len(text) > 60:
        return ""
    if NUMBER.fullmatch(text.replace("_", "")):
        return f"write it without underscores: {text.replace('_', '')}"
    if text.count(",") == 1 and NUMBER.fullmatch(text.replace(",", ".")):
        return f"use a decimal point: {text.replace(',', '.')}"
    if text.lower() == "pi":
        return "write 3.141592653589793"
    computed = re.fullmatch(r"[-+]?(0x[0-9a-fA-F]+|0o[0-7]+|[0-9.]+ */ *[0-9.]+)", text)
    return "nothing is computed here: write the decimal number" if computed else ""


def _vanished(word: str, value: float) -> bool:
    return value == 0.0 and re.search(r"[1-9]", re.split("[eE]", word)[0]) is not None
