"""What process control calls the signals of a loop, in the names of columns."""

from __future__ import annotations

import re
from collections.abc import Sequence

# Each word tells by itself whether a column holds the input, the output or the reference.
_WORDS = {
    **dict.fromkeys(("u", "input", "op", "mv"), "u"),
    **dict.fromkeys(("y", "output", "pv", "meas", "measured"), "y"),
    **dict.fromkeys(("sp", "setpoint", "ref", "reference"), "r"),
}
# These mean other things as well (carbon monoxide, a valve): they count beside one of those above.
_BESIDE = {**dict.fromkeys(("co", "out"), "u"), "cv": "y", "w": "r"}
# What is named after a thing or a quantity is usually this; it is proposed, and never taken unasked.
_LIKELY = {
    **dict.fromkeys(
        ("heater", "heating", "valve", "pump", "fan", "motor", "actuator", "duty", "command"), "u"
    ),
    **dict.fromkeys(("cmd", "drive", "manipulated", "steam", "reflux"), "u"),
    **dict.fromkeys(("temperature", "temp", "level", "flow", "pressure", "speed", "position", "sensor"), "y"),
    **dict.fromkeys(("concentration", "composition", "process", "response"), "y"),
}
_WITH_UNIT = re.compile(r"[(\[].*")
_NUMBER = re.compile(r"\d+")
_NUMBERED = re.compile(r"(.*[a-z])\d+")
_MILLIVOLTS = "mV"


def roles_of(names: Sequence[str]) -> list[str]:
    """Of each column `u`, `y` or `r` (a reference) where its name says so, else nothing."""
    sure = [_role(name, _WORDS) for name in names]
    return (
        [role or _role(name, _BESIDE) for role, name in zip(sure, names, strict=True)] if any(sure) else sure
    )


def likely_roles(names: Sequence[str]) -> list[str]:
    """The same, and where the names do not say it, `u` or `y` of what is usually one."""
    return [
        role or _role(_NUMBER.sub("", name), _LIKELY)
        for role, name in zip(roles_of(names), names, strict=True)
    ]


def _role(name: str, words: dict[str, str]) -> str:
    """What the words of a name say, if they agree; `FIC101.OP` and `pv_2 (degC)` have one."""
    plain = [word for word in re.split(r"[\W_]+", _WITH_UNIT.sub("", name)) if word != _MILLIVOLTS]
    bare = [_NUMBERED.sub(r"\1", word.lower()) if words is _WORDS else word.lower() for word in plain]
    found = {words[word] for word in bare if word in words}
    return found.pop() if len(found) == 1 else ""
