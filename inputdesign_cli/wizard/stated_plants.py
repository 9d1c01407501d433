"""What is known of a plant, and plants that are stated: by the name of a template, by numbers, or in JSON."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from inputdesign_cli.errors import DataError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification import Spec
from inputdesign_cli.wizard.grammar import LARGEST, NUMBER, Phrase, needed, short
from inputdesign_cli.wizard.questions import bad_answer

_QUANTITIES = {"gain": "gain", "time_constant": "time constant", "dead_time": "dead time|delay"}
_STEPS = (1.0, 2.0, 5.0, 10.0)
_OF_DEAD_TIME = 0.5  # the sample time of a plant without a time constant


@dataclass(frozen=True)
class PlantAnswer:
    """What is known of the plant.

    Args:
        lines: of the spec, with comments.
        slow: its slowest time constant, in seconds.
        intervals: of the parameters whose errors are stated, by name.
        values: of the parameters, by name.
        controller: of its usual operation, as YAML.
        files: to be written next to the spec, by name.
        covariance: the name of the file with the covariance of the estimate.
        sampling: seconds between samples, where they are known already.
        why_sampling: the reason for these.
        tunable: whether rules of tuning know it.
        channels: the larger number of its inputs and outputs.
        explored: the model of a log, which has its noise.
        source: the name of the data file.
        against: what the data say against the model, a sentence each.
    """

    lines: tuple[str, ...]
    slow: float
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    controller: str | None = None
    files: Mapping[str, bytes] = field(default_factory=dict)
    covariance: str | None = None
    sampling: float | None = None
    why_sampling: str = "as the plant is sampled"
    tunable: bool = False
    channels: int = 1
    explored: Spec | None = None
    source: str = ""
    against: tuple[str, ...] = ()

    @property
    def sample_time(self) -> float:
        """Seconds between samples: a twentieth of the time constant, where nothing else is known."""
        return _round_step(self.slow / 20.0) if self.sampling is None else self.sampling


def _round_step(wanted: float) -> float:
    """Round down to 1, 2 or 5 times a power of ten."""
    decade = 10.0 ** np.floor(np.log10(wanted))
    return float(decade * max(step for step in _STEPS if step * decade <= wanted * (1 + 1e-9)))


def _around(values: Mapping[str, float], shares: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    ends = {name: sorted(values[name] * (1.0 + side * shares[name]) for side in (-1, 1)) for name in shares}
    return {name: (low, high) for name, (low, high) in ends.items()}


def plant_of_words(text: str, head: str = "plant:  # as you said") -> PlantAnswer:
    """Return the plant of "gain 2, time constant 180 s, dead time 25 s, each within 30 %".

    Args:
        head: the first line of the plant in the spec.

    Raises:
        SpecError: `bad-answer`.
    """
    for words in _QUANTITIES.values():
        said = re.findall(rf"\b(?:{words})\b[^,;]*?{NUMBER}", text, re.I)
        if len(said) > 1:
            what = words.split("|")[0]
            raise bad_answer("plant", f"it says the {what} more than once: {' and '.join(said)}")
    phrase = Phrase(text, "plant")
    kinds = dict.fromkeys(_QUANTITIES, "time") | {"gain": "gain"}
    read = {name: phrase.known_within(words, kinds[name]) for name, words in _QUANTITIES.items()}
    values = {name: found[0] for name, found in read.items() if found is not None}
    own = {name: found[1] for name, found in read.items() if found is not None and found[1] is not None}
    part = phrase.share()
    phrase.finish("known")
    if not values.get("gain"):
        raise bad_answer("plant", "it does not say the gain, or says that it is zero")
    slow = needed(values.get("time_constant"), "plant", "the time constant")
    if values.get("dead_time", 0.0) < 0.0:
        raise bad_answer("plant", "the dead time is negative")
    values = {name: value for name, value in values.items() if value}
    if part is None and len(own) == 1 and list(own) == list(values)[-1:]:
        part, own = own.popitem()[1], {}  # a share at the end is that of all quantities
    shares = own if part is None else dict.fromkeys(values, part) | own
    if not all(0.0 < share < 0.9 for share in shares.values()):
        raise bad_answer("plant", "within must be more than 0 and less than 90 %")
    listed = ", ".join(f"{name}: {short(value)}" for name, value in values.items())
    lines = (head, f"  continuous: {{{listed}}}", "  sample: zoh  # what a converter holds")
    return PlantAnswer(lines, slow, _around(values, shares), values, tunable=True)


def _template(lines: str, slow: float, controller: str | None = None, **values: float) -> PlantAnswer:
    around = _around(values, dict.fromkeys(values, 0.2))
    return PlantAnswer((*lines.split("\n"), "  sample: zoh"), slow, around, values, controller)


def _lag(words: str, head: str) -> PlantAnswer:
    stated = plant_of_words(f"{words}, within 20 %", head)
    return replace(stated, lines=(*stated.lines[:2], "  sample: zoh"))


TEMPLATES = {
    "heater": _lag("gain 2.1, time constant 180 s, dead time 25 s",
                   "plant:  # template heater: degrees over per cent of power"),
    "tank": _template(
        "plant:  # template tank: level over valve, it integrates\n"
        "  parameters: {k: 0.05, L: 5}\n  continuous: {numerator: [k], denominator: [1, 0], delay: L}",
        60.0, "{pid: {Kp: 0.8, Ti: 60}}", k=0.05, L=5.0,
    ),
    "motor": _lag("gain 0.1, time constant 0.5 s, dead time 0.02 s",
                  "plant:  # template motor: speed over voltage"),
    "axis": _template(
        "plant:  # template axis: a flexible axis, its first resonance\n"
        "  continuous: {gain: 1, damping: 0.1, natural_frequency: 30}",
        0.2, gain=1.0, damping=0.1, natural_frequency=30.0,
    ),
    "column": replace(
        _template(
            "plant:  # template column: two compositions over reflux and steam, seconds\n  continuous:\n"
            "    gain: [[12.8, -18.9], [6.6, -19.4]]\n    time_constant: [[1002, 1260], [654, 864]]\n"
            "    dead_time: [[60, 180], [420, 180]]",
            1000.0,
        ),
        sampling=60.0, channels=2,
    ),
}  # fmt: skip


_Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]  # NaN is in no interval


class System(BaseModel):
    """What a system of python-control in JSON may hold."""

    model_config = ConfigDict(extra="forbid")
    num: list[_Number]
    den: list[_Number]
    delay: _Number = 0.0
    dt: object = None


def system_of(path: Path) -> PlantAnswer:
    """Return the plant of a JSON file with num and den in s, and a delay.

    Raises:
        SpecError, DataError: `bad-answer`.
    """
    try:
        found = System.model_validate(json.loads(read_regular(path), object_pairs_hook=_once))
    except (OSError, ValueError, RecursionError) as error:
        why = str(error)
        if isinstance(error, ValidationError):
            first = error.errors()[0]
            why = ": ".join(filter(None, (".".join(map(str, first["loc"])), first["msg"])))
        why = f'{path.name} does not hold {{"num": [2], "den": [180, 1], "delay": 25}} or the like: {why}'
        raise DataError(bad_answer("plant", why).diagnostics) from None
    num, den, late = (*(np.trim_zeros(part, "f") for part in (found.num, found.den)), found.delay)
    faults = {
        f"the system of {path.name} is sampled (dt), and is to be in s": bool(found.dt),
        f"num of {path.name} is zero": not num,
        f"den of {path.name} is zero": not den,
        f"num of {path.name} has more entries than den": len(num) > len(den),
        f"the delay in {path.name} is negative": late < 0.0,
    }
    if fault := next((text for text, holds in faults.items() if holds), None):
        raise bad_answer("plant", fault)
    while num[-1] == den[-1] == 0.0:  # a zero at zero that cancels a pole
        num, den = num[:-1], den[:-1]
    integrates, poles = den[-1] == 0.0, np.roots(den)
    decays = -poles.real[poles.real < 0]
    if not decays.size and not (integrates and late):
        raise bad_answer("plant", _NO_TIME[integrates].format(file=path.name))
    lines, values = (_integrating if integrates else _as_given)(num, den, late)
    return PlantAnswer(
        (f"plant:  # from {path.name}", *lines, "  sample: zoh"),
        float(1.0 / decays.min()) if decays.size else late,
        values=values,
        sampling=None if decays.size else _round_step(_OF_DEAD_TIME * late),
        why_sampling="half the dead time, or a little less, for it has no time constant",
        tunable=len(num) == 1 and len(den) in (2, 3) and bool(np.all(poles.imag == 0.0)),
    )


_NO_TIME = {
    True: 'the system of {file} integrates and has no other pole and no delay, which would show how fast it '
    'is to be sampled: write its dead time ("delay": 5), however small, or the lag of its actuator into '
    'den, as in "den": [10, 1, 0]',
    False: "the system of {file} has no stable pole: its time constant is not known",
}  # fmt: skip


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Return a mapping in JSON; a key that stands there twice is a ValueError."""
    names = [name for name, _ in pairs]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise ValueError(f"it says {twice} more than once")
    return dict(pairs)


