"""Logs from which no model deserves trust, with the reason and what to do."""

import re

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore import explore_structure
from inputdesign_cli.findings.frequency_responses import contradicted
from inputdesign_cli.identification import frequency_response
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions import explore, identify
from inputdesign_cli.questions.assessment.outcome import response_of_data
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.specification import parse_spec
from tests.support.loops import LAWS, loop


def stored(path, u, y, names="u,y"):
    np.savetxt(path, np.column_stack([u, y]), delimiter=",", header=names, comments="", fmt="%.9g")
    return path


def static_gain(theta):
    """Of a plant of one input by the names of its parameters, whichever structure was taken."""
    b, below = (sum(x for name, x in theta.items() if name[0] in letters) for letters in ("b", "af"))
    return theta.get("K", b / (1.0 + below))


@pytest.mark.slow
@pytest.mark.parametrize("integral", [0.0, pytest.param(0.1, marks=pytest.mark.slow)], ids=["P", "PI"])
def test_the_inverse_of_a_controller_is_no_plant(integral, tmp_path):
    """Control without a reference: u = -C y + dither, and y moves by its own noise."""
    rng = np.random.default_rng(1)
    u, y, v, total = np.zeros(400), np.zeros(400), 0.0, 0.0
    x = 0.0
    for t in range(400):
        x = 0.8 * x + 0.2 * u[t - 1] if t else 0.0
        v = 0.9 * v + 0.3 * rng.standard_normal()
        y[t] = x + v
        total += integral * y[t]
        u[t] = -0.5 * y[t] - total + 0.05 * rng.standard_normal()
    (told,) = [reason for reason in explore(stored(tmp_path / "log.csv", u, y)).reasons if "-1/C" in reason]
    assert told.endswith("Move the reference of the loop, or add dither to the input.")


@pytest.mark.slow
def test_the_plant_of_a_loop_whose_reference_hardly_moves_is_not_the_inverse_of_its_controller(tmp_path):
    """What moves the reference are eight steps; they look like spikes to a model of -1/C."""
    u, y = loop(2, LAWS["PI"], steps=0.3)
    found = explore(stored(tmp_path / "log.csv", u, y)).results.result
    assert found["exploration"]["loop"]
    assert static_gain(found["identification"]["theta"]) == pytest.approx(1.0, abs=0.6)


@pytest.mark.slow
def test_an_unstable_plant_is_told_with_a_spec_that_identifies_it(tmp_path):
    rng = np.random.default_rng(4)
    r, y, u, x = np.repeat(rng.choice([-1.0, 1.0], 20), 12), np.zeros(240), np.zeros(240), 0.0
    for t in range(240):
        x = 1.1 * x + 0.2 * u[t - 1] if t else 0.0
        y[t] = x + 0.05 * rng.standard_normal()
        u[t] = 2.0 * (r[t] - y[t])
    log = stored(tmp_path / "log.csv", u, y)
    (told,) = explore(log).reasons
    assert told.startswith("The plant is unstable: y has a pole at a radius of 1.")
    plant, noise = re.search(r"plant: (\{.*?\}), noise: (\{.*?\}),", told).groups()
    loop = "experiment: {controller: {numerator: [2], denominator: [1]}}"
    found = identify(parse_spec(f"plant: {plant}\nnoise: {noise}\n{loop}\n", design=False), log).result
    theta, deviation = (found["identification"][key] for key in ("theta", "standard_deviation"))
    assert theta["a1"] == pytest.approx(-1.1, abs=4.0 * deviation["a1"])
    assert theta["b1"] == pytest.approx(0.2, abs=4.0 * deviation["b1"])


@pytest.mark.slow
def test_inputs_that_move_together_are_told_apart_by_nothing(tmp_path):
    rng = np.random.default_rng(2)
    u = np.repeat(rng.choice([-1.0, 1.0], 30), 5)
    y = scipy.signal.lfilter([0, 0.3], [1, -0.7], 3.0 * u) + 0.1 * rng.standard_normal(150)
    found = explore(stored(tmp_path / "log.csv", np.column_stack([u, 2.0 * u]), y, "u1,u2,y"))
    assert any("the inputs move together" in reason for reason in found.reasons)


def lags(u, plants, rng, noise=0.05):
    """What first-order plants, a gain, a time constant and a whole delay for each input, make of u (n, r)."""
    y = noise * rng.standard_normal(len(u))
    for x, (gain, constant, delay) in zip(u.T, plants, strict=True):
        pole = np.exp(-1.0 / constant)
        y += scipy.signal.lfilter(np.append(np.zeros(delay + 1), gain * (1.0 - pole)), [1, -pole], x)
    return y


@pytest.mark.slow
def test_inputs_between_which_what_they_do_may_be_exchanged_earn_no_trust(tmp_path):
    """The second input is half of the first but for little: another minimum is about as likely."""
    rng = np.random.default_rng(0)
    one = np.repeat(rng.choice([-1.0, 1.0], 40), 8)
    u = np.column_stack([one, 0.5 * one + 0.003 * rng.standard_normal(320)])
    y = lags(u, [(1.0, 8.0, 3), (2.0, 15.0, 1)], rng)
    found = explore(stored(tmp_path / "log.csv", u, y, "u1,u2,y"))
    assert any("Another set of parameters" in reason for reason in found.reasons)


@pytest.mark.slow
def test_an_input_that_tells_nothing_of_what_it_does_is_named(tmp_path):
    rng = np.random.default_rng(2)
    u = np.column_stack([np.repeat(rng.choice([-1.0, 1.0], 50), 8), np.repeat(rng.uniform(-1, 1, 40), 10)])
    y = lags(u, [(1.0, 8.0, 3), (0.0, 8.0, 1)], rng)
    found = explore(stored(tmp_path / "log.csv", u, y, "u1,u2,y"))
    said = [*found.results.result["notes"], *found.reasons]
    assert any(told.startswith("u2 has no effect") for told in said)
    assert not any(told.startswith("u1 has no effect") for told in said)


@pytest.mark.slow
def test_a_clipped_output_earns_no_trust_and_emptied_cells_bring_its_gain_back(tmp_path):
    """A lag of ten samples, gain one, cut at 0.5: a third of the gain is lost, and comes back."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], 30), 15)
    y = np.minimum(scipy.signal.lfilter([0, 0, 0.1], [1, -0.9], u) + 0.02 * rng.standard_normal(450), 0.5)
    assert any("stands still" in reason for reason in explore(stored(tmp_path / "a.csv", u, y)).reasons)
    found = explore(stored(tmp_path / "b.csv", u, np.where(y < 0.5, y, np.nan)))
    assert not any("stands still" in reason for reason in found.reasons)
    assert static_gain(found.results.result["identification"]["theta"]) == pytest.approx(1.0, abs=0.05)


def test_a_model_far_from_what_the_data_say_without_one_earns_no_trust():
    """Of a lag with a gain of one: half of it more is too far, a tenth more is not."""
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
def test_a_dead_time_of_a_good_part_of_the_record_is_found(delay, held, samples):
    """Longer than delays are looked for where nothing says that one is there; also by few jumps."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], samples // held), held)
    y = scipy.signal.lfilter(np.append(np.zeros(delay), 0.2), [1, -0.8], u)
    y += 0.05 * rng.standard_normal(samples)
    at = 3 * samples // 5
    first, second = ([(u[part, None], y[part, None])] for part in (slice(0, at), slice(at, None)))
    found = explore_structure(first, second, physical=False)
    assert abs(found.best.orders.delays[0] - delay) <= 1
