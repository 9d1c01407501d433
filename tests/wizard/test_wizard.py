"""The wizard: answers in words become a spec, and bad ones are told by the question."""

import json
from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import parse_spec, questions
from inputdesign_cli.errors import SpecError
from inputdesign_cli.wizard.composing import compose
from inputdesign_cli.wizard.plants import TEMPLATES
from inputdesign_cli.wizard.questions import QUESTIONS, read_answers
from inputdesign_cli.wizard.solving import lasting, verdict
from tests.support.wishes import ENGINEER

WISHES = {
    "heater": "PID loop with 6 dB",
    "tank": "PI loop with 6 dB",
    "motor": "parameters within 5 %",
    "axis": "Bode plot within 10 % from 1 to 100",
    "column": "prediction within 10 % up to 0.005",
}
ROWS = np.arange(100.0)
STEPS = np.where(ROWS >= 50, 1.0, 0.0)
DURATIONS = {"motor": "60 s", "axis": "60 s", "column": "10 h"}


def test_the_sentence_of_the_engineer_is_a_spec():
    spec = compose(ENGINEER, "x", Path()).spec()
    assert len(QUESTIONS) <= 10
    assert spec.uncertainty.intervals["gain"] == (1.4, 2.6)
    assert spec.accuracy.loop.peak == pytest.approx(10 ** (6 / 20))
    assert spec.accuracy.loop.tuning.simc is not None
    assert (spec.limits.amplitude.input, spec.signal.offset, spec.experiment.samples) == (5.0, 40.0, 720)
    assert spec.uncertainty.worst_case == 0.95
    assert spec.noise.variance == pytest.approx(0.04)
    assert spec.plant.continuous.time_constant == 180.0


@pytest.mark.parametrize("name", TEMPLATES)
def test_templates_are_specs_that_can_be_designed(name):
    answers = {**ENGINEER, "plant": name, "wish": WISHES[name], "time": DURATIONS.get(name, "1 h")}
    draft = compose(answers, "x", Path())
    spec = draft.spec().with_(uncertainty=None)
    questions.validate(spec)
    assert spec.closed_loop == (name == "tank")
    assert all("  #" in line or ":" in line for line in draft.text.splitlines()[1:])


