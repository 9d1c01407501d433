"""The wizard: answers in words become a spec with the simplest spectrum, and a verdict in words."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from inputdesign_cli import parse_spec, questions
from inputdesign_cli.errors import SpecError
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.wizard.composing import compose, with_spectrum
from inputdesign_cli.wizard.noise import noise_lines
from inputdesign_cli.wizard.plants import TEMPLATES, PlantAnswer
from inputdesign_cli.wizard.questions import read_answers
from inputdesign_cli.wizard.solving import lasting, verdict
from tests.support.wishes import ENGINEER

WISHES = {
    "heater": ("PID loop with 6 dB", "1 h"),
    "tank": ("PI loop with 6 dB", "1 h"),
    "motor": ("parameters within 5 %", "60 s"),
    "axis": ("Bode plot within 10 % from 1 to 100", "60 s"),
    "column": ("prediction within 10 % up to 0.005", "10 h"),
}
ROWS = np.arange(100.0)
STEPS = np.where(ROWS >= 50, 1.0, 0.0)


def draft_of(folder=Path(), **answers):
    return compose({**ENGINEER, **answers}, "x", folder)


def saved(file, header, *columns):
    np.savetxt(file, np.c_[columns], "%.9g", ",", header=header, comments="")


def test_the_answers_of_an_engineer_become_a_spec():
    spec = draft_of().spec()
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
    wish, time = WISHES[name]
    draft = draft_of(plant=name, wish=wish, time=time)
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


@pytest.mark.parametrize("pole", [0.0, 0.9])
def test_the_variance_and_the_pole_of_noise_at_rest_are_estimated(pole, tmp_path):
    e = 0.2 * np.random.default_rng(1).standard_normal(2000)
    saved(tmp_path / "rest.csv", "y", 20 + lfilter([1], [1, -pole], e))
    noise = draft_of(tmp_path, noise="rest rest.csv").spec().noise
    assert noise.variance == pytest.approx(0.04, rel=0.1)
    assert np.pad(noise.D, (0, 2))[1] == pytest.approx(-pole, abs=0.04)


@pytest.mark.parametrize(("head", "unit", "scale"), [("time", "s", 1), ("time_min", "min", 60)])
def test_a_step_response_gives_the_plant_in_its_own_unit_of_time(head, unit, scale, tmp_path):
    """Stated times and frequencies, such as 0.02 rad/s, keep their meaning in any unit of the record."""
    rng, t = np.random.default_rng(2), 5.0 * np.arange(400)
    y = 20 + 10 * 2.0 * np.where(t > 225, 1 - np.exp(-(t - 225) / 180), 0) + 0.2 * rng.standard_normal(400)
    saved(tmp_path / "step.csv", f"{head},u,y", t / scale, np.where(t >= 200, 50.0, 40.0), y)
    said = {"wish": "prediction within 10 % up to 0.02", "noise": "0.2 degC that fades in a minute"}
    said |= {"limits": "rate 1 per minute", "hold": "14 s", "loop": "PI Kp 0.5, Ti 3 min"}
    draft = draft_of(tmp_path, plant="step step.csv", **said)
    for name, content in draft.files.items():
        (tmp_path / name).write_bytes(content)
    spec = draft.spec()
    plant = spec.plant.continuous
    assert plant.gain == pytest.approx(2.0, rel=0.02)
    assert plant.time_constant * scale == pytest.approx(180, rel=0.05)
    assert plant.dead_time * scale == pytest.approx(25, abs=6)
    assert (spec.time_unit, spec.experiment.samples, spec.signal.hold) == (unit, 720, 3)
    assert spec.sample_time * scale == pytest.approx(5.0)
    assert spec.noise.correlation_time * scale == pytest.approx(60.0)
    assert spec.limits.rate == pytest.approx(5 / 60)
    assert spec.accuracy.model_error.band[1] / scale == pytest.approx(0.02)
    assert spec.experiment.controller.pid.Ti * scale == pytest.approx(180.0)
    questions.validate(spec.with_(**{"uncertainty.scenarios": 3}))


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
def test_a_record_that_is_no_step_response_is_refused(u, y, t, told, tmp_path):
    """Warnings are errors in these tests: nothing is divided by zero."""
    saved(tmp_path / "step.csv", "time,u,y", t, u, y)
    with pytest.raises(SpecError, match=told) as caught:
        draft_of(tmp_path, plant="step step.csv")
    assert caught.value.diagnostics[0].key == "plant"


@pytest.mark.parametrize("refused", [True, False])
def test_the_length_that_would_do_is_neither_too_short_nor_of_few_samples(refused):
    """Fewer than 80 samples cannot be designed, or give a note on few samples; 100 samples would do."""
    spec, tried = draft_of().spec(), []

    def solve(changed):
        tried.append(samples := changed.experiment.samples)
        if refused and samples < 90:
            raise SpecError.because("too-short", "too short")
        few = [{"code": "few-samples", "message": "few"}] if samples < 80 else []
        ratio = 20.0 / samples if refused else 0.8
        return {"signal": {"worst_ratio": ratio, "samples": samples}, "samples": 0, "findings": few}

    _, second = verdict(spec, {"samples": 720, "signal": {"worst_ratio": 0.02}}, solve)
    assert tried == [50, 100]
    assert f"{lasting(500.0)} would do" in second


def test_a_margin_that_is_kept_is_stated_as_gain_and_phase_margin():
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


FIR, NO_BETTER, ALL = "{type: fir, order: 20}", "no better, as far as was tried", [20, 40, 60, 120, 240]


@pytest.mark.parametrize(
    ("values", "bound", "rivals", "tried", "spectrum", "told"),
    [
        ((1.01,), 1.0, (), ALL[:1], FIR, "more than 1 %"),
        ((1.2, 1.015), 1.0, (), ALL[:2], "{type: fir, order: 40}", "more than 1.5 %"),
        ((1.5, 1.3, 1.05, 1.01), 1.0, (), ALL[:4], "{type: multisine, lines: 120}", "1 %"),
        # More unknowns do not help, and the bound neglects limits.
        ((1.0,) * 5, 0.05, (), ALL, FIR, NO_BETTER),
        ((1.0,) * 5, None, (), ALL, FIR, NO_BETTER),
        # Sinusoids begin badly, go on improving, and overtake.
        ((0.5, 0.4, 4.8, 1.7, 0.3), 0.299, (), ALL, "{type: multisine, lines: 240}", "by"),
        # The first spectrum leaves another dead time open.
        ((1.0, 1.01), 1.0, (0,), ALL[:2], "{type: fir, order: 40}", "more than 1 %"),
        ((1.2, 1.1, 1.05, 1.03, 1.0), 1.0, (3, 4), ALL, "{type: multisine, lines: 60}", "5 %; better"),
        ((1.2, 1.0, 1.0, 1.0, 0.9), 0.05, (4,), ALL, "{type: fir, order: 40}", "other dead times open"),
        # The gap is written without exponents.
        ((1.9,) * 5, 1.0, (), ALL, FIR, "more than 90 %"),
    ],
)
def test_the_simplest_spectrum_near_to_the_best_is_taken(values, bound, rivals, tried, spectrum, told):
    seen = []

    def solve(spec):
        assert (spec.solver.any_spectrum, spec.uncertainty) == (True, None)
        seen.append(spec.spectrum.order if spec.spectrum.type == "fir" else spec.spectrum.lines)
        number = len(seen) - 1
        found = {"objective": {"value": values[number], "any_spectrum_bound": bound}}
        return found | {"foreseen": {"rivals": [{}] if number in rivals else []}}

    draft = with_spectrum(draft_of(), solve)
    assert (seen, draft.spectrum) == (tried, spectrum)
    assert told in draft.text
    assert "e+" not in draft.text
    assert parse_spec(draft.text).spectrum.type == ("fir" if "fir" in spectrum else "multisine")


@pytest.mark.parametrize(
    ("plant", "loop", "bounded", "candidates", "samples"),
    [
        (ENGINEER["plant"], "open", True, None, 5000),
        ("integrates about 0.2 %/min per %, dead time about 10 s", "as the plant", False, 1, 1000),
        ("integrates 0.2 %/min per %, dead time 10 s", "as the plant", True, None, 5000),  # one plant
    ],
)
def test_many_plants_each_in_its_loop_do_not_take_minutes(plant, loop, bounded, candidates, samples):
    """The bound over all spectra has each limit at each plant, and records are fitted to the limits there."""
    spec = draft_of(plant=plant, loop=loop, time="8 h").spec()
    assert (spec.closed_loop, spec.solver.any_spectrum) == (loop != "open", bounded)
    assert (spec.signal.candidates, spec.experiment.samples) == (candidates, samples)
    assert spec.uncertainty is None or spec.uncertainty.scenarios == (30 if bounded else 10)


@pytest.mark.slow
def test_the_record_is_not_periodic():
    """A record that repeats every 120 samples would determine a dead time up to 600 s only."""
    spec = draft_of().spec().with_(uncertainty=None, **{"signal.candidates": 1})
    found = questions.solve(spec)
    u = found.tables["signal"].columns["u1"] - 40.0
    assert found.result["foreseen"] == {"rivals": []}
    correlations = [abs(u[lag:] @ u[:-lag]) / (u @ u) for lag in range(60, 480)]
    assert max(correlations) < 0.5
    assert np.abs(u).max() <= 5.0


@pytest.mark.slow
def test_a_tank_found_in_a_log_gets_no_power_at_frequency_zero(tmp_path):
    """A tank behind a lagging valve integrates: power there would give unlimited information."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-4.0, 4.0], 75), 8)
    valve = lfilter([0, 0.2], [1, -0.8], u)
    y = np.cumsum(np.concatenate([[0.0], 0.1 * valve[:-1]])) + 0.05 * rng.standard_normal(600)
    saved(tmp_path / "log.csv", "time,u,y", 5.0 * np.arange(600), u, y)
    asked = {key: text for key, text in ENGINEER.items() if key != "noise"}
    draft = compose({**asked, "plant": "log log.csv", "wish": "PI loop with 6 dB"}, "x", tmp_path)
    draft.validate()
    assert draft.spec().experiment.controller is None
    assert draft.spec().spectrum.type == "multisine"


