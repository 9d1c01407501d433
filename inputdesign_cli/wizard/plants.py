"""The plant of an answer: stated, estimated from a step response, or explored in a log.

What cannot be used is a SpecError `bad-answer`, or a DataError about a file.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, SpecError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification import Spec
from inputdesign_cli.wizard.grammar import LARGEST, Phrase, needed, short
from inputdesign_cli.wizard.questions import bad_answer, file_of, in_their_words, package_data

_NONE: Mapping[str, float] = MappingProxyType({})
_QUANTITIES = {"gain": "gain", "time_constant": "time constant", "dead_time": "dead time|delay"}
_LEAST_ROWS = 10  # of a step response
_LONGER = 2.0  # a time constant of more records than this is none
_NOISE_BLOCK = re.compile(r"^noise:\n(?:[ ]+.*\n)+", re.M)  # of a model.yaml
_REJECTED = (
    "tests reject a gain, a time constant and a dead time ({}): the plant has another structure, or its "
    'level drifts, and neither the values nor their errors are to be trusted; "log {}" explores other '
    "structures"
)


@dataclass(frozen=True)
class PlantAnswer:
    """Holds what is known of the plant."""

    lines: tuple[str, ...]  # of the spec, with comments
    slow: float  # its slowest time constant, in seconds
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # of the parameters
    values: Mapping[str, float] = field(default_factory=dict)  # of the parameters
    controller: str | None = None  # of its usual operation, as YAML
    files: Mapping[str, bytes] = field(default_factory=dict)  # to be written next to the spec, by name
    covariance: str | None = None  # the name of the file with the covariance of the estimate
    sampling: float | None = None  # seconds between samples, where they are known already
    why_sampling: str = "as the plant is sampled"  # the reason for these
    tunable: bool = False  # whether rules of tuning know it
    channels: int = 1  # the larger number of its inputs and outputs
    explored: Spec | None = None  # the model of a log, which has its noise
    source: str = ""  # the name of the data file
    against: tuple[str, ...] = ()  # what the data say against the model, a sentence each

    @property
    def sample_time(self) -> float:
        """Return the sample time in seconds: a twentieth of the time constant, if nothing else is known."""
        return _round_step(self.slow / 20.0) if self.sampling is None else self.sampling


def _round_step(wanted: float) -> float:
    """Round down to 1, 2 or 5 times a power of ten."""
    decade = 10.0 ** np.floor(np.log10(wanted))
    return float(decade * max(step for step in (1.0, 2.0, 5.0, 10.0) if step * decade <= wanted * (1 + 1e-9)))


def understand_plant(text: str, stem: str, folder: Path) -> PlantAnswer:
    """Return the plant of an answer; stem of the spec and folder are for names of files."""
    word, _, rest = text.partition(" ")
    if text.lower() in TEMPLATES:
        return TEMPLATES[text.lower()]
    if word.lower() in ("step", "log") and rest.strip():
        path = file_of("plant", folder / rest.strip())
        with in_their_words({}, "plant"):
            return _stepped(path, stem) if word.lower() == "step" else _explored(path, stem)
    if text.endswith(".json"):
        return system_of(file_of("plant", folder / text))
    if re.search(r"\bgain\b", text, re.I):
        return plant_of_words(text)
    raise bad_answer("plant", f'"{text}" is none of these')


def plant_of_words(text: str, head: str = "plant:  # as you said") -> PlantAnswer:
    """Return the plant of "gain 2, time constant 180 s, dead time 25 s, each within 30 %"."""
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
    lines = (head, f"  continuous: {_listed(values)}", "  sample: zoh  # what a converter holds")
    return PlantAnswer(lines, slow, _around(values, shares), values, tunable=True)


def _listed(values: Mapping[str, float]) -> str:
    return "{" + ", ".join(f"{name}: {short(value)}" for name, value in values.items()) + "}"


def _around(values: Mapping[str, float], shares: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    ends = {name: sorted(values[name] * (1.0 + side * shares[name]) for side in (-1, 1)) for name in shares}
    return {name: (low, high) for name, (low, high) in ends.items()}


def _template(
    name: str, about: str, words: str = "", lines: str = "", values: Mapping[str, float] = _NONE, **more: Any
) -> PlantAnswer:
    head = f"plant:  # template {name}: {about}"
    if words:
        return plant_of_words(words, head)
    around = _around(values, dict.fromkeys(values, 0.2))
    text = (head, *(f"  {line}" for line in lines.splitlines()), "  sample: zoh")
    return PlantAnswer(text, intervals=around, values=values, **more)


TEMPLATES = {name: _template(name, **entry) for name, entry in package_data("known_plants.yaml").items()}


_Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]  # NaN is in no interval


class System(BaseModel):
    """Holds a system of python-control as JSON describes it."""

    model_config = ConfigDict(extra="forbid")
    num: list[_Number]
    den: list[_Number]
    delay: _Number = 0.0
    dt: object = None


def system_of(path: Path) -> PlantAnswer:
    """Return the plant of a JSON file with num and den in s, and a delay."""
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
    _refuse(
        {
            f"the system of {path.name} is sampled (dt), and is to be in s": bool(found.dt),
            f"num of {path.name} is zero": not num,
            f"den of {path.name} is zero": not den,
            f"num of {path.name} has more entries than den": len(num) > len(den),
            f"the delay in {path.name} is negative": found.delay < 0.0,
        }
    )
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


def _refuse(faults: Mapping[str, bool]) -> None:
    if fault := next((text for text, holds in faults.items() if holds), None):
        raise bad_answer("plant", fault)


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


def _stepped(path: Path, stem: str) -> PlantAnswer:
    """Estimate gain, time constant and dead time from a record that begins at rest."""
    from inputdesign_cli import parse_spec, questions
    from inputdesign_cli.questions.building.tables import read_columns

    found = read_columns(path, {"time": "time", "u": "u", "y": "y"}, key="plant")
    t, u, y = found["time"], found["u"], found["y"]
    begun, step, moves, answers = _step_in(path.name, t, u, y)
    rise = (y - y[0]) / answers
    late, slow = (max(float(t[int(np.argmax(rise > part))] - t[begun]), step) for part in (0.05, 0.632))
    start = f"gain: {answers / moves!r}, time_constant: {slow!r}, dead_time: {late!r}"
    text = f"sample_time: {step!r}\nplant: {{continuous: {{{start}}}, sample: zoh}}\n"
    point = {"u1": float(u[0]), "y1": float(np.mean(y[: max(begun, 1)]))}
    identified = questions.identify(parse_spec(text, design=False), path, operating_point=point)
    model, failed = identified.files["model.yaml"], identified.result["identification"]["failed"]
    values = dict(identified.result["identification"]["theta"])
    lasts = float(t[-1] - t[begun])
    if values["time_constant"] > _LONGER * lasts:
        raise bad_answer(
            "plant",
            f"the output in {path.name} still goes on as an integrator would, {short(lasts)} s after the "
            "step: record until it settles, or write a plant that integrates as a file, "
            '{"num": [0.05], "den": [1, 0], "delay": 5}',
        )
    return PlantAnswer(
        (f"plant:  # estimated from {path.name}", f"  continuous: {_listed(values)}", "  sample: zoh"),
        values["time_constant"],
        values=values,
        files={f"{stem}-model.yaml": model},
        covariance=f"{stem}-model.yaml",
        sampling=step,
        tunable=True,
        source=path.name,
        against=() if not failed else (_REJECTED.format(", ".join(failed).replace("_", " "), path.name),),
    )


def _step_in(name: str, t: Array, u: Array, y: Array) -> tuple[int, float, float, float]:
    """Return the row of the step, seconds between rows, and how far input and output (n,) move in the end."""
    if t.size < _LEAST_ROWS or not np.all(np.diff(t) > 0.0):
        raise bad_answer("plant", f"{name} needs {_LEAST_ROWS} rows at least, at times that grow")
    moved = np.abs(u - u[0])
    begun, last = int(np.argmax(moved > 0.5 * np.max(moved))), slice(-max(t.size // 20, 1), None)
    moves, answers = float(np.mean(u[last] - u[0])), float(np.mean(y[last]) - y[0])
    _refuse(
        {
            f"the input in {name} does not step": not np.any(moved) or begun + 5 >= t.size,
            f"the input in {name} does not stay where it has stepped to": abs(moves) < 0.5 * np.max(moved),
            f"the output in {name} does not answer the step": not answers,
        }
    )
    return begun, float(np.median(np.diff(t))), moves, answers


def _explored(path: Path, stem: str) -> PlantAnswer:
    """Explore a log as `idesign explore` does; the model is a file next to the spec."""
    from inputdesign_cli import parse_spec, questions

    found, name = questions.explore([path]), f"{stem}-model.yaml"
    if "model.yaml" not in found.results.files:
        why = "; ".join(found.reasons) or "no model deserves trust"
        raise bad_answer("plant", f"explore finds no model in {path.name}: {why}")
    text = found.results.files["model.yaml"].decode()
    spec = parse_spec(text, name, design=False)
    assert spec.plant.kind != "regression"
    channels = max(spec.plant.inputs, spec.plant.outputs)
    return PlantAnswer(
        (f"include: [{name}]  # the plant, explored in {path.name}",),
        20.0 * spec.sample_time,
        files={name: _NOISE_BLOCK.sub("", text).encode()},  # that stands in the spec
        covariance=name if channels == 1 else None,
        sampling=spec.sample_time,
        tunable=_is_process(spec),
        channels=channels,
        explored=spec,
        source=path.name,
        against=found.against,
    )


def _is_process(spec: Spec) -> bool:
    """Return whether rules of tuning know the plant."""
    from inputdesign_cli.questions.building.controllers import process_of

    try:
        process_of(spec)
    except SpecError:
        return False
    return True
