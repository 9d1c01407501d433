"""The plant in the user's words: a template, numbers, a step response, a log, a system in JSON."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from inputdesign_cli.errors import IdesignError, SpecError
from inputdesign_cli.specification import Spec
from inputdesign_cli.wizard.faults import in_their_words
from inputdesign_cli.wizard.json_plants import system_of
from inputdesign_cli.wizard.phrases import NUMBER, Phrase, needed, short
from inputdesign_cli.wizard.plant_answer import PlantAnswer
from inputdesign_cli.wizard.questions import bad_answer, file_of

_QUANTITIES = {"gain": "gain", "time_constant": "time constant", "dead_time": "dead time|delay"}
_LEAST_ROWS = 10  # of a step response
_LONGER = 2.0  # a time constant of so many records is none
_GAP = 1.5  # sample times from one row to the next: a sample is missing
_NOISE_BLOCK = re.compile(r"^noise:\n(?:[ ]+.*\n)+", re.M)  # of a model.yaml
_NOISES = ("noise: {variance: 1}", "noise: {variance: 1, drift: true, C: [1, -0.8]}")


def _around(value: float, share: float) -> tuple[float, float]:
    ends = (value * (1.0 - share), value * (1.0 + share))
    return min(ends), max(ends)


def _template(
    lines: str, slow: float, late: float, controller: str | None = None, **values: float
) -> PlantAnswer:
    return PlantAnswer(
        tuple(lines.strip("\n").split("\n")),
        slow,
        late,
        {name: _around(value, 0.2) for name, value in values.items()},
        values,
        controller,
        tunable=controller is None and "natural_frequency" not in values and bool(values),
    )


TEMPLATES = {
    "heater": _template(
        "plant:  # template heater: degrees over per cent of power\n"
        "  continuous: {gain: 2.1, time_constant: 180, dead_time: 25}\n  sample: zoh",
        180.0, 25.0, gain=2.1, time_constant=180.0, dead_time=25.0,
    ),
    "tank": _template(
        "plant:  # template tank: level over valve, it integrates\n"
        "  parameters: {k: 0.05, L: 5}\n"
        "  continuous: {numerator: [k], denominator: [1, 0], delay: L}\n  sample: zoh",
        60.0, 5.0, "{pid: {Kp: 0.8, Ti: 60}}", k=0.05, L=5.0,
    ),
    "motor": _template(
        "plant:  # template motor: speed over voltage\n"
        "  continuous: {gain: 0.1, time_constant: 0.5, dead_time: 0.02}\n  sample: zoh",
        0.5, 0.02, gain=0.1, time_constant=0.5, dead_time=0.02,
    ),
    "axis": _template(
        "plant:  # template axis: a flexible axis, its first resonance\n"
        "  continuous: {gain: 1, damping: 0.1, natural_frequency: 30}\n  sample: zoh",
        0.2, 0.0, gain=1.0, damping=0.1, natural_frequency=30.0,
    ),
    "column": replace(
        _template(
            "plant:  # template column: two compositions over reflux and steam, seconds\n"
            "  continuous:\n"
            "    gain: [[12.8, -18.9], [6.6, -19.4]]\n"
            "    time_constant: [[1002, 1260], [654, 864]]\n"
            "    dead_time: [[60, 180], [420, 180]]\n  sample: zoh",
            1000.0, 420.0,
        ),
        sampling=60.0,
        channels=2,
    ),
}  # fmt: skip


def understand_plant(text: str, stem: str, folder: Path) -> PlantAnswer:
    """The plant of an answer.

    Args:
        stem: of the spec, for the names of files beside it.
        folder: what the names of files are relative to.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
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
        return _of_numbers(text)
    raise bad_answer("plant", f'"{text}" is none of these')


