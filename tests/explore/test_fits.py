"""Fits of simulation and prediction follow their definition, in s and in q^-1."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore.fits import by_chance, fits
from inputdesign_cli.explore.structures import Orders, Process, process_models
from inputdesign_cli.plant import PolynomialModel, SampledModel
from tests.explore.plants import column
from tests.support.plants import lag_of

STEP = 0.5


def test_an_unknown_level_and_start_do_not_lower_the_fit():
    """A simulation from any state about any level, without noise, explains everything."""
    u, F = np.random.default_rng(5).standard_normal(300), [1.0, -1.5, 0.7]
    y = 7.0 + scipy.signal.lfilter([0.0, 1.0, 0.5], F, u)
    found = fits(PolynomialModel.single([0.0, 1.0, 0.5], F=F), [column(u[100:], y[100:])])
    assert found.simulation[0] > 100.0 - 1e-6
    assert found.prediction[0] > 100.0 - 1e-6


def test_the_fit_agrees_with_its_definition():
    u, e = np.random.default_rng(6).standard_normal((2, 2000))
    y = scipy.signal.lfilter([0.0, 1.0], [1.0, -0.5], u) + e
    found = fits(PolynomialModel.single([0.0, 1.0], F=[1.0, -0.5]), [column(u, y)])
    plain = 100.0 * (1.0 - np.linalg.norm(e) / np.linalg.norm(y - y.mean()))
    assert found.simulation[0] == pytest.approx(plain, abs=0.3)


@pytest.mark.parametrize("samples", [11, 60])
def test_random_signals_exceed_the_limit_of_chance_in_5_percent(samples):
    """The best of 10 sets of three random signals explains that much in 5 % at most, however few samples."""
    rng = np.random.default_rng(4)
    limit, above = by_chance(samples, 3, 10), 0
    for _ in range(5000):
        y, basis = rng.standard_normal(samples), np.linalg.qr(rng.standard_normal((10, samples, 3)))[0]
        left = np.linalg.norm(y - np.einsum("knm,km->kn", basis, y @ basis), axis=1)
        above += 100.0 * (1.0 - left.min() / np.linalg.norm(y)) > limit
    assert 200 <= above <= 300
    assert by_chance(0, 3, 10) == by_chance(3, 3, 10) == 100.0


def test_an_unstable_model_has_no_simulation():
    u, y = np.random.default_rng(7).standard_normal((2, 3000, 1))
    assert fits(PolynomialModel.single([0.0, 1.0], F=[1.0, -1.5]), [(u, y)]).simulation[0] < -1e3


@pytest.mark.parametrize("late", [0.5, 40.0, 120.0])
@pytest.mark.parametrize("in_s", [True, False])
def test_a_dead_time_explains_nothing_of_white_noise(late, in_s):
    """Level and state at the start are two unknowns of 80 samples: less than 5 % of the rms, whatever L."""
    if in_s:
        model = process_models([Process((1,), 1, 1.0)], [np.array([1e-6, 5.0, late])], np.eye(1))
    else:
        model = Orders("OE", (int(late) + 1,), 2, f=1).model().at(np.array([1e-6, 1e-6, -0.8]))
    rng = np.random.default_rng(3)
    assert fits(model, [(rng.standard_normal((200, 1)), rng.standard_normal((200, 1)))]).simulation[0] < 5.0


@pytest.mark.parametrize("in_s", [True, False])
def test_the_true_model_has_the_same_fit_in_s_and_in_q(in_s):
    """The first 14 samples respond to unknown inputs and do not count; in the others noise is left."""
    rng = np.random.default_rng(4)
    u = np.repeat(rng.choice([-1.0, 1.0], 80), 5)[:, None]
    truth, pole = SampledModel(lag_of([2.0], [6.0, 1.0], 7.0), STEP), np.exp(-STEP / 6.0)
    x, _ = truth.simulate(u, np.zeros(u.shape), 1.0)
    y = x + 0.1 * np.std(x) * rng.standard_normal(x.shape)
    polynomial = Orders("OE", (15,), 1, f=1).model().at(np.array([2.0 * (1.0 - pole), -pole]))
    found = fits(truth if in_s else polynomial, [(u[100:], y[100:])])
    assert np.sum(~found.counted) == 14
    left = (y - x)[114:]
    expected = 100.0 * (1.0 - np.linalg.norm(left - left.mean()) / (np.std(y[114:]) * np.sqrt(left.size)))
    assert found.simulation[0] == pytest.approx(expected, abs=0.2)
    assert found.prediction[0] == pytest.approx(expected, abs=0.2)


@pytest.mark.parametrize(
    ("process", "theta", "below"),
    [
        (Process((3,), 0, STEP), [2.0, 1.2], [1.0, 0.0]),
        (Process((3,), 1, STEP), [2.0, 6.0, 1.2], [6.0, 1.0]),
        (Process((3,), 2, STEP), [2.0, 3.0, 0.4, 1.2], [9.0, 2.4, 1.0]),
        (Process((3,), 2, STEP, zero=True), [2.0, 3.0, 1.5, 0.7, 1.2], [9.0, 9.0, 1.0]),
    ],
)
def test_process_models_have_the_frequency_response_of_their_formula(process, theta, below):
    plant = process_models([process], [np.array(theta)], np.eye(1)).coefficients.continuous_plant
    w = np.array([0.01, 0.3, 2.0])
    s = 1j * w
    above = theta[0] * (1.0 + theta[3] * s if process.zero else 1.0)
    expected = above / np.polyval(below, s) * np.exp(-s * theta[-1])
    np.testing.assert_allclose(plant.plant_at(w)[:, 0, 0], expected, rtol=1e-12)
