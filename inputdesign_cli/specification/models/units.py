"""The units of time of a spec, and hints for numbers with a unit: "1 h", "40 %", "0.5 Hz"."""

from __future__ import annotations

import math
import re

from inputdesign_cli.specification.models.wording import synonym
from inputdesign_cli.specification.yaml.scalars import NUMBER

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0, "d": 86400.0}
"""The length of each `time_unit` in seconds."""

# Units of frequency in rad/s.
_RADIANS = {"mHz": 2e-3 * math.pi, "Hz": 2 * math.pi, "kHz": 2e3 * math.pi, "rpm": math.pi / 30}
_WITH_UNIT = re.compile(rf"({NUMBER.pattern})\s*([%A-Za-z\u00b0\u00b5\u03bc/]+)")


def without_unit(text: str, time_unit: str | None) -> str:
    """Return a hint for a number with a unit in the `time_unit`, if it is known; empty for another text."""
    match = _WITH_UNIT.fullmatch(text.strip())
    if match is None:
        return ""
    number, unit = match.group(1), match.groups()[-1]
    if unit == "%":
        share = f"{float(number) / 100:g}"
        return f"write {share} where a fraction is meant, and {number} where the unit is percent"
    per = unit.startswith("rad/")
    name = unit.removeprefix("rad/")
    seconds = SECONDS.get(name) or SECONDS.get(synonym(name.lower(), SECONDS) or "")
    rate = _RADIANS.get(unit) or (1.0 / seconds if per and seconds else None)
    named = f"{'rad/' if rate else ''}{time_unit or 'time_unit'}"
    if not rate and not seconds:
        return f"write the number without a unit: {number}"
    if time_unit is None:
        same = "" if rate else f": {number} if that is {unit}"
        return f"write the number alone, in {named}{same}"
    long = SECONDS[time_unit]
    worth = float(number) * (rate * long if rate else (seconds or 0.0) / long)
    return f"write {worth:.10g}: {'frequencies' if rate else 'times'} are in {named} here"