def test_answers_come_from_a_file_and_from_options(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("plant: heater\ndrift: no\ntime: 1 h\nlimits: 1\n")
    expected = {"plant": "heater", "drift": "no", "time": "2 h", "limits": "1"}
    assert read_answers(file, ["time=2 h"]).texts == expected
    for wrong in (["tim=2 h"], ["2 h"]):
        with pytest.raises(SpecError) as caught:
            read_answers(file, wrong)
        assert caught.value.diagnostics[0].code == "bad-answer"


def test_noise_at_rest_is_white_or_not(tmp_path):
    rng = np.random.default_rng(1)
    e = 0.2 * rng.standard_normal(2000)
    v = np.zeros(2000)
    for t in range(1, 2000):
        v[t] = 0.9 * v[t - 1] + e[t]
    for name, y in (("white", e), ("coloured", v)):
        (tmp_path / f"{name}.csv").write_text("y\n" + "\n".join(map(repr, (20 + y).tolist())))
    white = compose({**ENGINEER, "noise": "rest white.csv"}, "x", tmp_path).spec().noise
    coloured = compose({**ENGINEER, "noise": "rest coloured.csv"}, "x", tmp_path).spec().noise
    assert white.variance == pytest.approx(0.04, rel=0.1)
    assert white.D is None or len(np.atleast_1d(white.D)) == 1
    assert coloured.variance == pytest.approx(0.04, rel=0.1)
    assert coloured.D[1] == pytest.approx(-0.9, abs=0.04)


def test_a_step_response_tells_the_plant_and_how_well(tmp_path):
    rng, t = np.random.default_rng(2), 5.0 * np.arange(400)
    y = 20 + 10 * 2.0 * np.where(t > 225, 1 - np.exp(-(t - 225) / 180), 0) + 0.2 * rng.standard_normal(400)
    u = np.where(t >= 200, 50.0, 40.0)
    rows = [f"{a!r},{b!r},{c!r}" for a, b, c in zip(t.tolist(), u.tolist(), y.tolist(), strict=True)]
    (tmp_path / "step.csv").write_text("\n".join(["time,u,y", *rows]))
    draft = compose({**ENGINEER, "plant": "step step.csv"}, "x", tmp_path)
    for name, content in draft.files.items():
        (tmp_path / name).write_bytes(content)
    plant = draft.spec().plant.continuous
    assert plant.gain == pytest.approx(2.0, rel=0.02)
    assert plant.time_constant == pytest.approx(180, rel=0.05)
    assert plant.dead_time == pytest.approx(25, abs=6)
    questions.validate(draft.spec().with_(**{"uncertainty.scenarios": 3}))


@pytest.mark.parametrize(
    ("u", "y", "t", "told"),
    [
        (STEPS, np.full(100, 3.0), ROWS, "does not answer"),
        (STEPS * (ROWS < 80), STEPS, ROWS, "does not stay"),
        (0 * STEPS, STEPS, ROWS, "does not step"),
        (STEPS, STEPS, 0 * ROWS, "times that grow"),
        (STEPS, STEPS, ROWS[::-1], "times that grow"),
        (STEPS[:3], STEPS[:3], ROWS[:3], "10 rows"),
    ],
)
def test_a_record_that_is_no_step_response_is_told(u, y, t, told, tmp_path):
    """Warnings are errors in these tests: nothing is divided by zero."""
    rows = [f"{a!r},{b!r},{c!r}" for a, b, c in zip(t.tolist(), u.tolist(), y.tolist(), strict=True)]
    (tmp_path / "step.csv").write_text("\n".join(["time,u,y", *rows]))
    with pytest.raises(SpecError, match=told) as caught:
        compose({**ENGINEER, "plant": "step step.csv"}, "x", tmp_path)
    assert caught.value.diagnostics[0].key == "plant"


def test_a_system_of_python_control_comes_as_a_file(tmp_path):
    (tmp_path / "g.json").write_text(json.dumps({"num": [2], "den": [180, 1], "delay": 25}))
    draft = compose({**ENGINEER, "plant": "g.json"}, "x", tmp_path)
    assert draft.spec().plant.continuous.delays == ((25.0,),)
    assert draft.spec().sample_time == 5.0


def test_a_length_that_does_is_found_where_the_error_does_not_fall_with_its_root():
    """Records that are shorter than the plant is slow tell far less, or cannot be designed."""
    spec, tried = compose(ENGINEER, "x", Path()).spec(), []

    def solve(changed):
        tried.append(changed.experiment.samples)
        if tried[-1] < 90:
            raise SpecError.because("too-short", "too short")
        return {"signal": {"worst_ratio": 20.0 / tried[-1], "samples": tried[-1]}, "samples": 0}

    _, second = verdict(spec, {"samples": 720, "signal": {"worst_ratio": 0.02}}, solve)
    assert tried == [50, 100]
    assert f"{lasting(500.0)} would do" in second


def test_every_question_has_an_example_that_is_understood():
    for text in ("35 to 45", "plus/minus 5", "plus/minus 5 around 40"):
        assert compose({**ENGINEER, "range": text}, "x", Path()).spec().limits.amplitude.input == 5.0
    limited = compose({**ENGINEER, "limits": "rate 0.5, output 3"}, "x", Path()).spec().limits
    assert (limited.rate, limited.amplitude.output) == (2.5, 3.0)
    drifting = compose({**ENGINEER, "drift": "yes"}, "x", Path())
    assert "drift: true" in drifting.text
    converter = (
        compose({**ENGINEER, "converter": "12 bits up to 100"}, "x", Path()).spec().signal.quantisation
    )
    assert (converter.bits, converter.range) == (12, 100.0)
    assert parse_spec(drifting.text).noise.drift


def test_a_margin_that_is_kept_is_said():
    """The gain margin of a peak Ms is Ms / (Ms - 1), its phase margin 2 asin(1 / (2 Ms))."""
    spec = parse_spec(
        "sample_time: 5\nplant: {continuous: {gain: 2, time_constant: 180, dead_time: 25}, sample: zoh}\n"
        "noise: {variance: 1.0e-6}\nexperiment: {samples: 240}\nlimits: {amplitude: 5}\n"
        "accuracy: {loop: {controller: {pid: {Kp: 1.5, Ti: 180}}, max_sensitivity_db: 6}}\n"
        "objective: best_accuracy\nspectrum: {type: multisine, lines: 30}\nsolver: {any_spectrum: false}\n"
    )
    result = questions.solve(spec).result
    said = " ".join(verdict(spec, result, lambda other: questions.solve(other).result))
    peak = 10.0 ** (6.0 / 20.0)
    assert f"a gain margin of {peak / (peak - 1.0):.3g}" in said
    assert f"a phase margin of {np.degrees(2.0 * np.arcsin(0.5 / peak)):.3g} degrees" in said
