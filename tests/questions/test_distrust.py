"""Logs whose identified models deserve no trust, and the findings that state the reason."""

import re
from functools import partial

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.errors import DataError
from inputdesign_cli.explore.search import explore_structure
from inputdesign_cli.findings.frequency_responses import contradicted
from inputdesign_cli.identification import frequency_response
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions import explore, identify
from inputdesign_cli.questions.assessment.outcome import response_of_data
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.questions.exploration.build import _inside
from inputdesign_cli.specification import parse_spec
from tests.support.loops import LAWS, loop


def stored(path, u, y, names="u,y"):
    np.savetxt(path, np.column_stack([u, y]), delimiter=",", header=names, comments="", fmt="%.9g")
    return path


def static_gain(theta):
    """The static gain of a plant of one input from its named parameters, for any structure."""
    b, below = (sum(x for name, x in theta.items() if name[0] in letters) for letters in ("b", "af"))
    return theta.get("K", b / (1.0 + below))


RNG = np.random.default_rng


def lags(u, plants, rng, noise=0.05):
    """(n,): response of first-order plants (gain, time constant, whole delay) to u (n, r), with noise."""
    y = noise * rng.standard_normal(len(u))
    for x, (gain, constant, delay) in zip(u.T, plants, strict=True):
        pole = np.exp(-1.0 / constant)
        y += scipy.signal.lfilter(np.append(np.zeros(delay + 1), gain * (1.0 - pole)), [1, -pole], x)
    return y


def in_control(integral):
    """u and y (400,) of a regulator without a reference: u = -C y + dither; y has coloured noise."""
    rng = RNG(1)
    u, y, v, total, x = np.zeros(400), np.zeros(400), 0.0, 0.0, 0.0
    for t in range(400):
        x = 0.8 * x + 0.2 * u[t - 1] if t else 0.0
        v = 0.9 * v + 0.3 * rng.standard_normal()
        y[t] = x + v
        total += integral * y[t]
        u[t] = -0.5 * y[t] - total + 0.05 * rng.standard_normal()
    return u, y


def proportional_inputs():
    """The second input is twice the first."""
    rng = RNG(2)
    u = np.repeat(rng.choice([-1.0, 1.0], 30), 5)
    y = scipy.signal.lfilter([0, 0.3], [1, -0.7], 3.0 * u) + 0.1 * rng.standard_normal(150)
    return np.column_stack([u, 2.0 * u]), y


def nearly_proportional_inputs():
    """The second input is half of the first, up to a deviation of 0.003."""
    rng = RNG(0)
    one = np.repeat(rng.choice([-1.0, 1.0], 40), 8)
    u = np.column_stack([one, 0.5 * one + 0.003 * rng.standard_normal(320)])
    return u, lags(u, [(1.0, 8.0, 3), (2.0, 15.0, 1)], rng)


def input_proportional_to_output():
    """The input is exactly -0.6 y, although y has noise."""
    y = scipy.signal.lfilter([1.0], [1.0, -0.66], RNG(0).standard_normal(200))  # 0.9 y - 0.4 * 0.6 y
    return -0.6 * y, y


def a_sinusoid():
    """The record has only amplitude and phase at 0.3 rad/sample, for three parameters."""
    u = np.sin(0.3 * np.arange(1400.0))
    y = scipy.signal.lfilter([0, 0, 0, 0.06], [1, -1.5, 0.56], u) + 0.05 * RNG(21).standard_normal(1400)
    return u[600:], y[600:]


LOGS = {
    "P control without reference": (partial(in_control, 0.0), "like-inverse-controller"),
    "PI control without reference": (partial(in_control, 0.1), "like-inverse-controller"),
    # The eight steps of the reference are too small to determine the plant.
    "small steps of the reference": (partial(loop, 2, LAWS["PI"], steps=0.3), "structure-unexplained"),
    "proportional inputs": (proportional_inputs, "excitation-too-simple"),
    "nearly proportional inputs": (nearly_proportional_inputs, "excitation-too-simple"),
    "input proportional to the output": (input_proportional_to_output, "input-only-answers"),
    "steady sinusoid": (a_sinusoid, "excitation-too-simple"),
}


STEPS = np.repeat(np.random.default_rng(5).choice([-1.0, 0.0, 1.0, 2.0], 20), 12)


@pytest.mark.parametrize("seed", range(3))
def test_a_sensor_resolution_far_above_the_noise_is_reported_and_a_fine_one_is_not(seed, tmp_path):
    """Noise below half a quantisation step leaves levels biased and the gain off by many deviations."""
    rng = RNG(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], 15), 40)
    y = scipy.signal.lfilter([0, 0.2], [1, -0.9], u) + 0.1 * rng.standard_normal(600)
    for step, blamed in ((0.75, True), (1.5, True), (0.1, False)):
        found = explore(stored(tmp_path / f"{step}.csv", u, step * np.round(y / step)))
        codes = {one.code for one in found.results.outcome.findings}
        assert ("sensor-too-coarse" in codes, bool(found.reasons)) == (blamed, blamed)


