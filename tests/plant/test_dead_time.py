"""Dead times: exact sampling for any fraction, gradients, loops."""

from itertools import pairwise

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.plant import ContinuousModel, SampledModel, TransferMatrix, close_loop
from inputdesign_cli.plant.held import Intersample
from tests.support.plants import arrays, descending

W = np.array([0.05, 0.4, 1.3, 2.9])
STEP = 0.5
DELAYS = [0.0, 0.1, 0.37, 0.5, 1.0, 2.24]


def late(tau, numerator=(2.0, 1.0), denominator=(1.0, 0.7, 1.3)) -> ContinuousModel:
    entries = (descending([[list(numerator)]]), descending([[list(denominator)]]))
    return ContinuousModel.monic(*entries, np.eye(1), delay=((np.array([tau]),),))


def matrix(common=False) -> ContinuousModel:
    """Two by two, one entry without dead time, one of higher order, one biproper."""
    delays = [[[0.8], [0.8]]] * 2 if common else [[[0.8], [1.3]], [[], [1.0]]]
    return ContinuousModel.monic(
        descending([[[1.0], [2.0, 0.5]], [[-0.7, 0.2], [1.2]]]),
        descending([[[1.0, 0.5], [1.0, 0.4]], [[1.0, 0.7, 1.3], [1.0, 0.9]]]),
        np.eye(2),
        delay=arrays(delays),
        common_delay=common,
    )


def fine_step(model, u, steps=1000):
    """The output of one entry at the sampling instants, by a plain simulation with steps of STEP / 1000."""
    tau, h = float(model.theta[-1]), STEP / steps
    held = np.concatenate([np.zeros(round(tau / h)), np.repeat(u, steps)])[: u.size * steps]
    entry = (model.numerator[0][0][::-1], model.denominator[0][0][::-1])
    b, a, _ = scipy.signal.cont2discrete(entry, h, method="zoh")
    return scipy.signal.lfilter(b.ravel(), a, held)[::steps]


@pytest.mark.parametrize("tau", DELAYS)
def test_the_sampled_plant_is_that_of_a_fine_step_simulation(tau):
    u = np.random.default_rng(0).normal(size=(40, 1))
    model = late(tau)
    y, _ = SampledModel(model, STEP).simulate(u, np.zeros((40, 1)), 1.0)
    np.testing.assert_allclose(y[:, 0], fine_step(model, u[:, 0]), atol=1e-8)


@pytest.mark.parametrize("model", [late(0.37), late(1.0), matrix(), matrix(common=True)])
def test_realisation_and_response_are_one_plant(model):
    sampled, z = SampledModel(model, STEP), np.exp(1j * W)
    A, B, C, D = sampled.realisation
    expected = np.array([C @ np.linalg.solve(x * np.eye(len(A)) - A, B) + D for x in z])
    np.testing.assert_allclose(sampled.plant_at(W), expected, atol=1e-12)


@pytest.mark.parametrize("tau", DELAYS)
def test_numerator_and_denominator_in_q_are_those_of_the_response(tau):
    entry = late(tau).held(0, 0, STEP)
    expected = scipy.signal.freqz(*entry.sampled, worN=W)[1]
    np.testing.assert_allclose(SampledModel(late(tau), STEP).plant_at(W)[:, 0, 0], expected, atol=1e-12)


def extrapolated(f, x, step):
    """f'(x) from values on the right alone, by Richardson's extrapolation to fourth order."""
    once = [(f(x + step / 2**i) - f(x)) / (step / 2**i) for i in range(4)]
    for order in range(1, 4):
        once = [(2**order * b - a) / (2**order - 1) for a, b in pairwise(once)]
    return once[0]


@pytest.mark.parametrize(
    "model",
    [*(SampledModel(late(tau), STEP) for tau in DELAYS), SampledModel(matrix(), STEP), late(0.37), matrix()],
)
def test_gradients_are_differences(model):
    """Towards longer dead times, which at the boundary of a sample is the side that is promised."""
    theta, exact = model.theta, model.plant_gradient(W)
    for k in range(theta.size):
        unit = np.eye(theta.size)[k]
        slope = extrapolated(lambda x, unit=unit: model.at(theta + x * unit).plant_at(W), 0.0, 2e-3)
        np.testing.assert_allclose(exact[:, k], slope, atol=1e-8 * max(1.0, np.abs(exact[:, k]).max()))


def test_the_gradient_has_two_sides_at_a_boundary():
    """Relative degree one: b e^(-at) jumps at t = 0, so that the sides differ by the first sample."""
    first = lambda tau: SampledModel(late(tau, (2.0,), (1.0, 0.7)), STEP)  # noqa: E731
    right = first(1.0).plant_gradient(W)[:, -1, 0, 0]
    left = first(1.0 - 1e-7).plant_gradient(W)[:, -1, 0, 0]
    q = np.exp(-1j * W)
    np.testing.assert_allclose(left - right, 2.0 * (q - 1.0) * q**2, atol=1e-6)


def test_names_are_those_of_entries():
    assert matrix().names[-3:] == ("delay[1,1]", "delay[1,2]", "delay[2,2]")
    assert matrix(common=True).names[-1] == "delay"
    assert late(0.3).names == ("b0", "b1", "a0", "a1", "delay")


@pytest.mark.parametrize("hold", [True, False])
def test_a_dead_time_of_whole_samples_shifts_the_output(hold):
    u = np.random.default_rng(1).normal(size=(60, 1))
    between = Intersample(STEP, hold)
    at_once, shifted = (late(tau).driven(u, between) for tau in (0.0, 3 * STEP))
    np.testing.assert_allclose(shifted[3:], at_once[:-3], atol=2e-2 if not hold else 1e-12)


def test_dead_times_beyond_the_record_leave_nothing():
    u = np.ones((10, 1))
    assert np.all(late(10 * STEP).driven(u, Intersample(STEP, hold=True)) == 0.0)


@pytest.mark.parametrize("tau", [0.37, 1.0])
def test_a_loop_is_that_of_the_plant_in_q(tau):
    """Against the recursion of y and u with the sampled plant's polynomials."""
    sampled = SampledModel(late(tau), STEP)
    C = TransferMatrix.build([[[0.2, -0.15]]], [[(1.0, -1.0)]])
    loop = close_loop(sampled, C)
    loop.check_stability()
    rng = np.random.default_rng(2)
    r, e = rng.normal(size=(2, 50, 1))
    y, u = loop.signals(r, e)
    b, a = sampled.continuous_plant.held(0, 0, STEP).sampled
    np.testing.assert_allclose(scipy.signal.lfilter(b, a, u[:, 0]) + e[:, 0], y[:, 0], atol=1e-10)
    np.testing.assert_allclose(
        r[:, 0] - scipy.signal.lfilter([0.2, -0.15], [1, -1], y[:, 0]), u[:, 0], atol=1e-10
    )