def _of_numbers(text: str) -> PlantAnswer:
    for words in _QUANTITIES.values():
        said = re.findall(rf"\b(?:{words})\b[^,;]*?{NUMBER}", text, re.I)
        if len(said) > 1:
            what = words.split("|")[0]
            raise bad_answer("plant", f"it says the {what} more than once: {' and '.join(said)}")
    phrase = Phrase(text, "plant")
    own: dict[str, float] = {}
    values: dict[str, float] = {}
    for name, words in _QUANTITIES.items():
        found = phrase.known_within(words, name != "gain")
        if found is not None:
            values[name] = found[0]
            own |= {} if found[1] is None else {name: found[1]}
    part = phrase.share()
    phrase.finish("known")
    if not values.get("gain"):
        raise bad_answer("plant", "it does not say the gain, or says that it is zero")
    slow = needed(values.get("time_constant"), "plant", "the time constant")
    late = values.get("dead_time", 0.0)
    if late < 0.0:
        raise bad_answer("plant", "the dead time is negative")
    values = {name: value for name, value in values.items() if value}
    if part is None and len(own) == 1 and list(own) == list(values)[-1:]:
        part, own = own.popitem()[1], {}  # what stands at the end is said of all
    shares = dict.fromkeys(values, part) | own if part is not None else own
    if not all(0.0 < share < 0.9 for share in shares.values()):
        raise bad_answer("plant", "within must be more than 0 and less than 90 %")
    listed = ", ".join(f"{name}: {short(value)}" for name, value in values.items())
    lines = (
        "plant:  # as you said",
        f"  continuous: {{{listed}}}",
        "  sample: zoh  # what a converter holds",
    )
    around = {name: _around(values[name], share) for name, share in shares.items()}
    return PlantAnswer(lines, slow, late, around, values, tunable=True)