def _as_given(num: Sequence[float], den: Sequence[float], late: float) -> tuple[list[str], dict[str, float]]:
    delay = f", delay: {short(late)}" if late else ""
    return [f"  continuous: {{numerator: {num}, denominator: {den}{delay}}}"], {}


def _integrating(
    num: Sequence[float], den: Sequence[float], late: float
) -> tuple[list[str], dict[str, float]]:
    """Name every coefficient that is to be estimated; a pole at zero is known.

    The first entry of `den` has no name, since only ratios can be estimated.
    """
    names = [
        [f"{letter}{power}" for power in reversed(range(len(part)))]
        for letter, part in (("b", num), ("a", den))
    ]
    entries = dict(zip(chain(*names), chain(num, den), strict=True))
    values = {name: entry for name, entry in entries.items() if entry and name != names[1][0]}
    above, below = (
        ", ".join(name if name in values else repr(entries[name]) for name in part) for part in names
    )
    values |= {"L": late} if late else {}
    listed = ", ".join(f"{name}: {value!r}" for name, value in values.items())
    delay = ", delay: L" if late else ""
    return [
        f"  parameters: {{{listed}}}",
        f"  continuous: {{numerator: [{above}], denominator: [{below}]{delay}}}  # it is known to integrate",
    ], values
