"""One grammar of answers: words, a number behind or before them, and its unit. No word may stay unread.

What cannot be read is a SpecError `bad-answer`.
"""

from __future__ import annotations

import math
import re

from inputdesign_cli.wizard.questions import bad_answer

# Sizes beyond these would overflow, or vanish, where they are squared.
LARGEST, SMALLEST = 1e15, 1e-15
NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
ALONE = r"(?<![\w.])"  # the number that follows is no part of another
PLUS_MINUS = r"(?:plus/minus|plus or minus|\+/?-|±)"
# A unit that is not converted: "%", "bar", "degC", "m/s"; not a word of the answers.
UNIT = r"(?:\s*(?!(?:to|around|about|at|by|and|up|over|per|within)\b)[^\s\d,;|+±-][^\s,;|]*)?"
_PER_CENT = r"\s*(?:%|per ?cent\b)"
ABOUT = r"(?:\b(?:about|around|roughly|approximately|approx|circa|ca|some|nearly)\b\.?|~|≈)"
_OF = rf"\s*(?:,\s+|(?:of|is|up to)\b\s*|{ABOUT}\s*|[:=]\s*)*"
_WITHIN = rf"(?:\s*(?:within|{PLUS_MINUS})\s*{NUMBER}{_PER_CENT})?"
_MINUTE, _HOUR, _SHIFT, _DAY = 60.0, 3600.0, 28800.0, 86400.0
VAGUE = 0.2
"""The share within which a value that is "about" right is taken to be known."""
# Kinds of units -> each unit in the one that a spec has.
SCALES = {
    "time": {"us": 1e-6, "ms": 1e-3, "s": 1.0, "sec": 1.0, "second": 1.0, "min": _MINUTE, "minute": _MINUTE,
             "h": _HOUR, "hour": _HOUR, "shift": _SHIFT, "d": _DAY, "day": _DAY, "week": 7 * _DAY},
    "frequency": {"rad/s": 1.0, "rad/min": 1.0 / _MINUTE, "mhz": 2e-3 * math.pi, "hz": 2.0 * math.pi,
                  "khz": 2e3 * math.pi},
    "rate": {"s": 1.0, "sec": 1.0, "second": 1.0, "min": 1.0 / _MINUTE, "minute": 1.0 / _MINUTE,
             "h": 1.0 / _HOUR, "hour": 1.0 / _HOUR},
}  # fmt: skip
# "a minute", "half an hour", "two shifts": words in place of numbers.
_COUNTED = {"half an": 0.5, "half a": 0.5, "an": 1, "a": 1, "one": 1, "two": 2, "three": 3, "four": 4,
            "five": 5, "six": 6, "eight": 8, "ten": 10, "twelve": 12, "twenty": 20, "thirty": 30}  # fmt: skip
_UNIT_OF_TIME = rf"(?:{'|'.join(SCALES['time'])})s?\b"
_SPOKEN = re.compile(rf"\b({'|'.join(_COUNTED)})\s+(?={_UNIT_OF_TIME})", re.I)
AMOUNT = rf"(?:(?:{'|'.join(_COUNTED)})\s+|(?:\d+\.?\d*|\.\d+)\s*){_UNIT_OF_TIME}"
"""A time, as in "45 min" or "one shift"."""
_PER = rf"(?:\s*(?!(?:per|and)\b)[^\s\d,;|/]+)?(?:\s*(?:per|/)\s*({'|'.join(SCALES['rate'])})\b)?"
# A group each, which holds a unit of the kind; the last three convert nothing.
_UNITS = {kind: rf"(?:\s*({'|'.join(scales)})s?\b)?" for kind, scales in SCALES.items()} | {
    "rate": _PER,
    "slope": rf"{_PER}(?:\s*(?:per|/)\s*[^\s,;|]+)?",
    "gain": r"((?:\s*[^\s\d,;|]*/[^\s,;|]+)?)",
    "any": rf"({UNIT})",
    "none": "()",
}
_FILLING = "a an the of and with in at each all about is for by i want"


