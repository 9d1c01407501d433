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
    value, seconds = float(number), "s" if of == "seconds" else time_unit
    # A named parameter may be of any quantity; its unit shows which.
    if of in ("time", "seconds") or (of is None and _seconds(unit)):
        return _time(number, _seconds(unit), seconds)
    if of == "frequency" or (of is None and (unit in _RADIANS or unit.startswith("rad/"))):
        return _frequency(number, value, unit, seconds)
    moved, _, per = unit.rpartition("/")
    if of == "move" and moved and _seconds(per):
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
    if of is not None:
        return f"this is no fraction of anything; write a {of if of == 'frequency' else 'time'}"
    return f"write {share} where a fraction is meant, and {number} where the unit is percent"


def _seconds(unit: str) -> str | None:
    """The `time_unit` that a text names."""
    return unit if unit in SECONDS else synonym(unit.lower(), SECONDS)


def _time(number: str, unit: str | None, wanted: str | None) -> str:
    if wanted is None:
        return "write the number alone, in time_unit" + (f": {number} if that is {unit}" if unit else "")
    if wanted not in SECONDS:
        return f"write {number} and time_unit: {unit}" if unit else f"write the number alone: {number}"
    if unit is None:
        return f"write the number alone, in {wanted}"
    if unit == wanted:
        return f"write the number without a unit: {number}"
    return f"write {float(number) * SECONDS[unit] / SECONDS[wanted]:.10g}: times are in {wanted} here"


def _frequency(number: str, value: float, unit: str, wanted: str | None) -> str:
    if wanted is None or wanted not in SECONDS:
        return "write the number alone, in rad per time_unit"
    per, _, base = unit.partition("/")
    known = _seconds(base) if per == "rad" else None
    rate = 1.0 / SECONDS[known] if known else _RADIANS.get(unit)
    if rate is None:
        return f"write the number alone, in rad/{wanted}"
    if known == wanted:
        return f"write the number without a unit: {number}"
    return f"write {value * rate * SECONDS[wanted]:.10g}: frequencies are in rad/{wanted} here"