def _stepped(path: Path, stem: str) -> PlantAnswer:
    """Gain, time constant and dead time estimated from a record that begins at rest."""
    from inputdesign_cli import parse_spec, questions
    from inputdesign_cli.questions.building.tables import read_columns

    found = read_columns(path, {"time": "time", "u": "u", "y": "y"}, key="plant")
    t, u, y = found["time"], found["u"], found["y"]
    if t.size < _LEAST_ROWS or not np.all(np.diff(t) > 0.0):
        raise bad_answer("plant", f"{path.name} needs {_LEAST_ROWS} rows at least, at times that grow")
    step, moved = float(np.median(np.diff(t))), u - u[0]
    if np.any(wide := np.diff(t) > _GAP * step):
        row, longest = int(np.argmax(wide)) + 3, float(np.max(np.diff(t)))
        raise bad_answer(
            "plant",
            f"the times in {path.name} have a gap before line {row} ({short(longest)} s, where rows are "
            f"{short(step)} s apart): a step response is one record without gaps; cut it to the part that "
            "has the step, or fill it in",
        )
    begun = int(np.argmax(np.abs(moved) > 0.5 * np.max(np.abs(moved))))
    if not np.any(moved) or begun + 5 >= t.size:
        raise bad_answer("plant", f"the input in {path.name} does not step")
    last = slice(-max(t.size // 20, 1), None)
    moves, answers = float(np.mean(moved[last])), float(np.mean(y[last]) - y[0])
    if abs(moves) < 0.5 * np.max(np.abs(moved)):
        raise bad_answer("plant", f"the input in {path.name} does not stay where it has stepped to")
    if not answers:
        raise bad_answer("plant", f"the output in {path.name} does not answer the step")
    rise = (y - y[0]) / answers
    slow = max(float(t[int(np.argmax(rise > 0.632))] - t[begun]), step)
    gain = answers / moves
    late = max(float(t[int(np.argmax(rise > 0.05))] - t[begun]), step)
    structure = parse_spec(
        f"sample_time: {step!r}\nplant: {{continuous: {{gain: {gain!r}, time_constant: {slow!r}, "
        f"dead_time: {late!r}}}, sample: zoh}}\n",
        design=False,
    )
    point = {"u1": float(u[0]), "y1": float(np.mean(y[: max(begun, 1)]))}
    identified = questions.identify(structure, path, operating_point=point)
    model, failed = identified.files["model.yaml"], identified.result["identification"]["failed"]
    name, fitted = f"{stem}-model.yaml", parse_spec(model.decode(), design=False).plant
    assert fitted.kind == "continuous"
    values = {one.label: one.value for one in fitted.named_parameters}
    lasts = float(t[-1] - t[begun])
    if values["time_constant"] > _LONGER * lasts:
        raise bad_answer(
            "plant",
            f"the output in {path.name} still goes on as an integrator would, {short(lasts)} s after the "
            "step: no gain and time constant are told; record until it settles, or write a plant that "
            'integrates as a file such as {"num": [0.05], "den": [1, 0], "delay": 5}',
        )
    listed = ", ".join(f"{label}: {short(value)}" for label, value in values.items())
    return PlantAnswer(
        (f"plant:  # estimated from {path.name}", f"  continuous: {{{listed}}}", "  sample: zoh"),
        values["time_constant"],
        values["dead_time"],
        values=values,
        files={name: model},
        covariance=name,
        sampling=step,
        tunable=True,
        source=path.name,
        against=_rejected(path, failed),
    )


def _rejected(path: Path, failed: Sequence[str]) -> tuple[str, ...]:
    """What to say of a step response that a gain, a time constant and a dead time do not explain."""
    if not failed:
        return ()
    tests = ", ".join(name.replace("_", " ") for name in failed)
    return (
        f"tests reject a gain, a time constant and a dead time ({tests}): the plant has another structure, "
        "or its level drifts, and neither the values nor how well they are told to be known are to be "
        f'trusted; "log {path.name}" explores other structures',
    )


def _explored(path: Path, stem: str) -> PlantAnswer:
    """The model of `idesign explore`, in a file beside the spec."""
    from inputdesign_cli import parse_spec, questions

    found = questions.explore([path])
    name = f"{stem}-model.yaml"
    if "model.yaml" not in found.results.files:
        why = "; ".join(found.reasons) or "no model deserves trust"
        raise bad_answer("plant", f"explore finds no model in {path.name}: {why}")
    model = found.results.files["model.yaml"]
    spec = parse_spec(model.decode(), name, design=False)
    step, plant = spec.sample_time, spec.plant
    assert plant.kind != "regression"
    lines = (f"include: [{name}]  # the plant, explored in {path.name}",)
    channels, against = max(plant.inputs, plant.outputs), found.against
    tunable = _is_process(spec)
    if not tunable and channels == 1 and (first := _first_order(path, spec)) is not None:
        lines = (f"include: [{name}]  # {path.name}: a gain, a lag and a dead time explain it, too",)
        model, tunable, against = first, True, ()
        spec = parse_spec(model.decode(), name, design=False)
    return PlantAnswer(
        lines,
        20.0 * step,
        0.0,
        files={name: _NOISE_BLOCK.sub("", model.decode()).encode()},  # that stands in the spec
        covariance=name if channels == 1 else None,
        sampling=step,
        tunable=tunable,
        channels=channels,
        explored=spec,
        source=path.name,
        against=against,
    )


def _is_process(spec: Spec) -> bool:
    """Whether rules of tuning know the plant."""
    from inputdesign_cli.questions.building.controllers import process_of

    try:
        process_of(spec)
    except SpecError:
        return False
    return True


def _first_order(path: Path, explored: Spec) -> bytes | None:
    """model.yaml of a gain, a time constant and a dead time, where no test speaks against it.

    The noise may drift.
    """
    from inputdesign_cli import parse_spec, questions

    step = explored.sample_time
    clock = f"sample_time: {step!r}\ntime_unit: {explored.time_unit}\n"
    process = f"{{gain: 1, time_constant: {10 * step!r}, dead_time: {1.5 * step!r}}}"
    begun = f"{clock}plant: {{continuous: {process}, sample: zoh}}\n"
    for noise in _NOISES:
        try:
            found = questions.identify(parse_spec(begun + noise, design=False), path, remove_means=True)
        except IdesignError:
            continue
        if not found.result["identification"]["failed"]:
            return found.files["model.yaml"]
    return None
