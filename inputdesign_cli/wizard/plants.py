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
_GAP = 1.5  # sample times from one row to the next: a sample is missing
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
    from inputdesign_cli import parse_spec, questions
    from inputdesign_cli.questions.building.tables import read_columns

    found = read_columns(path, {"time": "time", "u": "u", "y": "y"}, key="plant")
    t, u, y = found["time"], found["u"], found["y"]
    begun, step, moves, answers = _step_in(path.name, t, u, y)
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
            "step: it shows no gain and no time constant; record until it settles, or write a plant that "
            'integrates as a file, {"num": [0.05], "den": [1, 0], "delay": 5}',
        )
    listed = ", ".join(f"{label}: {short(value)}" for label, value in values.items())
    return PlantAnswer(
        (f"plant:  # estimated from {path.name}", f"  continuous: {{{listed}}}", "  sample: zoh"),
        values["time_constant"],
        values=values,
        files={name: model},
        covariance=name,
        sampling=step,
        tunable=True,
        source=path.name,
        against=() if not failed else (_REJECTED.format(", ".join(failed).replace("_", " "), path.name),),
    )


def _step_in(name: str, t: Array, u: Array, y: Array) -> tuple[int, float, float, float]:
    """Return the row of the step, seconds between rows, and how far input and output move in the end.

    Raises:
        SpecError: `bad-answer`, the record (n,) of the file of that name is no step response.
    """
    if t.size < _LEAST_ROWS or not np.all(np.diff(t) > 0.0):
        raise bad_answer("plant", f"{name} needs {_LEAST_ROWS} rows at least, at times that grow")
    step, moved = float(np.median(np.diff(t))), np.abs(u - u[0])
    if np.any(wide := np.diff(t) > _GAP * step):
        row, longest = int(np.argmax(wide)) + 3, float(np.max(np.diff(t)))
        raise bad_answer(
            "plant",
            f"the times in {name} have a gap before line {row} ({short(longest)} s, where rows are "
            f"{short(step)} s apart): a step response is one record without gaps; cut it to the part that "
            "has the step, or fill it in",
        )
    begun, last = int(np.argmax(moved > 0.5 * np.max(moved))), slice(-max(t.size // 20, 1), None)
    moves, answers = float(np.mean(u[last] - u[0])), float(np.mean(y[last]) - y[0])
    if not np.any(moved) or begun + 5 >= t.size:
        raise bad_answer("plant", f"the input in {name} does not step")
    if abs(moves) < 0.5 * np.max(moved):
        raise bad_answer("plant", f"the input in {name} does not stay where it has stepped to")
    if not answers:
        raise bad_answer("plant", f"the output in {name} does not answer the step")
    return begun, step, moves, answers


def _explored(path: Path, stem: str) -> PlantAnswer:
    """Explore a log as `idesign explore` does; the model is a file next to the spec."""
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
    """Return whether rules of tuning know the plant."""
    from inputdesign_cli.questions.building.controllers import process_of

    try:
        process_of(spec)
    except SpecError:
        return False
    return True


def _first_order(path: Path, explored: Spec) -> bytes | None:
    """Return model.yaml of a gain, a lag and a dead time in noise that may drift, if no test objects."""
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
