"""Numbers, times and shares in what people write, of which no word may be left unread."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

from inputdesign_cli.wizard.questions import bad_answer

# Nobody means numbers beyond these, which would overflow, or vanish, where they are squared.
LARGEST, SMALLEST = 1e15, 1e-15
NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
_SECONDS = {"ms": 1e-3, "s": 1.0, "sec": 1.0, "seconds": 1.0, "min": 60.0, "minutes": 60.0, "h": 3600.0,
            "hour": 3600.0, "hours": 3600.0, "d": 86400.0}  # fmt: skip
_UNIT_OF_TIME = rf"(?:\s*({'|'.join(sorted(_SECONDS, key=len, reverse=True))})\b)?"
_FREQUENCIES = {
    "rad/s": 1.0,
    "rad/min": 1.0 / 60.0,
    "mhz": 2e-3 * math.pi,
    "hz": 2.0 * math.pi,
    "khz": 2e3 * math.pi,
}
_UNIT_OF_FREQUENCY = rf"(?:\s*({'|'.join(_FREQUENCIES)})\b)?"
_OF = r"\s*(?:(?:of|about|is|ca\.?|up to)\b\s*|[:=]\s*)*"
_RATIO = r"(?:\s*[^\s\d,;|]*/[^\s,;|]+)?"  # degC/%: a unit of a gain, which is not converted
PER_CENT = r"\s*(?:%|per ?cent\b)"
PLUS_MINUS = r"(?:plus/minus|plus or minus|\+/?-|±)"
# Words that say nothing by themselves.
_FILLING = {
    "a",
    "an",
    "the",
    "of",
    "and",
    "with",
    "in",
    "at",
    "each",
    "all",
    "about",
    "is",
    "for",
    "by",
    "i",
    "want",
}


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


@dataclass
class Phrase:
    """An answer that is read piece by piece; what is left in the end was not understood.

    Args:
        key: of the question.
    """

    text: str
    key: str
    _left: str = field(init=False, default="")

    def __post_init__(self) -> None:
        comma = re.search(r"\d+,\d+", self.text)
        if comma is not None:
            raise bad_answer(
                self.key, f"{comma[0]} is a number with a comma, or two: write 2.5, and a blank behind commas"
            )
        self._left = self.text

    def take(self, pattern: str) -> re.Match[str] | None:
        """Where the pattern matches what is left; that is read then."""
        found = re.search(pattern, self._left, re.I)
        if found is not None:
            self._left = f"{self._left[: found.start()]} | {self._left[found.end() :]}"
        return found

    def number(self, pattern: str) -> float | None:
        """What the first group of a pattern holds; None without a match."""
        found = self.take(pattern)
        return None if found is None else float(found[1])

    def after(self, words: str, unit: str = "") -> float | None:
        """The number behind the words (a pattern), others such as "of" in between, a unit behind it."""
        return self.number(rf"\b(?:{words})\b{_OF}{NUMBER}{unit}")

    def after_if_named(self, words: str, unit: str = "") -> float | None:
        """The number behind the words; None where they are not there.

        Raises:
            SpecError: `bad-answer`, they are there without a number.
        """
        value = self.after(words, unit)
        named = re.search(rf"\b(?:{words})\b", self._left, re.I)
        if value is None and named is not None:
            raise bad_answer(self.key, f'"{named[0]}" has no number behind it')
        return value

    def seconds_after(self, words: str) -> float | None:
        """The time behind the words in seconds, which are its unit where it has none."""
        found = self.take(rf"\b(?:{words})\b{_OF}{NUMBER}{_UNIT_OF_TIME}")
        return None if found is None else float(found[1]) * _SECONDS[(found[2] or "s").lower()]

    def known_within(self, words: str, is_time: bool) -> tuple[float, float | None] | None:
        """The number behind the words, in seconds if it `is_time`, and its share behind it, if any."""
        unit = _UNIT_OF_TIME if is_time else rf"({_RATIO})"
        within = rf"(?:\s*(?:within|{PLUS_MINUS})\s*{NUMBER}{PER_CENT})?"
        found = self.take(rf"\b(?:{words})\b{_OF}{NUMBER}{unit}{within}")
        if found is None:
            return None
        scale = _SECONDS[(found[2] or "s").lower()] if is_time else 1.0
        return float(found[1]) * scale, None if found[3] is None else float(found[3]) / 100.0

    def frequency_after(self, words: str) -> float | None:
        """The frequency behind the words in rad/s, which is its unit where it has none."""
        found = self.take(rf"\b(?:{words})\b{_OF}{NUMBER}{_UNIT_OF_FREQUENCY}")
        return None if found is None else float(found[1]) * _FREQUENCIES[(found[2] or "rad/s").lower()]

    def band(self) -> tuple[float | None, float | None]:
        """From where to where, in rad/s; a unit behind one of the two is that of the other, too."""
        frequency = NUMBER + _UNIT_OF_FREQUENCY
        found = self.take(rf"\bfrom\b{_OF}{frequency}\s*(?:\bup to\b|\bto\b|-)\s*{frequency}")
        if found is None:
            return self.frequency_after("from"), self.frequency_after("up to|to")
        units = (found[2] or found[4] or "rad/s", found[4] or found[2] or "rad/s")
        low, high = (
            float(number) * _FREQUENCIES[unit.lower()]
            for number, unit in zip(found.group(1, 3), units, strict=True)
        )
        return low, high

    def share(self, words: str = "within") -> float | None:
        """The per cent of "within 30 %" as a fraction."""
        found = self.number(rf"(?:\b(?:{words})\b|{PLUS_MINUS})?\s*{NUMBER}{PER_CENT}")
        return None if found is None else found / 100.0

    def finish(self, also: str = "") -> None:
        """Nothing may be left but words that say nothing, `also` (blanks between them) among these.

        Raises:
            SpecError: `bad-answer`.
        """
        known = _FILLING | set(also.lower().split())
        for piece in self._left.split("|"):
            words = re.split(r"[\s,;.:]+", piece.lower())
            if any(word not in known for word in words if word):
                raise bad_answer(self.key, f'"{piece.strip(" ,;.:")}" is not understood')


def seconds(text: str, key: str) -> float:
    """A time by itself.

    Raises:
        SpecError: `bad-answer`.
    """
    found = re.fullmatch(rf"(?:about\s*)?{NUMBER}\s*([a-z]*)", text.strip(), re.I)
    if found is None or float(found[1]) <= 0.0:
        raise bad_answer(key, f'"{text}" is no time')
    unit = found[2].lower() or "s"
    if unit not in _SECONDS:
        raise bad_answer(key, f'"{found[2]}" is no unit of time: s, min or h')
    return float(found[1]) * _SECONDS[unit]


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
