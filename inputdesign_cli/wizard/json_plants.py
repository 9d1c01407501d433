"""The plant as a system of python-control in JSON: num and den in s, and a delay."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from inputdesign_cli.errors import DataError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.wizard.phrases import LARGEST, short
from inputdesign_cli.wizard.plant_answer import PlantAnswer, round_step
from inputdesign_cli.wizard.questions import bad_answer

_KEYS = {"num", "den", "delay", "dt"}
_OF_DEAD_TIME = 0.5  # the sample time of a plant that has no time constant


def system_of(path: Path) -> PlantAnswer:
    """The plant of a file.

    Raises:
        SpecError, DataError: `bad-answer`.
    """
    try:
        data = json.loads(read_regular(path), object_pairs_hook=_once)
        if not isinstance(data, dict):
            raise ValueError("it is no mapping in braces")
        num, den = (_numbers(name, data.get(name)) for name in ("num", "den"))
        late = _number("delay", data.get("delay", 0.0))
        if strange := sorted(data.keys() - _KEYS):
            raise ValueError(f"it has {strange[0]}, too, which is none of {', '.join(sorted(_KEYS))}")
        sampled = bool(data.get("dt"))
    except (OSError, ValueError, RecursionError) as error:
        why = f'{path.name} does not hold {{"num": [2], "den": [180, 1], "delay": 25}} or the like: {error}'
        raise DataError(bad_answer("plant", why).diagnostics) from None
    num, den = (np.trim_zeros(part, "f") for part in (num, den))
    if sampled:
        raise bad_answer("plant", f"the system of {path.name} is sampled (dt), and is to be in s")
    for name, part in (("num", num), ("den", den)):
        if not part:
            raise bad_answer("plant", f"{name} of {path.name} is zero")
    if len(num) > len(den):
        raise bad_answer("plant", f"num of {path.name} has more entries than den")
    if late < 0.0:
        raise bad_answer("plant", f"the delay in {path.name} is negative")
    while num[-1] == den[-1] == 0.0:  # a zero at zero that cancels a pole
        num, den = num[:-1], den[:-1]
    poles = np.roots(den)
    decays = -poles.real[poles.real < 0]
    if not decays.size and not (den[-1] == 0.0 and late):
        raise bad_answer("plant", _no_time(path.name, den[-1] == 0.0))
    lines, values = _integrating(num, den, late) if den[-1] == 0.0 else _as_given(num, den, late)
    return PlantAnswer(
        (f"plant:  # from {path.name}", *lines, "  sample: zoh"),
        float(1.0 / decays.min()) if decays.size else late,
        late,
        values=values,
        sampling=None if decays.size else round_step(_OF_DEAD_TIME * late),
        why_sampling="half the dead time, or a little less, for it has no time constant",
        tunable=len(num) == 1 and len(den) in (2, 3) and bool(np.all(poles.imag == 0.0)),
    )


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """A mapping in JSON.

    Raises:
        ValueError: a key stands there twice.
    """
    names = [name for name, _ in pairs]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise ValueError(f"it says {twice} more than once")
    return dict(pairs)


def _no_time(file: str, integrates: bool) -> str:
    """What is wrong with a system whose poles tell no time constant."""
    if integrates:
        return (
            f"the system of {file} integrates and has no other pole and no delay, which would tell how "
            'fast it is to be sampled: write its dead time ("delay": 5), however small, or the lag of what '
            'moves it into den, such as "den": [10, 1, 0]'
        )
    return f"the system of {file} has no stable pole: its time constant is not known"


def _numbers(name: str, value: object) -> list[float]:
    """The numbers of a list in JSON.

    Raises:
        ValueError: it is none, or they cannot be meant.
    """
    if not isinstance(value, list):
        raise ValueError(f"it has no {name}" if value is None else f"{name} is no list of numbers")
    return [_number(name, entry) for entry in value]


def _number(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{json.dumps(value)} in {name} is no number")
    if not abs(value) <= LARGEST:  # NaN is not, either
        raise ValueError(f"a number of {name} is not finite, or beyond {LARGEST:g}")
    return float(value)


def _as_given(num: Sequence[float], den: Sequence[float], late: float) -> tuple[list[str], dict[str, float]]:
    delay = f", delay: {short(late)}" if late else ""
    return [f"  continuous: {{numerator: {num}, denominator: {den}{delay}}}"], {}


def _integrating(
    num: Sequence[float], den: Sequence[float], late: float
) -> tuple[list[str], dict[str, float]]:
    """A pole at zero is known: what is not zero has a name, to be estimated.

    The first entry of `den` has none, since only ratios can be told.
    """
    parts = (("b", num), ("a", den))
    names = [[f"{letter}{power}" for power in reversed(range(len(part)))] for letter, part in parts]
    entries = dict(zip(chain(*names), chain(num, den), strict=True))
    scale = names[1][0]
    values = {name: entry for name, entry in entries.items() if entry and name != scale}
    above, below = (
        ", ".join(name if name in values else repr(entries[name]) for name in part) for part in names
    )
    values |= {"L": late} if late else {}
    listed = ", ".join(f"{name}: {value!r}" for name, value in values.items())
    delay = ", delay: L" if late else ""
    known = "# it is known to integrate"
    return [
        f"  parameters: {{{listed}}}",
        f"  continuous: {{numerator: [{above}], denominator: [{below}]{delay}}}  {known}",
    ], values