def test_a_log_is_explored_and_keeps_its_unit_of_time(tmp_path):
    """The static gain of 0.5 q^-2/(1 - 0.8 q^-1) is 2.5."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], 50), 6)
    y = lfilter([0, 0, 0.5], [1, -0.8], u) + 0.05 * rng.standard_normal(300)
    saved(tmp_path / "log.csv", "time_min,u,y", np.arange(300) / 12, u, y)
    # The noise is not asked, as the log contains it.
    asked = {key: text for key, text in ENGINEER.items() if key != "noise"}
    wish = "prediction within 5 % up to 0.1"
    draft = compose({**asked, "plant": "log log.csv", "wish": wish}, "x", tmp_path)
    draft.validate()
    spec = draft.spec()
    assert spec.sample_time == pytest.approx(1 / 12, rel=1e-4)
    assert (spec.experiment.samples, spec.uncertainty.covariance) == (720, "x-model.yaml")
    assert spec.accuracy.model_error.band[1] == pytest.approx(6.0)
    gain = build_model(spec).plant_at(np.array([1e-6]))[0, 0, 0]
    assert abs(gain) == pytest.approx(2.5, rel=0.01)


def first_order_log(folder, seed, samples=1200, *, size=1.0, noise):
    """Write a log of a lag about 40 and 60: gain 2, 180 s, dead time 25 s, with `noise` on the output."""
    rng = np.random.default_rng(seed)
    u, a = np.repeat(rng.choice([-5.0, 5.0], samples // 20), 20), np.exp(-5.0 / 180.0)
    y = lfilter([*np.zeros(6), 2.0 * (1.0 - a)], [1, -a], u) * size + noise(rng, 5.0 * np.arange(samples))
    saved(folder / "log.csv", "time,u,y", 5.0 * np.arange(samples), u + 40.0, y + 60.0)


def white(rng, time):
    return 0.3 * rng.standard_normal(time.size)


@pytest.mark.slow
def test_a_drifting_log_of_a_lag_gives_a_plant_that_can_be_tuned(tmp_path):
    """A search over structures takes drift for a second lag and a zero, which no rule of tuning covers."""

    def drifting(rng, time):
        return np.cumsum(0.03 * rng.standard_normal(time.size)) + 0.05 * rng.standard_normal(time.size)

    first_order_log(tmp_path, 4, noise=drifting)
    draft = draft_of(tmp_path, plant="log log.csv")
    draft.validate()
    spec = draft.spec()
    assert spec.sample_time == 5.0
    assert spec.noise.variance == pytest.approx(0.04)
    assert np.sum(spec.noise.D) == pytest.approx(0.0, abs=1e-3)  # the drift
    plant = spec.plant.continuous
    assert plant.numerator == pytest.approx((2.0,), rel=0.05)
    assert plant.denominator == pytest.approx((180.0, 1.0), rel=0.05)
    assert plant.delay == pytest.approx(25.0, abs=1.0)


@pytest.mark.slow
@pytest.mark.parametrize(("size", "loop"), [(1.0, "PI Kp 0.5, Ti 180"), (0.0, "open")])
def test_objections_to_the_model_of_a_log_stand_in_the_draft(size, loop, tmp_path):
    """A log without an effect of the input speaks against every model, and determines no lag."""
    swings = 4.0 * size
    first_order_log(
        tmp_path, 5, 300, size=size, noise=lambda rng, t: white(rng, t) + swings * np.sin(t / 200.0)
    )
    wish = "prediction within 5 % up to 0.1"
    draft = draft_of(tmp_path, plant="log log.csv", wish=wish, loop=loop)
    draft.validate()
    assert any(one.startswith("against the model of log.csv") for one in draft.notes)
    for one in draft.notes:
        assert f"# against this model: {one.partition(': ')[2]}\n" in draft.text


def of_log(plant, noise, text, drift="no"):
    """The spec of a log of this model with the stated noise, and the noise of the log."""
    spec = parse_spec(f"sample_time: 5\n{plant}\n{noise}\n", design=False)
    lines = noise_lines(text, drift, Path(), PlantAnswer((), 1.0, sampling=5.0, explored=spec))
    return parse_spec("\n".join(["sample_time: 5", plant, *lines]), design=False), spec.noise


@pytest.mark.parametrize("plant", ["plant: {A: [1, -0.7], B: [0, 1]}", "plant: {B: [0, 1], F: [1, -0.7]}"])
@pytest.mark.parametrize(
    ("text", "variance"),
    [("standard deviation 0.2", 0.04), ("resolution 0.1", 0.02), ("resolution 1", 1 / 12)],
)
def test_noise_of_a_stated_size_is_correlated_as_in_the_log(plant, text, variance):
    """A pole at 0.7, whether A or D has it: e has 1 - 0.7^2 times the stated variance; 0.02 by the log."""
    D = "" if "A:" in plant else ", D: [1, -0.7]"
    told, _ = of_log(plant, f"noise: {{variance: {0.02 * (1 - 0.49):.6g}{D}}}", text)
    A = getattr(told.plant, "A", None) or (1.0,)
    assert np.convolve(A, told.noise.D).tolist() == [1.0, -0.7]
    assert told.noise.C == (1.0,)
    assert told.noise.variance == pytest.approx(variance * (1 - 0.49), rel=1e-5)


def test_a_stated_size_of_noise_holds_for_each_of_two_outputs():
    plant = "plant: {B: [[[0, 1]], [[0, 1]]], F: [[[1, -0.7]], [[1, -0.7]]]}"
    noise = "noise: {variance: [[0.1, 0], [0, 0.1]], D: [[1, -0.6], [1]]}"
    told, logged = of_log(plant, noise, "standard deviation 0.2")
    np.testing.assert_allclose(told.noise.covariance(2), np.diag([0.04 * 0.64, 0.04]), rtol=1e-12)
    assert told.noise.D == logged.D


def test_noise_that_is_stated_to_drift_does_so_although_the_log_does_not():
    """The stated variance of 0.04 belongs to e / (1 - 0.7 q^-1)."""
    plant = "plant: {A: [1, -0.7], B: [0, 1]}"
    told = of_log(plant, "noise: {variance: 1}", "standard deviation 0.2", "yes")[0].noise
    assert (told.drift, told.C) == (True, (1.0, -0.8))
    assert told.variance == pytest.approx(0.04 * (1 - 0.49), rel=1e-5)


def sentences(ratio=0.5, there=None, solve=None, limits="none", **robust):
    """The sentences about a record of 720 samples, 5 s apart."""
    spec = draft_of(limits=limits).spec()
    peak = 5.0 if limits == "none" else 1.25
    signal = {"worst_ratio": ratio, "input_peak": [peak], "of_limits": {"rate": 1.0}}
    result = {"samples": 720, "signal": signal, **({"robust": robust} if robust else {})}
    return " ".join(verdict(spec, result, solve or (lambda other: {"signal": {}}), there))


def reaching(ratio, **robust):
    """A design whose error with 720 samples is `ratio` times the admitted one, and falls with their root."""

    def solve(changed):
        samples = changed.experiment.samples
        signal = {"worst_ratio": ratio * (720 / samples) ** 0.5, "samples": samples}
        return {"signal": signal, "samples": samples, "robust": robust}

    return solve


def test_no_margin_is_promised_at_a_plant_that_the_controller_does_not_fit():
    spec = draft_of(wish="own loop with 6 dB, Kp 0.5, Ti 180").spec()
    result = {
        "samples": 720,
        "signal": {"worst_ratio": 0.3, "input_peak": [5.0]},
        "robust": {"scenarios": 30},
    }
    result["requirements"] = [{"loop": {"gain_margin": 2.0, "phase_margin": 29.0}}]
    promised = " ".join(verdict(spec, result, lambda other: {"signal": {}}))
    assert "enough: the model" in promised
    assert "The peak of |S| of the loop stays below 6 dB for every plant" in promised
    worst = {"scenario": 3, "peak": 10 ** (13.5 / 20), "parameters": {"gain": 1.2, "dead_time": 24.0}}
    result["robust"] |= {
        "floor": {"share": 0.1, "raised": [3, 5, 7], "lost": [3, 5], "worst": [worst]},
        "fresh": {"missed": 0, "largest": 0.9, "draws": 200, "raised": 55, "lost": 51},
    }
    said = " ".join(verdict(spec, result, lambda other: {"signal": {}}))
    assert "enough wherever this controller has the margin:" in said
    assert "at 2 of the 30 other plants that were tried and at 51 of 200 more" in said
    assert "such as gain 1.2, dead_time 24, where |S| reaches 13.5 dB" in said
    assert "the verdict of assess will be undecided" in said
    assert "At the other plants that were tried the peak of |S|" in said


FRESH = {"draws": 200, "missed": 0, "largest": 1.0}
ESTIMATES = {"scenarios": 32, "estimates": {"draws": 100, "confidence": 0.95, "largest": 1.1}}


@pytest.mark.parametrize(
    ("said", "parts", "never"),
    [
        ({}, ["60 min at plus/minus 5 is enough"], []),
        ({"limits": "rate 0.01"},
         ["plus/minus 5 (it moves by 1.25 at most; the rate is at the limit) is enough"], []),
        # A length that would do is shorter than the record that does.
        ({"ratio": 0.98, "solve": reaching(0.1)}, [], ["would do"]),
        ({"ratio": 0.74, "solve": reaching(0.76)}, [f"{lasting(5.0 * 434)} would do"], []),
        # The remaining time is used.
        ({"ratio": 1.5, "there": 4 * 3600.0, "solve": reaching(1.5)},
         ["Of the 4 h that there are, 60 min were used",
          f"write duration: {5 * math.ceil(720 * 1.5**2 * 1.1)} into the spec"], []),
        ({"ratio": 1.5, "there": 3600.0, "solve": reaching(1.5)}, [], ["write duration"]),
        # Other plants are described in words of the wish.
        ({"scenarios": 30, "fresh": FRESH}, ["Nor is it worse at 200 more of them."], ["drawn afresh"]),
        ({"scenarios": 30, "fresh": FRESH | {"missed": 9, "largest": 1.2}},
         ["up to 0.6 times as much as is admitted, which is enough"], ["drawn afresh"]),
        ({"ratio": 0.9, "scenarios": 30, "fresh": FRESH | {"missed": 9, "largest": 1.2}},
         ["up to 1.08 times as much as is admitted, which is too much"], ["drawn afresh"]),
        # The error may be larger at the estimated plant; the stated length allows for that.
        ({"ratio": 0.95, "solve": reaching(0.95, **ESTIMATES), **ESTIMATES},
         ["60 min at plus/minus 5 is enough", "5 % of experiments would give one at which it errs 1.04 times",
          f"{lasting(5.0 * math.ceil(720 * 1.1 * (0.95 * 1.1) ** 2))} would do"], []),
        ({"ratio": 0.9, **ESTIMATES}, [], ["missed"]),
        ({"scenarios": 32, "searched": {"added": 2, "parameters": {"gain": 1.4, "dead_time": 17.5}}},
         ["at 30 others", "at the worst one that a search found (gain 1.4, dead_time 17.5)"], []),
        # Limits are promised for the plants that were tried.
        ({"scenarios": 30, "fresh": FRESH | {"beyond_limits": {"draws": 51, "largest": 1.05}}},
         ["within your limits at the plant of the spec and at 30 others",
          "at 51 of 200 more they go beyond, up to 105 % of a limit"], []),
        ({"scenarios": 30, "fresh": FRESH | {"beyond_limits": {"draws": 0, "largest": 0.98}}},
         ["within your limits at the plant of the spec and at 30 others",
          "and at 200 more; noise comes on top of that"], []),
    ],
)  # fmt: skip
def test_the_verdict_states_accuracy_length_and_limits(said, parts, never):
    found = sentences(**said)
    assert [one for one in parts if one not in found] == []
    assert [one for one in never if one in found] == []


def test_a_loop_for_the_column_is_refused_with_an_alternative():
    for wish in ("PI loop with 6 dB", "own loop with 6 dB, Kp 1.5, Ti 180"):
        with pytest.raises(SpecError) as caught:
            draft_of(plant="column", wish=wish).validate()
        (found,) = caught.value.diagnostics
        assert found.message.count("(wish)") == 1
        assert "has 2 channels" in found.message
        assert "prediction within 10 %" in found.message
    with pytest.raises(SpecError, match=r"\(loop\): the plant has 2 channels"):
        draft_of(plant="column", loop="PI Kp 1, Ti 60")


def test_an_answer_that_a_bode_plot_does_not_use_gives_a_remark():
    draft = draft_of(wish="Bode plot within 5 % from 0.005 to 0.05", time="8 h")
    assert any("how well the plant is known is not used" in one for one in draft.notes)
    assert "# how well the plant is known is not used" in draft.text


def test_the_refusal_of_a_bode_plot_states_a_time_that_would_do():
    """Harmonics of a fifth of an hour are 2 pi/720 s = 0.0087 rad/s apart."""
    wish = "Bode plot within 5 % from 0.001 to 0.01"
    with pytest.raises(SpecError) as caught:
        draft_of(wish=wish).validate()
    (told,) = caught.value.diagnostics
    assert "the band holds 1 harmonics" in told.message
    seconds = float(told.hint.split("take ")[1].split(" s or more")[0])
    draft_of(wish=wish, time=f"{seconds:g} s").validate()
    with pytest.raises(SpecError):
        draft_of(wish=wish, time=f"{0.95 * seconds:g} s").validate()


@pytest.mark.parametrize(
    ("said", "sizes"),
    [
        # A kelvin is a degree; millikelvins and millivolts are converted.
        ({"plant": "gain 2 K/V, time constant 180 s", "noise": "200 mK", "range": "4 V +- 500 mV",
          "limits": "rate 10 mV/s"}, {"offset": 4.0, "amplitude": 0.5, "rate": 0.05}),
        ({"plant": "gain 2 K/%, time constant 180 s", "noise": "0.2 °C, white", "range": "40 +- 5 %"},
         {"standard_deviation": None, "variance": 0.04, "offset": 40.0, "amplitude": 5.0}),
        ({"plant": "gain 2 degC per 10 %, time constant 3 min", "noise": "1.8 degF, white",
          "limits": "output 9 degF"}, {"gain": 0.2, "variance": 1.0, "output": 5.0}),
        ({"plant": "gain 2 bar/V, time constant 0.05 h", "noise": "resolution 100 mbar"},
         {"time_constant": 180.0, "variance": 0.01 / 12}),
        ({"plant": "a tank, level rises 2 % per minute per 10 % of valve, dead time 10 s"},
         {"slope": 1 / 300}),
    ],
)  # fmt: skip
def test_sizes_are_in_the_units_of_the_gain(said, sizes):
    text = draft_of(**said).text
    for name, size in sizes.items():
        found = [line.split(f"{name}: ")[1] for line in text.splitlines() if f"{name}: " in line]
        assert bool(found) == (size is not None)
        if size is not None:
            number = found[0].replace("}", " ").replace(",", " ").split()[0]
            assert float(number) == pytest.approx(size, rel=1e-5), name


@pytest.mark.parametrize(
    ("key", "text"),
    [("range", "40 +- 5 %"), ("range", "40 +- 5 stone"), ("noise", "0.2 bar"), ("limits", "output 3 V")],
)
def test_a_size_in_another_unit_than_the_gain_is_refused(key, text):
    """Per cents of a range cannot belong to a gain per volt."""
    with pytest.raises(SpecError, match="but the gain of the plant has") as caught:
        draft_of(plant="gain 2 degC/V, time constant 180 s", **{key: text})
    assert caught.value.diagnostics[0].key == key
