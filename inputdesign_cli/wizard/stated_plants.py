"""What is known of a plant, and plants that are stated: by a template, in numbers, or in JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from inputdesign_cli.errors import DataError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification import Spec
from inputdesign_cli.wizard.grammar import LARGEST, Phrase, needed, short
from inputdesign_cli.wizard.questions import bad_answer, package_text

_NONE: Mapping[str, float] = MappingProxyType({})
_QUANTITIES = {"gain": "gain", "time_constant": "time constant", "dead_time": "dead time|delay"}


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
    return float(decade * max(step for step in (1.0, 2.0, 5.0, 10.0) if step * decade <= wanted * (1 + 1e-9)))


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


def _template(
    name: str, about: str, words: str = "", lines: str = "", values: Mapping[str, float] = _NONE, **more: Any
) -> PlantAnswer:
    head = f"plant:  # template {name}: {about}"
    if words:
        return plant_of_words(words, head)
    around = _around(values, dict.fromkeys(values, 0.2))
    text = (head, *(f"  {line}" for line in lines.splitlines()), "  sample: zoh")
    return PlantAnswer(text, intervals=around, values=values, **more)


TEMPLATES = {
    name: _template(name, **entry) for name, entry in yaml.safe_load(package_text("templates.yaml")).items()
}


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
        found = System.model_validate(json.loads(read_regular(path)))
    except (OSError, ValueError, RecursionError) as error:
        why = str(error)
        if isinstance(error, ValidationError):
            first = error.errors()[0]
            why = ": ".join(filter(None, (".".join(map(str, first["loc"])), first["msg"])))
        why = f'{path.name} does not hold {{"num": [2], "den": [180, 1], "delay": 25}} or the like: {why}'
        raise DataError(bad_answer("plant", why).diagnostics) from None
    num, den = (np.trim_zeros(part, "f") for part in (found.num, found.den))
    faults = {
        f"the system of {path.name} is sampled (dt), and is to be in s": bool(found.dt),
        f"num of {path.name} is zero": not num,
        f"den of {path.name} is zero": not den,
        f"num of {path.name} has more entries than den": len(num) > len(den),
        f"the delay in {path.name} is negative": found.delay < 0.0,
    }
    if fault := next((text for text, holds in faults.items() if holds), None):
        raise bad_answer("plant", fault)
    while num[-1] == den[-1] == 0.0:  # a zero at zero that cancels a pole
        num, den = num[:-1], den[:-1]
    integrates, poles = den[-1] == 0.0, np.roots(den)
    decays = -poles.real[poles.real < 0]
    if not decays.size and not (integrates and found.delay):
        hint = ': write its dead time ("delay": 5), however small, or the lag of its actuator into den'
        why = f"the system of {path.name} has no stable pole, which would show how fast it is to be sampled"
        raise bad_answer("plant", why + hint * integrates)
    values, lines = _named(num, den, found.delay) if integrates else ({}, _as_given(num, den, found.delay))
    return PlantAnswer(
        (f"plant:  # from {path.name}", *lines, "  sample: zoh"),
        float(1.0 / decays.min()) if decays.size else found.delay,
        values=values,
        sampling=None if decays.size else _round_step(found.delay / 2.0),
        why_sampling="half the dead time, or a little less, for it has no time constant",
        tunable=len(num) == 1 and len(den) in (2, 3) and bool(np.all(poles.imag == 0.0)),
    )


def _as_given(num: Sequence[float], den: Sequence[float], late: float) -> list[str]:
    delay = f", delay: {short(late)}" if late else ""
    return [f"  continuous: {{numerator: {num}, denominator: {den}{delay}}}"]


def _named(num: Sequence[float], den: Sequence[float], late: float) -> tuple[dict[str, float], list[str]]:
    """Name every coefficient that is to be estimated; a pole at zero is known, and so is the first of den."""
    values: dict[str, float] = {}
    rows = []
    for letter, part in (("b", num), ("a", den)):
        powers = [f"{letter}{power}" for power in reversed(range(len(part)))]
        entries = dict(zip(powers, part, strict=True))
        free = powers if letter == "b" else powers[1:]
        values |= {name: entries[name] for name in free if entries[name]}
        rows.append(", ".join(name if name in values else repr(v) for name, v in entries.items()))
    values |= {"L": late} if late else {}
    listed = ", ".join(f"{name}: {value!r}" for name, value in values.items())
    delay = ", delay: L" if late else ""
    written = f"{{numerator: [{rows[0]}], denominator: [{rows[1]}]{delay}}}"
    return values, [f"  parameters: {{{listed}}}", f"  continuous: {written}  # it is known to integrate"]