class Phrase:
    """Reads an answer piece by piece; `finish` refuses what nobody read.

    A method returns None if the text has no piece of its kind.
    """

    def __init__(self, text: str, key: str) -> None:
        """Begin with the whole answer to a question; refuse numbers too large or too small to be meant."""
        spoken = _SPOKEN.sub(lambda found: f"{_COUNTED[found[1].lower()]} ", text)
        self.text, self.key, self._left = text, key, spoken
        sizes = (one for one in re.findall(rf"{ALONE}{NUMBER}", text) if float(one))
        strange = next((one for one in sizes if not SMALLEST <= abs(float(one)) <= LARGEST), None)
        if strange is not None:
            why = f"{strange} is beyond what can be meant: sizes lie between {SMALLEST:g} and {LARGEST:g}"
            raise bad_answer(key, why)
        if nan := re.search(r"(?<![\w./])(nan|inf|infinity)(?![\w./])", text, re.I):
            raise bad_answer(key, f"{nan[1]} is no number")
        if comma := re.search(r"\d+,\d+", text):
            why = f"{comma[0]} is a number with a comma, or two: write 2.5, and a blank behind commas"
            raise bad_answer(key, why)

    def take(self, pattern: str) -> re.Match[str] | None:
        """Take the first piece that matches a pattern out of the text, and return its match."""
        found = re.search(pattern, self._left, re.I)
        if found is not None:
            self._left = f"{self._left[: found.start()]} | {self._left[found.end() :]}"
        return found

    def number(self, pattern: str) -> float | None:
        """Read a piece and return the number in its first group."""
        found = self.take(pattern)
        return None if found is None else float(found[1])

    def after(self, words: str, kind: str = "any", *, named: bool = False) -> float | None:
        """Read words (a pattern), a number and its unit, and return the number in units of the spec.

        Args:
            kind: of the unit: time, frequency, rate, gain, any (which is not converted) or none.
            named: whether words without a number are refused.
        """
        found = self.take(rf"\b(?:{words})\b{_OF}{NUMBER}{_UNITS[kind]}")
        if found is None and named and (alone := re.search(rf"\b(?:{words})\b", self._left, re.I)):
            raise bad_answer(self.key, f'"{alone[0]}" has no number behind it')
        return None if found is None else _scaled(found[1], found[2], kind)

    def known_within(self, words: str, kind: str) -> tuple[float, float | None, bool] | None:
        """Read as `after` does; also the share "within 30 %" that may follow, and whether it is "about"."""
        found = self.take(rf"({ABOUT}?\s*\b(?:{words})\b{_OF}){NUMBER}{_UNITS[kind]}{_WITHIN}")
        if found is None:
            return None
        share = None if found[4] is None else float(found[4]) / 100.0
        return _scaled(found[2], found[3], kind), share, re.search(ABOUT, found[1], re.I) is not None

    def band(self) -> tuple[float | None, float | None]:
        """Read the ends of a band of frequencies in rad/s; one unit holds for both."""
        frequency = NUMBER + _UNITS["frequency"]
        found = self.take(rf"\bfrom\b{_OF}{frequency}\s*(?:\bup to\b|\bto\b|-)\s*{frequency}")
        if found is None:
            return self.after("from", "frequency"), self.after("up to|to", "frequency")
        low, high = ((found[1], found[2] or found[4]), (found[3], found[4] or found[2]))
        return _scaled(*low, "frequency"), _scaled(*high, "frequency")

    def share(self) -> float | None:
        """Read "within 30 %" and return the fraction."""
        found = self.number(rf"(?:\b(?:within)\b|{PLUS_MINUS})?\s*{NUMBER}{_PER_CENT}")
        return None if found is None else found / 100.0

    def seconds(self) -> float:
        """Read the whole answer as a time, as in "45 min" or "one shift"."""
        found = self.take(rf"{NUMBER}\s*([a-z]*?)s?(?![a-z])")
        if found is None:
            raise bad_answer(self.key, f'"{self.text}" is no time')
        unit = found[2].lower() or "s"
        if unit not in SCALES["time"]:
            raise bad_answer(self.key, f'"{found[2]}" is no unit of time: s, min, h, shifts or days')
        self.finish("there only for up to")
        return needed(_scaled(found[1], unit, "time"), self.key, "the time")

    def finish(self, also: str = "") -> None:
        """Refuse what was not read, except words without content and `also` (words between blanks)."""
        known = f"{_FILLING} {also.lower()}".split()
        for piece in self._left.split("|"):
            if any(word and word not in known for word in re.split(r"[\s,;.:]+", piece.lower())):
                raise bad_answer(self.key, f'"{piece.strip(" ,;.:")}" is not understood')


def _scaled(number: str, unit: str | None, kind: str) -> float:
    scales = SCALES.get("rate" if kind == "slope" else kind, {})
    return float(number) * scales.get((unit or "").lower(), 1.0)


def needed(value: float | None, key: str, what: str) -> float:
    """Return the value; refuse one that is missing or not positive."""
    if value is None:
        raise bad_answer(key, f"it does not say {what}")
    if not value > 0.0:
        raise bad_answer(key, f"{what} must be positive, not {value:g}")
    return value


def short(value: float) -> str:
    """Write a number with the six digits of a spec."""
    return f"{value:.6g}"
