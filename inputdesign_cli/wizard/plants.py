"""The plant of an answer: stated, estimated from a step response, or explored in a log.

An answer that cannot be used is a SpecError `bad-answer`, or a DataError about a file.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from inputdesign_cli.errors import DataError, IdesignError, SpecError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.specification.models import fields
from inputdesign_cli.specification.models.units import SECONDS
from inputdesign_cli.wizard.grammar import ABOUT, LATE, SIGNAL, UP, VAGUE, Phrase, needed, short
from inputdesign_cli.wizard.questions import bad_answer, file_of, in_their_words, package_data

if TYPE_CHECKING:
    from inputdesign_cli.questions.building.controllers import Process
    from inputdesign_cli.questions.exploration.explore import Exploration
    from inputdesign_cli.records.sheet import Sheet

_NONE: Mapping[str, float] = MappingProxyType({})
_WHAT = rf"(?:(?:the )?(?:{SIGNAL}|room|tank|water))"
RISES = (
    rf"(?:{_WHAT} )?(?:{UP}"
    rf"|(?:reacts|responds|changes)(?= (?:by|with)\b|\s*{ABOUT}))(?: {_WHAT})?(?: by| with)?"
)
# Quantities of a plant -> their words, and the kind of their unit. A rise per time means an integrator.
QUANTITIES = {
    "rise": (RISES, "speed"),
    "slope": (r"integrat\w+(?: (?:with|gain|slope|by))*", "slope"),
    "gain": (rf"gain|{RISES}", "gain"),
    "time_constant": (r"time constant|lag|(?:reacts?|responds?)(?: with)?in", "time"),
    "dead_time": (LATE, "time"),
}
BARE_GAIN = (
    r"<ABOUT>?\s*<ALONE><NUMBER>(?:\s*[^\s\d,;|+±%][^\s,;|+±%]*)?\s*(?:/|\bper\b)\s*"
    r"(?!(?:cent|s|sec|second|min|minute|h|hour|d|day|position|setting|move)\b)(?:<NUMBER>\s*)?[^\s\d,;|]+"
    r"(?: of (?:the )?<DRIVE>)?(?:<WITHIN>)"
)
"""A gain without its name, as in "about 20 rad/s per V"; a time unit makes it a slope."""
NO_DELAY = (
    r"\b(?:(?:no|without|hardly any|negligible)\s+(?:[a-z]+able\s+)?(?:dead time|delay)"
    r"|(?:dead time|delay)(?:\s+is)?[:=]?\s+(?:none|zero|negligible))\b"
)
COLUMN = r"(?!(?:Kp|T[id]|M_?s|tau_c)\b)[a-z]\w*\s*=\s*(?:[^,;.|]|\.(?=\S))+"
"""A column of a file with its name, as in "u=valve", and no setting of a controller."""
_SLOWER = 4.0  # closed-loop time constant over the dead time, for the controller of an integrator
_SYSTEM = {"num", "den", "delay", "dt"}  # names as in python-control
_UNDELAYED = 0.5  # samples: a shorter dead time of a log counts as none
_FIT_LOSS = 2.0  # points of fit that a model may lose if rules of tuning apply to it
_LEAST_ROWS = 10  # rows of a step response
_LONGEST_LAG = 2.0  # times the step response: a longer time constant means an integrator
_NOISE_BLOCK = re.compile(r"^noise:\n(?:[ ]+.*\n)+", re.M)  # the block in a model.yaml
_REJECTED = (
    "tests reject a gain, a time constant and a dead time ({}): the plant has another structure, or its "
    'level drifts, and neither the values nor their errors are to be trusted; "log {}" explores other '
    "structures"
)
_AS_SAID = "plant:  # as you said"
# Parts of plants that descriptions often omit.
_UNNAMED = {"dead_time": "dead time", "time_constant": "lag of the actuator"}


@dataclass(frozen=True)
class PlantAnswer:
    """Holds the plant of an answer."""

    lines: tuple[str, ...]  # lines of the spec, with comments
    slow: float  # its slowest time constant, in time_unit
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # by parameter
    values: Mapping[str, float] = field(default_factory=dict)  # by parameter
    controller: str | None = None  # the controller in its usual operation, as YAML
    files: Mapping[str, bytes] = field(default_factory=dict)  # to be written next to the spec, by name
    covariance: str | None = None  # the name of the file with the covariance of the estimate
    sampling: float | None = None  # the sample time in time_unit, if it is known already
    why_sampling: str = "as the plant is sampled"  # the reason for it
    tunable: bool = False  # whether rules of tuning apply to it
    integrates: bool = False  # it has a pole at 0
    undelayed: bool = False  # one lag with hardly a dead time: such rules would give an excessive gain
    channels: int = 1  # the larger number of its inputs and outputs
    explored: Spec | None = None  # the model of a log, with its noise
    called: Mapping[str, str] = field(default_factory=dict)  # names of channels in a log
    source: str = ""  # the name of the data file
    against: tuple[str, ...] = ()  # evidence of the data against the model, a sentence each
    heard: tuple[str, ...] = ()  # remarks on how the answer was understood, a sentence each
    time_unit: str = "s"  # the unit of all times in the spec, from a record
    units: tuple[str, str] = ("", "")  # units of output and input, as in the gain

    @property
    def clock(self) -> float:
        """Return the unit of time in seconds."""
        return SECONDS[self.time_unit]

    @property
    def vague(self) -> bool:
        """Return whether the plant is known within bounds only, or with errors."""
        return self.covariance is not None or bool(self.intervals)

    @property
    def doubts(self) -> list[str]:
        """Return the evidence of the data against the model, a sentence each."""
        return [f"against the model of {self.source}: {one}" for one in self.against]

    def sampled_for(self, wish: str) -> PlantAnswer:
        """Return the plant sampled as fast as the derivative of a PID needs, if nothing else is known."""
        late = self.values.get("dead_time", 0.0)
        if self.sampling is not None or not late or not re.search(r"\bPID\b", wish, re.I):
            return self
        step = min(_round_step(late / 10.0), self.sample_time)
        return replace(self, sampling=step, why_sampling="a tenth of the dead time, or less, for a PID")

    @property
    def sample_time(self) -> float:
        """Return the sample time in time_unit: a twentieth of the time constant, if nothing else is known."""
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
        name, *named = re.split(r",?\s+(?:with\s+)?columns?:?\s+", rest.strip(), maxsplit=1)
        path, columns = file_of("plant", folder / name), _columns(*named)
        with in_their_words({}, "plant"):
            return (_stepped if word.lower() == "step" else _explored)(path, stem, columns)
    if text.endswith(".json"):
        return system_of(file_of("plant", folder / text))
    if re.search("|".join(rf"\b(?:{words})\b" for words, _ in QUANTITIES.values()), text, re.I):
        return plant_of_words(text)
    raise bad_answer("plant", f'"{text}" is none of these')


def _columns(text: str = "") -> dict[str, str]:
    """Return channel -> column of "time=Date, u=valve, y=level", as `explore --columns` takes them."""
    found = {}
    for part in filter(None, map(str.strip, re.split(r"[,;]|\s+and\s+(?=\w+\s*=)", text))):
        if (named := re.fullmatch(r"(?:(time)|([uy])(\d*))\s*=\s*(.+)", part)) is None:
            raise bad_answer("plant", f'"{part}" names no column, as u=valve and y=level do')
        found[named[1] or f"{named[2]}{named[3] or 1}"] = named[4].strip().strip("\"'")
    return found


def plant_of_words(text: str, head: str = _AS_SAID) -> PlantAnswer:
    """Return the plant of "gain 2, time constant 180 s, dead time 25 s, each within 30 %".

    An integrator has a slope in place of the gain: "integrates 0.02 %/s per %, dead time 20 s".
    """
    phrase = Phrase(text, "plant")
    none = {"dead_time"} if phrase.take(NO_DELAY) else set()
    read = {name: phrase.quantity(*words) for name, words in QUANTITIES.items()}
    found = {name: one for name, one in read.items() if one is not None}
    steady = [name for name in ("rise", "slope", "gain") if name in found]
    if len(steady) != 1 or not found[steady[0]].value:
        raise bad_answer("plant", "it does not say the gain, or says that it is zero, or says two")
    gain = found[steady[0]]
    if steady == ["gain"] and not gain.base and re.search(rf"\b(?:{UP})\b", text, re.I):
        raise bad_answer("plant", f'"{text}" names no move of the input: "1.5 degC per 10 %"')
    found = {name.replace("rise", "slope"): one for name, one in found.items()}
    own = {name: one.share for name, one in found.items() if one.share is not None}
    sampled = phrase.after(r"sampl(?:e|ing) time|sampled? every|sampling(?: every)?", "time", named=True)
    part, whole = phrase.share(), phrase.take(ABOUT)
    phrase.finish("known it tank")
    values = {name: one.value for name, one in found.items() if one.value}
    if "gain" in values or "time_constant" in found:
        needed(values.get("time_constant"), "plant", "the time constant")
    if values.get("dead_time", 0.0) < 0.0:
        raise bad_answer("plant", "the dead time is negative")
    vague = [name for name in values if name not in own and (whole or found[name].about)]
    if part is None and list(own) == list(values)[-1:] and not vague and not found[list(values)[-1]].itself:
        part, own = own.popitem()[1], {}  # a share at the end holds for all quantities
    shares = own if part is None else dict.fromkeys(values, part) | own
    if not all(0.0 < share < 0.9 for share in shares.values()):
        raise bad_answer("plant", "within must be more than 0 and less than 90 %")
    vague = [name for name in vague if name not in shares]
    around = _around(values, shares | dict.fromkeys(vague, VAGUE))
    ends = [
        f"{name.replace('_', ' ')} {short(around[name][0])} to {short(around[name][1])}" for name in vague
    ]
    taken = f'"about" is taken as within {100 * VAGUE:g} %: {", ".join(ends)}'
    heard = [f"{taken}; the design holds for all of these"] if vague else []
    if reacts := re.search(r"\b(?:reacts?|responds?)\b(?! (?:by|with|after|only)\b)", text, re.I):
        heard.append(f'"{reacts[0]}" is taken as the time constant, in which it gets 63 % of the way')
    missing = [what for name, what in _UNNAMED.items() if name not in {*found, *none}]
    if missing and head == _AS_SAID:
        heard.append(f"no {' and no '.join(missing)} was named: the design has none, a record may show it")
    plant = PlantAnswer(
        (head, f"  continuous: {_listed(values)}", "  sample: zoh  # what a converter holds"),
        values.get("time_constant", 0.0),
        around,
        values,
        sampling=None if sampled is None else needed(sampled, "plant", "the sample time"),
        why_sampling="as you said",
        tunable=True,
        undelayed="gain" in values and "dead_time" not in values,
        heard=tuple(heard),
        units=(gain.size, gain.base),
    )
    return _integrating(plant) if "slope" in values else plant


def _integrating(plant: PlantAnswer) -> PlantAnswer:
    """Return an integrator behind a lag and a dead time, under a slow PI controller by Skogestad's rule."""
    values = plant.values
    late = values.get("dead_time", 0.0) + values.get("time_constant", 0.0)
    if not late:
        raise bad_answer(
            "plant", "it integrates: say its dead time, however small, or the lag of its actuator"
        )
    below = "[time_constant, 1, 0]" if "time_constant" in values else "[1, 0]"
    delay = ", delay: dead_time" if "dead_time" in values else ""
    settings = f"Kp: {short(1.0 / (values['slope'] * _SLOWER * late))}, Ti: {short(4.0 * _SLOWER * late)}"
    written = f"{{numerator: [slope], denominator: {below}{delay}}}  # its pole at 0 is known"
    return replace(
        plant,
        lines=(
            plant.lines[0],
            f"  parameters: {_listed(values)}",
            f"  continuous: {written}",
            plant.lines[2],
        ),
        slow=values.get("time_constant", late),
        controller=f"{{pid: {{{settings}}}}}",
        integrates=True,
        sampling=plant.sampling or _round_step(late / 2.0),
        why_sampling="as you said" if plant.sampling else "half of dead time and lag, or a little less",
    )


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