def test_an_input_proportional_to_the_output_is_the_only_reason_given(tmp_path):
    """The fit and the noise of such a model mean nothing."""
    found = explore(stored(tmp_path / "log.csv", *input_proportional_to_output()))
    (reason,) = found.reasons
    assert "follows from the outputs alone" in reason


@pytest.mark.parametrize("seed", range(4))
def test_a_log_of_a_double_integrator_ends_with_reasons_or_no_structure(seed, tmp_path):
    rng = RNG(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], 12), 50)
    y = scipy.signal.lfilter([0, 0.001], [1, -2, 1], u) + 0.1 * rng.standard_normal(600)
    path = stored(tmp_path / "log.csv", u, y)
    try:
        said = explore(path).reasons
    except DataError as error:
        said = [error.diagnostics[0].code] * (error.diagnostics[0].code == "no-structure")
    assert said


@pytest.mark.parametrize("swapped", [True, False])
def test_swapped_input_and_output_columns_are_reported(swapped, tmp_path):
    rng = RNG(3)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0, 2.0], 8), 50)
    y = scipy.signal.lfilter([0, 0.2], [1, -0.9], u) + 0.1 * rng.standard_normal(400)
    found = explore(stored(tmp_path / "log.csv", *((y, u) if swapped else (u, y))))
    assert ("columns-perhaps-swapped" in [one.code for one in found.results.outcome.findings]) is swapped


@pytest.mark.slow
@pytest.mark.parametrize("samples", [60, 120, 200, 240])
def test_a_static_gain_without_noise_ends_with_the_finding_input_only_answers(samples, tmp_path):
    """No regression shows which of the two signals is the input."""
    found = explore(stored(tmp_path / "log.csv", STEPS[:samples], 2.0 * STEPS[:samples]))
    assert "input-only-answers" in [one.code for one in found.results.outcome.findings]


@pytest.mark.slow
@pytest.mark.parametrize("name", LOGS)
def test_a_log_without_a_trustworthy_model_has_the_finding_that_says_why(name, tmp_path):
    made, code = LOGS[name]
    u, y = made()
    names = "u,y" if np.ndim(u) == 1 or u.shape[1] == 1 else "u1,u2,y"
    found = explore(stored(tmp_path / "log.csv", u, y, names))
    codes = {one.code: one.message for one in found.results.outcome.findings}
    assert found.reasons
    assert codes[code].startswith("no trust: ")


@pytest.mark.slow
def test_an_unstable_plant_is_reported_with_a_spec_that_identifies_it(tmp_path):
    rng = np.random.default_rng(4)
    r, y, u, x = np.repeat(rng.choice([-1.0, 1.0], 20), 12), np.zeros(240), np.zeros(240), 0.0
    for t in range(240):
        x = 1.1 * x + 0.2 * u[t - 1] if t else 0.0
        y[t] = x + 0.05 * rng.standard_normal()
        u[t] = 2.0 * (r[t] - y[t])
    log = stored(tmp_path / "log.csv", u, y)
    (told,) = explore(log).reasons
    assert told.startswith("The plant is unstable: y has a pole at a radius of 1.")
    (stated,) = re.findall(r"A: \[.*?\]", told)
    plant = f"plant: {{{stated}, B: [0, 1]}}\nnoise: {{variance: 1}}\n"
    loop = "experiment: {controller: {numerator: [2], denominator: [1]}}\n"
    found = identify(parse_spec(plant + loop, design=False), log).result
    theta, deviation = (found["identification"][key] for key in ("theta", "standard_deviation"))
    assert theta["a1"] == pytest.approx(-1.1, abs=4.0 * deviation["a1"])
    assert theta["b1"] == pytest.approx(0.2, abs=4.0 * deviation["b1"])


@pytest.mark.slow
def test_an_input_without_effect_on_the_output_is_named(tmp_path):
    rng = np.random.default_rng(2)
    u = np.column_stack([np.repeat(rng.choice([-1.0, 1.0], 50), 8), np.repeat(rng.uniform(-1, 1, 40), 10)])
    y = lags(u, [(1.0, 8.0, 3), (0.0, 8.0, 1)], rng)
    found = explore(stored(tmp_path / "log.csv", u, y, "u1,u2,y"))
    idle = [one.where for one in found.results.findings if one.code == "input-perhaps-idle"]
    assert idle == ["u2"]


