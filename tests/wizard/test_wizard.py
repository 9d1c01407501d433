"""The wizard: answers in words become a spec with the simplest spectrum, and what it says of it."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from inputdesign_cli import parse_spec, questions
from inputdesign_cli.errors import SpecError
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.wizard.composing import compose, with_spectrum
from inputdesign_cli.wizard.noise import noise_lines
from inputdesign_cli.wizard.plants import TEMPLATES, PlantAnswer
from inputdesign_cli.wizard.questions import QUESTIONS, read_answers
from inputdesign_cli.wizard.solving import lasting, to_log, verdict
from inputdesign_cli.wizard.wishes import input_range
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
    assert len(QUESTIONS) <= 13
    assert spec.uncertainty.intervals["gain"] == (1.4, 2.6)
    assert spec.accuracy.loop.peak == pytest.approx(10 ** (6 / 20))
    assert spec.accuracy.loop.tuning.simc is not None
    assert (spec.limits.amplitude.input, spec.signal.offset, spec.experiment.samples) == (5.0, 40.0, 720)
    assert spec.uncertainty.worst_case == 0.95
    assert spec.noise.standard_deviation == pytest.approx(0.2)
    assert spec.noise.correlation_time == 40.0  # a fifth of the time constant, rounded
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
    np.savetxt(tmp_path / "step.csv", np.c_[t, u, y], delimiter=",", header="time,u,y", comments="")
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
    np.savetxt(tmp_path / "step.csv", np.c_[t, u, y], delimiter=",", header="time,u,y", comments="")
    with pytest.raises(SpecError, match=told) as caught:
        compose({**ENGINEER, "plant": "step step.csv"}, "x", tmp_path)
    assert caught.value.diagnostics[0].key == "plant"


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


def chosen(values, bound=1.0, rivals=()):
    """The draft and the spectra that were tried, of designs that reach these values."""
    tried = []

    def solve(spec):
        tried.append(spec.spectrum.order if spec.spectrum.type == "fir" else spec.spectrum.lines)
        number = len(tried) - 1
        found = {"objective": {"value": values[number], "any_spectrum_bound": bound}}
        return found | ({"foreseen": {"rivals": [{}] if number in rivals else []}})

    return with_spectrum(compose(ENGINEER, "x", Path()), solve), tried


@pytest.mark.parametrize(
    ("values", "bound", "rivals", "tried", "spectrum", "told"),
    [
        ((1.01,), 1.0, (), [20], "{type: fir, order: 20}", "by more than 1 %"),
        ((1.2, 1.015), 1.0, (), [20, 40], "{type: fir, order: 40}", "by more than 1.5 %"),
        ((1.5, 1.3, 1.05, 1.01), 1.0, (), [20, 40, 60, 120], "{type: multisine, lines: 120}", "1 %"),
        # No more unknowns help, and the bound leaves limits out.
        (
            (1.0,) * 5,
            0.05,
            (),
            [20, 40, 60, 120, 240],
            "{type: fir, order: 20}",
            "no better, as far as was tried",
        ),
        (
            (1.0,) * 5,
            None,
            (),
            [20, 40, 60, 120, 240],
            "{type: fir, order: 20}",
            "no better, as far as was tried",
        ),
        # Sinusoids begin badly, go on improving, and overtake.
        ((0.5, 0.4, 4.8, 1.7, 0.3), 0.299, (), [20, 40, 60, 120, 240], "{type: multisine, lines: 240}", "by"),
        # The first leaves another dead time open.
        ((1.0, 1.01), 1.0, (0,), [20, 40], "{type: fir, order: 40}", "by more than 1 %"),
    ],
)
def test_the_simplest_spectrum_that_is_near_to_every_other(values, bound, rivals, tried, spectrum, told):
    draft, seen = chosen(values, bound, rivals)
    assert seen == tried
    assert draft.spectrum == spectrum
    assert told in draft.text
    assert parse_spec(draft.text).spectrum.type == ("fir" if "fir" in spectrum else "multisine")


def test_gaps_are_told_without_exponents():
    draft, _ = chosen((1.9,) * 5)
    assert "by more than 90 %" in draft.text
    assert "e+" not in draft.text


@pytest.mark.slow
def test_the_record_does_not_repeat():
    """A record that repeats every 120 samples would tell a dead time up to 600 s only."""
    spec = compose(ENGINEER, "x", Path()).spec().with_(uncertainty=None, **{"signal.candidates": 1})
    found = questions.solve(spec)
    u = found.tables["signal"].columns["u1"] - 40.0
    assert found.result["foreseen"] == {"rivals": []}
    correlations = [abs(u[lag:] @ u[:-lag]) / (u @ u) for lag in range(60, 480)]
    assert max(correlations) < 0.5
    assert np.abs(u).max() <= 5.0


def test_a_log_is_explored(tmp_path):
    """The static gain of 0.5 q^-2/(1 - 0.8 q^-1) is 2.5."""
    rng = np.random.default_rng(3)
    u, y = np.repeat(rng.choice([-1.0, 1.0], 50), 6), np.zeros(300)
    for t in range(2, 300):
        y[t] = 0.8 * y[t - 1] + 0.5 * u[t - 2]
    rows = np.c_[5.0 * np.arange(300), u, y + 0.05 * rng.standard_normal(300)]
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="time,u,y", comments="")
    wish = "prediction within 5 % up to 0.1"
    # What the log tells is not asked.
    asked = {key: text for key, text in ENGINEER.items() if key != "noise"}
    draft = compose({**asked, "plant": "log log.csv", "wish": wish}, "x", tmp_path)
    draft.validate()
    spec = draft.spec()
    assert spec.sample_time == 5.0
    assert spec.uncertainty.covariance == "x-model.yaml"
    gain = build_model(spec).plant_at(np.array([1e-6]))[0, 0, 0]
    assert abs(gain) == pytest.approx(2.5, rel=0.01)


@pytest.mark.slow
def test_a_drifting_log_of_a_lag_can_be_tuned_for(tmp_path):
    """A search over structures takes drift for a second lag and a zero, which no rule of tuning knows."""
    rng = np.random.default_rng(4)
    u = np.repeat(rng.choice([-5.0, 5.0], 60), 20)
    a, y = np.exp(-5.0 / 180.0), np.zeros(1200)
    for t in range(6, 1200):
        y[t] = a * y[t - 1] + 2.0 * (1.0 - a) * u[t - 6]  # 25 s: five samples, and that of the hold
    y += np.cumsum(0.03 * rng.standard_normal(1200)) + 0.05 * rng.standard_normal(1200)
    rows = np.c_[5.0 * np.arange(1200), u + 40.0, y + 60.0]
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="time,u,y", comments="")
    draft = compose({**ENGINEER, "plant": "log log.csv"}, "x", tmp_path)
    draft.validate()
    spec = draft.spec()
    assert spec.sample_time == 5.0
    assert spec.noise.variance == pytest.approx(0.04)
    assert np.sum(spec.noise.D) == pytest.approx(0.0, abs=1e-3)  # the drift
    plant = spec.plant.continuous
    assert plant.numerator == pytest.approx((2.0,), rel=0.05)
    assert plant.denominator == pytest.approx((180.0, 1.0), rel=0.05)
    assert plant.delay == pytest.approx(25.0, abs=1.0)


def _log(folder, samples=1200, *, beside=0.0):
    """The first-order plant above at rest in 60 and 40, with white noise of 0.3 on the output."""
    rng = np.random.default_rng(5)
    u, y = np.repeat(rng.choice([-5.0, 5.0], samples // 20), 20), np.zeros(samples)
    time, a = 5.0 * np.arange(samples), np.exp(-5.0 / 180.0)
    for t in range(6, samples):
        y[t] = a * y[t - 1] + 2.0 * (1.0 - a) * u[t - 6]
    y += 0.3 * rng.standard_normal(samples) + beside * np.sin(time / 200.0)
    np.savetxt(
        folder / "log.csv", np.c_[time, u + 40.0, y + 60.0], "%.6g", ",", header="time,u,y", comments=""
    )


@pytest.mark.slow
@pytest.mark.parametrize(("drift", "drifts"), [("yes", True), ("no", False), ("not known", False)])
def test_the_noise_that_is_stated_holds_beside_a_log(tmp_path, drift, drifts):
    _log(tmp_path)
    answers = {**ENGINEER, "plant": "log log.csv", "noise": "standard deviation 0.2", "drift": drift}
    draft = compose(answers, "x", tmp_path)
    draft.validate()
    noise = draft.spec().noise
    assert noise.variance == pytest.approx(0.04, rel=1e-5)
    assert noise.drift == drifts
    assert "the log has a variance of 0.08" in draft.text


@pytest.mark.slow
def test_a_log_may_tell_more_noise_than_the_resolution_leaves(tmp_path):
    _log(tmp_path)
    answers = {**ENGINEER, "plant": "log log.csv", "noise": "resolution 0.1"}
    draft = compose(answers, "x", tmp_path)
    draft.validate()
    assert draft.spec().noise.variance == pytest.approx(0.09, rel=0.1)


@pytest.mark.slow
def test_what_speaks_against_the_model_of_a_log_is_told(tmp_path):
    _log(tmp_path, 300, beside=4.0)
    wish = "prediction within 5 % up to 0.1"
    answers = {**ENGINEER, "plant": "log log.csv", "wish": wish, "loop": "PI Kp 0.5, Ti 180"}
    draft = compose(answers, "x", tmp_path)
    draft.validate()
    assert any("residuals" in one for one in draft.notes)
    for one in draft.notes:
        assert f"# against this model: {one.partition(': ')[2]}\n" in draft.text


def of_log(explored, text, drift):
    return noise_lines(text, drift, Path(), PlantAnswer((), 1.0, sampling=5.0, explored=explored))


@pytest.mark.parametrize("explored", ["plant: {A: [1, -0.7], B: [0, 1]}", "plant: {B: [0, 1], F: [1, -0.7]}"])
@pytest.mark.parametrize(
    ("text", "variance"),
    [("standard deviation 0.2", 0.04), ("resolution 0.1", 0.02), ("resolution 1", 1 / 12)],
)
def test_noise_of_a_stated_size_is_correlated_as_the_log_tells(explored, text, variance):
    """A pole at 0.7, whether A or D has it: the variance is that of e over 1 - 0.7^2; 0.02 by the log."""
    D = "" if "A:" in explored else ", D: [1, -0.7]"
    noise = f"noise: {{variance: {0.02 * (1 - 0.49):.6g}{D}}}"
    spec = parse_spec(f"sample_time: 5\n{explored}\n{noise}\n", design=False)
    lines = of_log(spec, text, "no")
    told = parse_spec("\n".join(["sample_time: 5", explored, *lines]), design=False)
    A = getattr(told.plant, "A", None) or (1.0,)
    assert np.convolve(A, told.noise.D).tolist() == [1.0, -0.7]
    assert told.noise.C == (1.0,)
    assert told.noise.variance == pytest.approx(variance * (1 - 0.49), rel=1e-5)


def test_noise_of_two_outputs_is_that_of_each():
    plant = "plant: {B: [[[0, 1]], [[0, 1]]], F: [[[1, -0.7]], [[1, -0.7]]]}"
    noise = "noise: {variance: [[0.1, 0], [0, 0.1]], D: [[1, -0.6], [1]]}"
    spec = parse_spec(f"sample_time: 5\n{plant}\n{noise}\n", design=False)
    lines = of_log(spec, "standard deviation 0.2", "no")
    told = parse_spec("\n".join(["sample_time: 5", plant, *lines]), design=False)
    np.testing.assert_allclose(told.noise.covariance(2), np.diag([0.04 * 0.64, 0.04]), rtol=1e-12)
    assert told.noise.D == spec.noise.D


def test_noise_that_is_said_to_drift_drifts_beside_a_log_that_does_not():
    """The variance is that of e over that of e / (1 - 0.7 q^-1)."""
    explored = parse_spec(
        "sample_time: 5\nplant: {A: [1, -0.7], B: [0, 1]}\nnoise: {variance: 1}\n", design=False
    )
    lines = of_log(explored, "standard deviation 0.2", "yes")
    told = parse_spec("\n".join(["plant: {A: [1, -0.7], B: [0, 1]}", *lines]), design=False).noise
    assert told.drift
    assert told.C == (1.0, -0.8)
    assert told.variance == pytest.approx(0.04 * (1 - 0.49), rel=1e-5)


def words(applied, caused, offset=None, **of_signal):
    spec = SimpleNamespace(signal=SimpleNamespace(offset=offset), sample_time=2.0, time_unit="s")
    tables = {
        "signal": SimpleNamespace(columns=dict.fromkeys(["time_s", *applied])),
        "predicted_output": SimpleNamespace(
            columns=dict.fromkeys(["time_s", *caused, *(f"{y}_noise_deviation" for y in caused)])
        ),
    }
    return to_log(spec, SimpleNamespace(tables=tables, result={"signal": of_signal}), "spec.yaml")


def test_all_channels_are_logged():
    apply, judge = words(["u1", "u2"], ["y1", "y2"], [40.0, 5.0])
    assert "apply signal.csv, and log time, u1, u2, y1 and y2 every 2 s" in apply
    assert "--operating-point u1=40,u2=5,y1=REST,y2=REST" in judge


def test_the_operating_point_is_the_one_that_the_record_swings_about():
    """A converter of 31 steps of 24/31 V has no level of 10 V."""
    _, judge = words(["u1"], ["y1"], 10.0, operating_point=[10.5])
    assert "--operating-point u1=10.5,y1=REST" in judge


def test_a_reference_is_no_position_of_the_actuator():
    apply, level, judge = words(["r1"], ["y1"], 40.0)
    assert "has the level 40 of the input in it: while y rests, u = r" in level
    assert "need not be logged" in level
    assert "u = r - C y" in apply
    assert "no position of the actuator" in apply
    assert "log time, u1 and y1" in apply
    assert "--operating-point u1=40,y1=REST" in judge


def told(ratio=0.5, there=None, solve=None, limits=None, **robust):
    """The sentences about a record of 720 samples, 5 s apart."""
    spec = compose({**ENGINEER, **({"limits": limits} if limits else {})}, "x", Path()).spec()
    signal = {"worst_ratio": ratio, "input_peak": [1.25 if limits else 5.0], "of_limits": {"rate": 1.0}}
    result = {"samples": 720, "signal": signal, **({"robust": robust} if robust else {})}
    missing = {"signal": {}}
    return " ".join(verdict(spec, result, solve or (lambda other: missing), there))


def told_of_the_margin(**robust):
    """The sentences about an own controller with 6 dB, where the loop is among what is required."""
    spec = compose({**ENGINEER, "wish": "own loop with 6 dB, Kp 0.5, Ti 180"}, "x", Path()).spec()
    loop = {"gain_margin": 2.0, "phase_margin": 29.0}
    signal = {"worst_ratio": 0.3, "input_peak": [5.0]}
    result = {"samples": 720, "signal": signal, "requirements": [{"loop": loop}], "robust": robust}
    return " ".join(verdict(spec, result, lambda other: {"signal": {}}))


def test_no_margin_is_promised_at_a_plant_that_the_controller_does_not_fit():
    promised = told_of_the_margin(scenarios=30)
    assert "enough: the model" in promised
    assert "The peak of |S| of the loop stays below 6 dB for every plant" in promised
    worst = {"scenario": 3, "peak": 10 ** (13.5 / 20), "parameters": {"gain": 1.2, "dead_time": 24.0}}
    floor = {"share": 0.1, "raised": [3, 5, 7], "lost": [3, 5], "worst": [worst]}
    said = told_of_the_margin(
        scenarios=30, floor=floor, fresh={"missed": 0, "largest": 0.9, "draws": 200, "raised": 55, "lost": 51}
    )
    assert "enough wherever this controller has the margin:" in said
    assert "at 2 of the 30 other plants that were tried and at 51 of 200 more" in said
    assert "such as gain 1.2, dead_time 24, where |S| reaches 13.5 dB" in said
    assert "the verdict of assess will be undecided" in said
    assert "At the other plants that were tried the peak of |S|" in said


def test_a_rate_that_binds_is_said():
    assert "60 min at plus/minus 5 is enough" in told()
    said = told(limits="rate 0.01")
    assert "plus/minus 5 (it moves by 1.25 at most; the rate is at the limit) is enough" in said


def test_a_length_that_would_do_is_shorter_than_the_record_that_does():
    def solve(changed):
        return {"signal": {"worst_ratio": 0.99, "samples": changed.experiment.samples}, "samples": 0}

    assert "would do" not in told(0.98, solve=solve)
    assert f"{lasting(5.0 * 434)} would do" in told(0.74, solve=solve)


def test_time_that_is_left_is_used():
    def solve(changed):
        ratio = 1.5 * (720 / changed.experiment.samples) ** 0.5
        return {"signal": {"worst_ratio": ratio, "samples": changed.experiment.samples}, "samples": 0}

    said = told(1.5, there=4 * 3600.0, solve=solve)
    assert "Of the 4 h that there are, 60 min were used" in said
    assert f"write duration: {5 * math.ceil(720 * 1.5**2 * 1.1)} into the spec" in said
    assert "write duration" not in told(1.5, there=3600.0, solve=solve)


@pytest.mark.parametrize(
    ("ratio", "fresh", "words"),
    [
        (0.5, {"missed": 0, "largest": 1.0}, "Nor is it worse at 200 more of them."),
        (0.5, {"missed": 9, "largest": 1.2}, "up to 0.6 times as much as is admitted, which is enough"),
        (0.9, {"missed": 9, "largest": 1.2}, "up to 1.08 times as much as is admitted, which is too much"),
    ],
)
def test_what_is_known_of_other_plants_is_said_in_words_of_the_wish(ratio, fresh, words):
    said = told(ratio, scenarios=30, fresh={"draws": 200, **fresh})
    assert words in said
    assert "drawn afresh" not in said


def test_a_record_that_is_just_enough_may_be_called_missed():
    """The data tell a plant at which the error is larger: a length has room for that."""
    robust = {"scenarios": 32, "estimates": {"draws": 100, "confidence": 0.95, "largest": 1.1}}

    def solve(changed):
        ratio = 0.95 * (720 / changed.experiment.samples) ** 0.5
        samples = changed.experiment.samples
        return {"signal": {"worst_ratio": ratio, "samples": samples}, "samples": samples, "robust": robust}

    said = told(0.95, solve=solve, **robust)
    assert "60 min at plus/minus 5 is enough" in said
    assert "5 % of experiments would give one at which it errs 1.04 times" in said
    assert f"{lasting(5.0 * math.ceil(720 * 1.1 * (0.95 * 1.1) ** 2))} would do" in said
    assert "missed" not in told(0.9, **robust)


def test_the_worst_plant_that_was_found_is_named():
    said = told(scenarios=32, searched={"added": 2, "parameters": {"gain": 1.4, "dead_time": 17.5}})
    assert "at 30 others" in said
    assert "at the worst one that a search found (gain 1.4, dead_time 17.5)" in said


@pytest.mark.parametrize(
    ("peaks", "words"),
    [
        ({"draws": 51, "largest": 1.05}, "at 51 of 200 more they go beyond, up to 105 % of a limit"),
        ({"draws": 0, "largest": 0.98}, "and at 200 more; noise comes on top of that"),
    ],
)
def test_limits_are_promised_for_the_plants_that_were_tried(peaks, words):
    said = told(scenarios=30, fresh={"draws": 200, "missed": 0, "largest": 1.0, "beyond_limits": peaks})
    assert "within your limits at the plant as you stated it and at 30 others" in said
    assert words in said


def test_the_column_is_told_once_what_can_be_done():
    for wish in ("PI loop with 6 dB", "own loop with 6 dB, Kp 1.5, Ti 180"):
        with pytest.raises(SpecError) as caught:
            compose({**ENGINEER, "plant": "column", "wish": wish}, "x", Path()).validate()
        (found,) = caught.value.diagnostics
        assert found.message.count("(wish)") == 1
        assert "has 2 channels" in found.message
        assert "prediction within 10 %" in found.message
    with pytest.raises(SpecError, match=r"\(loop\): the plant has 2 channels"):
        compose({**ENGINEER, "plant": "column", "loop": "PI Kp 1, Ti 60"}, "x", Path())


@pytest.mark.parametrize(
    "text", ["5 % around 40 %", "5 around 40", "plus/minus 5 around 40", "± 5 % around 40 %", "35 to 45"]
)
def test_ranges_in_many_words(text):
    span = input_range(text)
    assert (span.amplitude, span.offset) == (5.0, 40.0)


def test_what_is_not_used_for_a_bode_plot_is_said():
    wish = "Bode plot within 5 % from 0.005 to 0.05"
    draft = compose({**ENGINEER, "wish": wish, "time": "8 h"}, "x", Path())
    assert any("how well the plant is known is not used" in one for one in draft.notes)
    assert "# how well the plant is known is not used" in draft.text


def test_a_bode_plot_that_is_refused_says_which_time_would_do():
    """Harmonics of a fifth of an hour are 2 pi/720 s = 0.0087 rad/s apart."""
    answers = {**ENGINEER, "wish": "Bode plot within 5 % from 0.001 to 0.01"}
    with pytest.raises(SpecError) as caught:
        compose(answers, "x", Path()).validate()
    (told,) = caught.value.diagnostics
    assert "the band holds 1 harmonics" in told.message
    seconds = float(told.hint.split("take ")[1].split(" s or more")[0])
    compose({**answers, "time": f"{seconds:g} s"}, "x", Path()).validate()
    with pytest.raises(SpecError):
        compose({**answers, "time": f"{0.95 * seconds:g} s"}, "x", Path()).validate()