def system_of(path: Path) -> PlantAnswer:
    """Return the plant of a JSON file with num and den in s, and a delay."""
    try:
        found = json.loads(read_regular(path))
    except (OSError, ValueError, RecursionError) as error:
        raise DataError(bad_answer("plant", f"{path.name} is not JSON: {error}").diagnostics) from None
    parts: list[Any] = [found.get("num"), found.get("den")] if isinstance(found, dict) else []
    if not parts or not all(fields.depth(part) == 1 for part in parts) or found.keys() - _SYSTEM:
        why = f'{path.name} does not hold {{"num": [2], "den": [180, 1], "delay": 25}} or the like'
        raise bad_answer("plant", why)
    if found.get("dt"):
        raise bad_answer("plant", f"the system of {path.name} is sampled (dt), and is to be in s")
    num, den = (np.trim_zeros(part, "f") or part for part in parts)
    late = found.get("delay", 0.0)
    with in_their_words({}, "plant"):  # the file describes no possible plant
        continuous = {"numerator": num, "denominator": den, "delay": late}
        Spec.from_dict({"plant": {"continuous": continuous, "sample": "zoh"}}, design=False)
    while num[-1] == den[-1] == 0.0:  # a zero at zero that cancels a pole
        num, den = num[:-1], den[:-1]
    integrates, poles = den[-1] == 0.0, np.roots(den)
    decays = -poles.real[poles.real < 0]
    if not decays.size and not (integrates and late):
        hint = ': write its dead time ("delay": 5), however small, or the lag of its actuator into den'
        why = f"the system of {path.name} has no stable pole, which would show how fast it is to be sampled"
        raise bad_answer("plant", why + hint * integrates)
    delay = f", delay: {short(late)}" if late else ""
    values: Mapping[str, float] = {}
    lines = [f"  continuous: {{numerator: {num}, denominator: {den}{delay}}}"]
    if integrates:
        values, lines = _named(num, den, late)
    return PlantAnswer(
        (f"plant:  # from {path.name}", *lines, "  sample: zoh"),
        float(1.0 / decays.min()) if decays.size else late,
        values=values,
        sampling=None if decays.size else _round_step(late / 2.0),
        why_sampling="half the dead time, rounded down, for it has no time constant",
        tunable=len(num) == 1 and len(den) in (2, 3) and bool(np.all(poles.imag == 0.0)),
        integrates=bool(integrates),
        undelayed=len(den) == 2 and not integrates and not late,
    )