@pytest.mark.slow
def test_a_clipped_output_is_distrusted_and_emptying_its_cells_restores_the_gain(tmp_path):
    """The output of a lag with gain one is clipped at 0.5, which loses a third of the gain."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], 30), 15)
    y = np.minimum(scipy.signal.lfilter([0, 0, 0.1], [1, -0.9], u) + 0.02 * rng.standard_normal(450), 0.5)
    assert any("stands still" in reason for reason in explore(stored(tmp_path / "a.csv", u, y)).reasons)
    found = explore(stored(tmp_path / "b.csv", u, np.where(y < 0.5, y, np.nan)))
    assert not any("stands still" in reason for reason in found.reasons)
    assert static_gain(found.results.result["identification"]["theta"]) == pytest.approx(1.0, abs=0.05)


def test_a_model_far_from_the_nonparametric_frequency_response_is_contradicted():
    """In open loop a gain 50 % too large is contradicted; one 10 % too large is not."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 1.0], 500), 4)[:, None]
    y = scipy.signal.lfilter([0, 0.3], [1, -0.7], u, axis=0) + 1e-3 * rng.standard_normal(u.shape)
    measured = frequency_response(u, y)
    units = Units("s", 1.0, sampled=True, closed_loop=False, inputs=1, outputs=1)
    for gain, closed, far in ((1.0, False, 0), (1.1, False, 0), (1.5, False, 1), (1.5, True, 0)):
        text = f"plant: {{B: [0, {0.3 * gain}], F: [1, -0.7]}}\nnoise: {{variance: 1e-6}}\n"
        model = build_model(parse_spec(text, design=False))
        told = response_of_data(units, model, measured, by_reference=False, loop=closed)[2]
        assert len(contradicted(told)) == far


@pytest.mark.slow
@pytest.mark.parametrize(("delay", "held", "samples"), [(150, 4, 500), (120, 20, 600)])
def test_a_dead_time_of_a_fifth_of_the_record_or_more_is_found(delay, held, samples):
    """The search goes beyond its usual delays if the data show a longer one, even with few steps."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], samples // held), held)
    y = scipy.signal.lfilter(np.append(np.zeros(delay), 0.2), [1, -0.8], u)
    y += 0.05 * rng.standard_normal(samples)
    at = 3 * samples // 5
    first, second = ([(u[part, None], y[part, None])] for part in (slice(0, at), slice(at, None)))
    found = explore_structure(first, second, physical=False)
    assert abs(found.best.orders.delays[0] - delay) <= 1


@pytest.mark.slow
def test_a_random_walk_that_hides_the_gain_earns_no_trust(tmp_path):
    """The noise is a random walk; a lag of nine samples has a dead time of 2.3 samples."""
    rng, pole = RNG(1), np.exp(-1.0 / 20 / 9.0)
    u = np.resize(np.repeat([0.0, 1.0, -1.0, 0.0, 1.0, 0.0, -1.0, 0.0], 35), 300)
    fine = np.concatenate([np.zeros(46), np.repeat(u, 20)])[:6000]
    y = 60.0 + 2.0 * scipy.signal.lfilter([0.0, 1.0 - pole], [1.0, -pole], fine)[::20]
    y += 0.06 * np.cumsum(rng.standard_normal(300)) + 0.04 * rng.standard_normal(300)
    found = explore(stored(tmp_path / "log.csv", np.c_[np.arange(300), 45.0 + u], y, "time,u,y"))
    assert found.reasons or static_gain(found.results.result["identification"]["theta"]) == pytest.approx(
        2.0, rel=0.1
    )


@pytest.mark.parametrize("radius", [1.0, 1.0 - 1e-9, 0.9995, 0.99, 0.5])
def test_noise_poles_for_the_next_experiment_stay_within_radius_1_minus_1_over_n(radius):
    """Estimated noise poles may lie on the unit circle, where the information is infinite."""
    D = np.real(np.poly([radius * np.exp(0.04j), radius * np.exp(-0.04j), 0.3])).tolist()
    noise = {"C": [1.0, -0.2], "D": D, "variance": 2.0, "drift": False}
    inside, drawn = _inside(noise, 200)
    roots = np.abs(np.roots(inside["D"]))
    assert roots.max() <= 1.0 - 1.0 / 200 + 1e-12
    if radius < 0.995:
        assert (inside, drawn) == (noise, [])
    else:
        assert drawn == ["D"]
        assert {**inside, "D": D} == noise
        # The angles of the poles stay, and radii move by at most 1/200.
        np.testing.assert_allclose(np.angle(np.roots(inside["D"])[:2]), np.angle(np.roots(D)[:2]), atol=1e-9)
        assert np.abs(np.sort(roots) - np.sort(np.abs(np.roots(D)))).max() <= 1.0 / 200 + 1e-12
    several, _ = _inside({"C": [[1.0, -0.2], [1.0]], "D": [D, [1.0, -0.5]]}, 200)
    assert several == {"C": [[1.0, -0.2], [1.0]], "D": [inside["D"], [1.0, -0.5]]}
