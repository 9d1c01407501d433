"""The plant of an answer: stated, estimated from a step response, or explored in a log."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import IdesignError, SpecError
from inputdesign_cli.specification import Spec
from inputdesign_cli.wizard.faults import in_their_words
from inputdesign_cli.wizard.grammar import short
from inputdesign_cli.wizard.questions import bad_answer, file_of
from inputdesign_cli.wizard.stated_plants import TEMPLATES, PlantAnswer, plant_of_words, system_of

_LEAST_ROWS = 10  # of a step response
_LONGER = 2.0  # a time constant of more records than this is none
_NOISE_BLOCK = re.compile(r"^noise:\n(?:[ ]+.*\n)+", re.M)  # of a model.yaml
_NOISES = ("noise: {variance: 1}", "noise: {variance: 1, drift: true, C: [1, -0.8]}")
_REJECTED = (
    "tests reject a gain, a time constant and a dead time ({}): the plant has another structure, or its "
    'level drifts, and neither the values nor their errors are to be trusted; "log {}" explores other '
    "structures"
)


def understand_plant(text: str, stem: str, folder: Path) -> PlantAnswer:
    """Return the plant of an answer.

    Args:
        stem: of the spec, for the names of files next to it.
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
        return plant_of_words(text)
    raise bad_answer("plant", f'"{text}" is none of these')


def _stepped(path: Path, stem: str) -> PlantAnswer:
    """Estimate gain, time constant and dead time from a record that begins at rest."""
    from inputdesign_cli import questions
    from inputdesign_cli.questions.building.tables import read_columns

    found = read_columns(path, {"time": "time", "u": "u", "y": "y"}, key="plant")
    t, u, y = found["time"], found["u"], found["y"]
    begun, step, moves, answers = _step_in(path.name, t, u, y)
    rise = (y - y[0]) / answers
    late, slow = (max(float(t[int(np.argmax(rise > part))] - t[begun]), step) for part in (0.05, 0.632))
    point = {"u1": float(u[0]), "y1": float(np.mean(y[: max(begun, 1)]))}
    structure = _lag(f"sample_time: {step!r}\n", gain=answers / moves, time_constant=slow, dead_time=late)
    identified = questions.identify(structure, path, operating_point=point)
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
    listed = ", ".join(f"{label}: {short(value)}" for label, value in values.items())
    return PlantAnswer(
        (f"plant:  # estimated from {path.name}", f"  continuous: {{{listed}}}", "  sample: zoh"),
        values["time_constant"],
        values=values,
        files={f"{stem}-model.yaml": model},
        covariance=f"{stem}-model.yaml",
        sampling=step,
        tunable=True,
        source=path.name,
        against=() if not failed else (_REJECTED.format(", ".join(failed).replace("_", " "), path.name),),
    )


def _lag(clock: str, noise: str = "", **values: float) -> Spec:
    """Return a spec of a gain, a lag and a dead time, which are to be estimated."""
    from inputdesign_cli import parse_spec

    listed = ", ".join(f"{name}: {value!r}" for name, value in values.items())
    text = f"{clock}plant: {{continuous: {{{listed}}}, sample: zoh}}\n{noise}"
    return parse_spec(text, design=False)


def _step_in(name: str, t: Array, u: Array, y: Array) -> tuple[int, float, float, float]:
    """Return the row of the step, seconds between rows, and how far input and output move in the end.

    Raises:
        SpecError: `bad-answer`, the record (n,) of the file of that name is no step response.
    """
    if t.size < _LEAST_ROWS or not np.all(np.diff(t) > 0.0):
        raise bad_answer("plant", f"{name} needs {_LEAST_ROWS} rows at least, at times that grow")
    moved = np.abs(u - u[0])
    begun, last = int(np.argmax(moved > 0.5 * np.max(moved))), slice(-max(t.size // 20, 1), None)
    moves, answers = float(np.mean(u[last] - u[0])), float(np.mean(y[last]) - y[0])
    faults = {
        f"the input in {name} does not step": not np.any(moved) or begun + 5 >= t.size,
        f"the input in {name} does not stay where it has stepped to": abs(moves) < 0.5 * np.max(moved),
        f"the output in {name} does not answer the step": not answers,
    }
    if fault := next((text for text, holds in faults.items() if holds), None):
        raise bad_answer("plant", fault)
    return begun, float(np.median(np.diff(t))), moves, answers


def _explored(path: Path, stem: str) -> PlantAnswer:
    """Explore a log as `idesign explore` does; the model is a file next to the spec."""
    from inputdesign_cli import parse_spec, questions

    found = questions.explore([path])
    name = f"{stem}-model.yaml"
    if "model.yaml" not in found.results.files:
        why = "; ".join(found.reasons) or "no model deserves trust"
        raise bad_answer("plant", f"explore finds no model in {path.name}: {why}")
    model, against = found.results.files["model.yaml"], found.against
    spec = parse_spec(model.decode(), name, design=False)
    plant, tunable, head = spec.plant, _is_process(spec), f"the plant, explored in {path.name}"
    assert plant.kind != "regression"
    channels = max(plant.inputs, plant.outputs)
    if not tunable and channels == 1 and (first := _first_order(path, spec)) is not None:
        model, tunable, against = first, True, ()
        spec = parse_spec(model.decode(), name, design=False)
        head = f"{path.name}: a gain, a lag and a dead time explain it, too"
    return PlantAnswer(
        (f"include: [{name}]  # {head}",),
        20.0 * spec.sample_time,
        files={name: _NOISE_BLOCK.sub("", model.decode()).encode()},  # that stands in the spec
        covariance=name if channels == 1 else None,
        sampling=spec.sample_time,
        tunable=tunable,
        channels=channels,
        explored=spec,
        source=path.name,
        against=against,
    )


def _is_process(spec: Spec) -> bool:
    """Return whether rules of tuning know the plant."""
    from inputdesign_cli.questions.building.controllers import process_of

    try:
        process_of(spec)
    except SpecError:
        return False
    return True


def _first_order(path: Path, explored: Spec) -> bytes | None:
    """Return model.yaml of a gain, a lag and a dead time in noise that may drift, if no test objects."""
    from inputdesign_cli import questions

    step = explored.sample_time
    clock = f"sample_time: {step!r}\ntime_unit: {explored.time_unit}\n"
    for noise in _NOISES:
        structure = _lag(clock, noise, gain=1.0, time_constant=10.0 * step, dead_time=1.5 * step)
        try:
            found = questions.identify(structure, path, remove_means=True)
        except IdesignError:
            continue
        if not found.result["identification"]["failed"]:
            return found.files["model.yaml"]
    return None