def _named(num: Sequence[float], den: Sequence[float], late: float) -> tuple[dict[str, float], list[str]]:
    """Name every coefficient that is to be estimated; a pole at zero and the first entry of den are known."""
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
    return values, [f"  parameters: {{{listed}}}", f"  continuous: {written}  # its pole at 0 is known"]


def unit_of_time(sheet: Sheet, name: str) -> str:
    """Return the unit in which a column counts times: seconds, if the file does not say."""
    from inputdesign_cli.records.columns import named_columns, time_unit_in

    at = named_columns(sheet, name.lower())[0]
    full = sheet.header[at] if at < len(sheet.header) else name
    return time_unit_in(sheet, full, dated=sheet.columns[at].dated) or "s"


def _stepped(path: Path, stem: str, columns: Mapping[str, str]) -> PlantAnswer:
    """Estimate gain, time constant and dead time from a record that begins at rest."""
    from inputdesign_cli import questions
    from inputdesign_cli.questions.building.tables import read_columns
    from inputdesign_cli.records import Preparation, read_sheet

    wanted = {"time": "time", "u1": "u", "y1": "y"} | dict(columns)
    found = read_columns(path, wanted, key="plant")
    unit = unit_of_time(read_sheet(path, key="plant"), wanted["time"])
    t, u, y = (found[role] for role in ("time", "u1", "y1"))
    if t.size < _LEAST_ROWS or not np.all(np.diff(t) > 0.0):
        raise bad_answer("plant", f"{path.name} needs {_LEAST_ROWS} rows at least, at times that grow")
    moved, step = np.abs(u - u[0]), float(np.median(np.diff(t)))
    begun, last = int(np.argmax(moved > 0.5 * np.max(moved))), slice(-max(t.size // 20, 1), None)
    moves, answers = float(np.mean(u[last] - u[0])), float(np.mean(y[last]) - y[0])
    strays = abs(moves) < 0.5 * np.max(moved)
    for fault, holds in (
        (f"the input in {path.name} does not step", not np.any(moved) or begun + 5 >= t.size),
        (f"the input in {path.name} does not stay where it has stepped to", strays),
        (f"the output in {path.name} does not answer the step", not answers),
    ):
        if holds:
            raise bad_answer("plant", fault)
    rise = (y - y[0]) / answers
    late, slow = (max(float(t[int(np.argmax(rise > part))] - t[begun]), step) for part in (0.05, 0.632))
    start = f"gain: {answers / moves!r}, time_constant: {slow!r}, dead_time: {late!r}"
    text = f"sample_time: {step!r}\ntime_unit: {unit}\nplant: {{continuous: {{{start}}}, sample: zoh}}\n"
    point = {"u1": float(u[0]), "y1": float(np.mean(y[: max(begun, 1)]))}
    spec, named = parse_spec(text, design=False), Preparation(columns=columns)
    identified = questions.identify(spec, path, operating_point=point, preparation=named)
    model, failed = identified.files["model.yaml"], identified.result["identification"]["failed"]
    values = dict(identified.result["identification"]["theta"])
    lasts = float(t[-1] - t[begun])
    if values["time_constant"] > _LONGEST_LAG * lasts:
        raise bad_answer(
            "plant",
            f"the output in {path.name} still goes on as an integrator would, {short(lasts)} {unit} after "
            "the step: record until it settles, or write a plant that integrates as a file, "
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
        time_unit=unit,
        against=() if not failed else (_REJECTED.format(", ".join(failed).replace("_", " "), path.name),),
    )


def _explored(path: Path, stem: str, columns: Mapping[str, str]) -> PlantAnswer:
    """Explore a log as `idesign explore` does; the model is a file next to the spec.

    A gain, a lag and a dead time, to which rules of tuning apply, are taken if they fit nearly as well.
    """
    from inputdesign_cli import questions
    from inputdesign_cli.plant.loop import INTEGRATES
    from inputdesign_cli.questions.building.system import build_model
    from inputdesign_cli.records import Preparation

    named, name = Preparation(columns=columns), f"{stem}-model.yaml"
    found = questions.explore([path], named)
    spec, process = _read(found, name)
    assert spec.plant.kind != "regression"
    channels, heard = max(spec.plant.inputs, spec.plant.outputs), ""
    if channels == 1 and process is None:
        with suppress(IdesignError):  # some logs do not determine all three
            simple = questions.explore([path], named, structure="fopdt")
            judged = (one.results.result["validation"] for one in (simple, found))
            fits = [one["simulation_fit_percent"] or 0.0 for one in judged]  # none: it diverges
            if not simple.reasons and fits[0] >= fits[1] - _FIT_LOSS:
                found, (spec, process) = simple, _read(simple, name)
                heard = f"another structure fits {path.name} a little better than gain, lag and dead time do"
    text = found.results.files["model.yaml"].decode()
    lag = None if process is None else process.time_constant
    late = 0.0 if process is None else process.dead_time - 0.5 * spec.sample_time  # without the hold
    return PlantAnswer(
        (f"include: [{name}]  # the plant, explored in {path.name}",),
        lag or 20.0 * spec.sample_time,
        files={name: _NOISE_BLOCK.sub("", text).encode()},  # the noise is written into the spec
        covariance=name if channels == 1 else None,
        sampling=spec.sample_time,
        tunable=process is not None,
        integrates=bool(np.any(np.abs(build_model(spec).plant_points) < INTEGRATES)),
        undelayed=lag is not None and late <= _UNDELAYED * spec.sample_time,
        channels=channels,
        explored=spec,
        called={channel: header for channel, header in columns.items() if channel != "time"},
        source=path.name,
        time_unit=spec.time_unit,
        against=(*found.reasons, *found.against),
        heard=(heard,) if heard else (),
    )


def _read(found: Exploration, name: str) -> tuple[Spec, Process | None]:
    """Return the model of an exploration as a spec, and its plant if rules of tuning apply to it."""
    from inputdesign_cli.questions.building.controllers import process_of

    spec = parse_spec(found.results.files["model.yaml"].decode(), name, design=False)
    try:
        return spec, process_of(spec)
    except SpecError:
        return spec, None
