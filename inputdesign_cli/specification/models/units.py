"""The units of the numbers of a spec, and hints for texts with units: "1 h", "40 %", "0.5 Hz"."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

from inputdesign_cli.specification.models.wording import synonym

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0, "d": 86400.0}
"""How long each `time_unit` is."""

# Per second, in rad.
_RADIANS = {"mHz": 2e-3 * math.pi, "Hz": 2 * math.pi, "kHz": 2e3 * math.pi, "rpm": math.pi / 30}
_NUMBER = r"([-+]?(?:\.[0-9]+|[0-9]+\.?[0-9]*)(?:[eE][-+]?[0-9]+)?)"
_WITH_UNIT = re.compile(_NUMBER + r"\s*([%A-Za-z\u00b0\u00b5\u03bc/]+)")


@dataclass(frozen=True)
class Measure:
    """The quantity of a number, in the `Annotated[..]` of a type, for all numbers inside."""

    of: Literal["time", "seconds", "frequency", "signal", "move", "fraction"]


TIME, SECONDS_ONLY = Measure("time"), Measure("seconds")
FREQUENCY, SIGNAL, FRACTION = Measure("frequency"), Measure("signal"), Measure("fraction")
MOVE = Measure("move")
"""The change of a signal in a sample."""


def without_unit(text: str, measure: Measure | None, time_unit: str | None) -> str:
    """Return a hint for a number with a unit; empty for another text.

    Args:
        text: in place of a number.
        measure: of the number that is wanted; None if it is not known.
        time_unit: of the spec; None if it is not known.
    """
    match = _WITH_UNIT.fullmatch(text.strip())
    if match is None:
        return ""
    number, unit = match.groups()
    of = None if measure is None else measure.of
    if unit == "%":
        return _percent(number, of)
    # A named parameter may be of any quantity; its unit shows which.
    for quantity in ("time", "frequency"):
        if of == quantity or (of is None and _size(unit, quantity)):
            return _converted(number, unit, quantity, time_unit)
    if of == "seconds":
        return _converted(number, unit, "time", "s")
    moved, _, per = unit.rpartition("/")
    if of == "move" and moved and _size(per, "time"):
        return f"write the change in a sample, in the unit of the signal: {number} {unit} times sample_time"
    if of in ("signal", "move"):
        return f"write {number}, in the unit of the signal"
    return f"write the number without a unit: {number}"


def _percent(number: str, of: str | None) -> str:
    share = f"{float(number) / 100:g}"
    if of == "fraction":
        return f"write it as a fraction: {share}"
    if of in ("signal", "move"):
        return f"write {number}, in the unit of the signal"
    return f"write {share} where a fraction is meant, and {number} where the unit is percent"


def _size(unit: str, quantity: str) -> float | None:
    """A unit in seconds, or in rad/s; None if it is not known."""
    if quantity == "frequency":
        long = _size(unit.removeprefix("rad/"), "time") if unit.startswith("rad/") else None
        return 1.0 / long if long else _RADIANS.get(unit)
    return SECONDS.get(unit) or SECONDS.get(synonym(unit.lower(), SECONDS) or "")


def _converted(number: str, unit: str, quantity: str, time_unit: str | None) -> str:
    """The hint for a time or a frequency; a `time_unit` that is not known is named."""
    size, rate = _size(unit, quantity), quantity == "frequency"
    named = f"{'rad/' if rate else ''}{time_unit or 'time_unit'}"
    if time_unit not in SECONDS or size is None:
        same = f": {number} if that is {unit}" if size is not None and not rate else ""
        return f"write the number alone, in {named}{same}"
    wanted = 1.0 / SECONDS[time_unit] if rate else SECONDS[time_unit]
    if size == wanted:
        return f"write the number without a unit: {number}"
    many = "frequencies" if rate else "times"
    return f"write {float(number) * size / wanted:.10g}: {many} are in {named} here"
