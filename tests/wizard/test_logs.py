"""The wizard with the log of a plant: it is explored, and what is stated beside it holds."""

from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.wizard.composing import compose
from inputdesign_cli.wizard.noise import noise_lines
from inputdesign_cli.wizard.plants import PlantAnswer
from tests.support.wishes import ENGINEER


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
