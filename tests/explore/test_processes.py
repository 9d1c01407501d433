"""Plants in s by named parameters: what is written is what was estimated, and it is the truth."""

import numpy as np
import pytest

from inputdesign_cli.explore import explore_records, explore_structure
from inputdesign_cli.explore.fits import fits, simulation_fit
from inputdesign_cli.explore.orders import Orders
from inputdesign_cli.explore.processes import Process, process_models
from inputdesign_cli.plant import ContinuousModel, SampledModel

STEP = 0.5


def first_order(K, T, L):
    row = (np.array([K]),), (np.array([1.0, T]),), (np.array([L]),)
    plant = ContinuousModel.monic((row[0],), (row[1],), np.eye(1), delay=(row[2],))
    return SampledModel(plant, STEP)


@pytest.mark.parametrize(
    ("process", "theta", "below"),
    [
        (Process((3,), 1, STEP), [2.0, 6.0, 1.2], [6.0, 1.0]),
        (Process((3,), 2, STEP), [2.0, 3.0, 0.4, 1.2], [9.0, 2.4, 1.0]),
        (Process((3,), 2, STEP, zero=True), [2.0, 3.0, 1.5, 0.7, 1.2], [9.0, 9.0, 1.0]),
        (Process((3,), 3, STEP), [2.0, 3.0, 1.0, 5.0, 1.2], np.polymul([9.0, 6.0, 1.0], [5.0, 1.0])),
    ],
)
def test_a_response_is_that_of_its_formula(process, theta, below):
    plant = process_models([process], [np.array(theta)], np.eye(1)).coefficients.continuous_plant
    w = np.array([0.01, 0.3, 2.0])
    s = 1j * w
    above = theta[0] * (1.0 + theta[3] * s if process.zero else 1.0)
    expected = above / np.polyval(below, s) * np.exp(-s * theta[-1])
    np.testing.assert_allclose(plant.plant_at(w)[:, 0, 0], expected, rtol=1e-12)


def test_gain_time_constant_and_dead_time_are_found():
    rng = np.random.default_rng(2)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 10)[:, None]
    x, _ = first_order(2.0, 6.0, 1.7).simulate(u, np.zeros(u.shape), 1.0)
    y = 30.0 + x + 0.2 * np.std(x) * rng.standard_normal(u.shape)
    found = explore_records([(u, y)], step=STEP)
    assert found.model.names == ("K", "T", "L")
    deviations = (found.estimate.theta - [2.0, 6.0, 1.7]) / np.sqrt(np.diag(found.estimate.covariance))
    assert np.all(np.abs(deviations) < 4.0)


@pytest.mark.slow
def test_delays_and_orders_of_a_hundred_plants_at_ten_decibels():
    """Dead times to 15 samples, time constants of 4 to 25; delays within one sample in 95, orders in 95."""
    delays = orders = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        T, L = STEP * rng.uniform(4.0, 25.0), STEP * rng.uniform(0.0, 15.0)
        hold = int(rng.integers(4, 12))
        u = np.repeat(rng.choice([-1.0, 1.0], 400 // hold + 1), hold)[:400, None]
        x, _ = first_order(rng.uniform(0.5, 3.0), T, L).simulate(u, np.zeros(u.shape), 1.0)
        y = x + np.std(x) / np.sqrt(10.0) * rng.standard_normal(u.shape)
        best = explore_structure([(u[:240], y[:240])], [(u[240:], y[240:])], step=STEP).best
        first = int(np.floor(L / STEP)) + 1  # the first sample that an input moves
        delays += abs(best.orders.delays[0] - first) <= 1
        orders += abs(best.orders.order - 1) <= 1
    assert delays >= 95
    assert orders >= 95


@pytest.mark.parametrize("late", [0.5, 40.0, 120.0])
@pytest.mark.parametrize("in_s", [True, False])
def test_a_dead_time_explains_nothing_of_white_noise(late, in_s):
    """Level and state at the start are two unknowns of 80 samples: less than 5 % of the rms, whatever L."""
    if in_s:
        model = process_models([Process((1,), 1, 1.0)], [np.array([1e-6, 5.0, late])], np.eye(1))
    else:
        model = Orders("OE", (int(late) + 1,), 2, f=1).model().at(np.array([1e-6, 1e-6, -0.8]))
    rng = np.random.default_rng(3)
    fit = simulation_fit(model, [(rng.standard_normal((200, 1)), rng.standard_normal((200, 1)))])
    assert fit[0] < 5.0


@pytest.mark.parametrize("in_s", [True, False])
def test_a_true_model_is_judged_alike_in_s_and_in_q(in_s):
    """A record that begins while 14 unknown inputs are still on their way: only its noise is left."""
    rng = np.random.default_rng(4)
    u = np.repeat(rng.choice([-1.0, 1.0], 80), 5)[:, None]
    truth = first_order(2.0, 6.0, 7.0)
    x, _ = truth.simulate(u, np.zeros(u.shape), 1.0)
    y = x + 0.1 * np.std(x) * rng.standard_normal(x.shape)
    pole = np.exp(-STEP / 6.0)
    polynomial = Orders("OE", (15,), 1, f=1).model().at(np.array([2.0 * (1.0 - pole), -pole]))
    found = fits(truth if in_s else polynomial, [(u[100:], y[100:])])
    assert np.sum(~found.counted) == 14
    left = (y - x)[114:]
    expected = 100.0 * (1.0 - np.linalg.norm(left - left.mean()) / (np.std(y[114:]) * np.sqrt(left.size)))
    assert found.simulation[0] == pytest.approx(expected, abs=0.2)
    assert found.prediction[0] == pytest.approx(expected, abs=0.2)


def test_coloured_noise_does_not_displace_the_plain_structure():
    """Of one lag, with filters for white noise it simulates as well: the one without them is taken."""
    rng = np.random.default_rng(18)
    u = np.repeat(rng.choice([-1.0, 1.0], 40), 6)[:, None]
    x, _ = first_order(1.5, 6.0, 1.2).simulate(u, np.zeros(u.shape), 1.0)
    y = x + np.std(x) / np.sqrt(10.0) * rng.standard_normal(u.shape)
    best = explore_structure([(u[:150], y[:150])], [(u[150:], y[150:])], step=STEP).best.orders
    assert (best.family, best.noise) == ("FOPDT", 0)
    assert abs(best.delays[0] - 3) <= 1


@pytest.mark.parametrize(
    ("T", "zeta", "told"),
    [(0.2, 0.1, False), (0.2, 2.0, True), (4.0, 0.1, True), (900.0, 1.0, True), (1100.0, 1.0, False)],
)
def test_a_resonance_beyond_nyquist_or_a_lag_of_many_records_is_not_told(T, zeta, told):
    """Samples a unit of time apart, a hundred of them: resonances end at pi, time constants at 1000."""
    shape = Process((1,), 2, 1.0)
    assert (shape.beyond(np.array([1.0, T, zeta, 0.5]), 100) == []) == told
