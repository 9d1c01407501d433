"""Plants in s behind a hold: dead times, gradients, integrators, loops."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.errors import SpecError
from inputdesign_cli.expressions import Expression
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.plant import (
    ContinuousModel,
    Loop,
    Parametrisation,
    PolynomialModel,
    Reparametrised,
    SampledModel,
    TransferMatrix,
    close_loop,
)
from inputdesign_cli.plant.held import HeldEntry, Intersample
from tests.support.plants import descending, known, lag_of, late_entries
from tests.support.records import check_estimate

W = np.array([0.05, 0.4, 1.3, 2.9])
STEP = H = 0.5
DELAYS = [0.0, 0.1, 0.37, 0.5, 1.0, 2.24]


def late(tau, numerator=(2.0, 1.0), denominator=(1.0, 0.7, 1.3)) -> ContinuousModel:
    return lag_of(numerator, denominator, tau)


def fine_step(model, u, steps=1000):
    """The output of one entry at the sampling instants, by a plain simulation with steps of STEP / 1000."""
    tau, h = float(model.theta[-1]), STEP / steps
    held = np.concatenate([np.zeros(round(tau / h)), np.repeat(u, steps)])[: u.size * steps]
    entry = (model.numerator[0][0][::-1], model.denominator[0][0][::-1])
    b, a, _ = scipy.signal.cont2discrete(entry, h, method="zoh")
    return scipy.signal.lfilter(b.ravel(), a, held)[::steps]


@pytest.mark.parametrize("tau", DELAYS)
def test_the_sampled_plant_agrees_with_a_fine_step_simulation_and_its_fraction_in_q(tau):
    u, model = np.random.default_rng(0).normal(size=(40, 1)), late(tau)
    sampled = SampledModel(model, STEP)
    y, _ = sampled.simulate(u, np.zeros((40, 1)), 1.0)
    np.testing.assert_allclose(y[:, 0], fine_step(model, u[:, 0]), atol=1e-8)
    expected = scipy.signal.freqz(*model.held(0, 0, STEP).sampled, worN=W)[1]
    np.testing.assert_allclose(sampled.plant_at(W)[:, 0, 0], expected, atol=1e-12)


@pytest.mark.parametrize("model", [late(0.37), late(1.0), late_entries(), late_entries(common=True)])
def test_the_realisation_has_the_frequency_response_of_the_plant(model):
    sampled, z = SampledModel(model, STEP), np.exp(1j * W)
    A, B, C, D = sampled.realisation
    expected = np.array([C @ np.linalg.solve(x * np.eye(len(A)) - A, B) + D for x in z])
    np.testing.assert_allclose(sampled.plant_at(W), expected, atol=1e-12)


def test_the_dead_time_gradient_has_two_one_sided_limits_at_a_whole_sample():
    """Relative degree one: b e^(-at) jumps at t = 0, so that the sides differ by the first sample."""
    first = lambda tau: SampledModel(late(tau, (2.0,), (1.0, 0.7)), STEP)  # noqa: E731
    right = first(1.0).plant_gradient(W)[:, -1, 0, 0]
    left = first(1.0 - 1e-7).plant_gradient(W)[:, -1, 0, 0]
    q = np.exp(-1j * W)
    np.testing.assert_allclose(left - right, 2.0 * (q - 1.0) * q**2, atol=1e-6)


@pytest.mark.parametrize("hold", [True, False])
def test_a_dead_time_of_whole_samples_shifts_the_output(hold):
    u = np.random.default_rng(1).normal(size=(60, 1))
    between = Intersample(STEP, hold)
    at_once, shifted = (late(tau).driven(u, between) for tau in (0.0, 3 * STEP))
    np.testing.assert_allclose(shifted[3:], at_once[:-3], atol=2e-2 if not hold else 1e-12)


def test_a_dead_time_beyond_the_record_gives_no_output():
    u = np.ones((10, 1))
    assert np.all(late(10 * STEP).driven(u, Intersample(STEP, hold=True)) == 0.0)


@pytest.mark.parametrize("tau", [0.37, 1.0])
def test_a_loop_satisfies_the_difference_equations_of_plant_and_controller(tau):
    """The recursion of y and u uses the polynomials of the sampled plant."""
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


DOWN = np.concatenate([np.geomspace(1e-6, 0.1, 30), np.linspace(0.1, np.pi, 40)])


def plant_of(numerator, denominator, *delay):
    return SampledModel(lag_of(numerator, denominator, *delay), H)


def lagging_tank(b, a, z):
    """b / (s (s + a)) behind a hold, and its derivatives in b and a, from the response to a step."""
    E, k, T = np.exp(-a * H), b / a, 1.0 / a
    G = k * (H / (z - 1) - T * (1 - E) / (z - E))
    in_k = G / k
    slope = E * H * a**2  # dE/dT
    in_T = -k * ((1 - E - slope * T) / (z - E) + T * (1 - E) * slope / (z - E) ** 2)
    return G, in_k / a, -in_k * b / a**2 - in_T / a**2


def test_response_and_gradient_agree_with_the_closed_form_down_to_the_pole():
    model = plant_of([0.3], [1, 0.8, 0])
    gradient = model.plant_gradient(DOWN)[:, :, 0, 0]
    G, in_b, in_a1 = lagging_tank(0.3, 0.8, np.exp(1j * DOWN))
    assert model.names == ("b0", "a0", "a1")
    np.testing.assert_allclose(model.plant_at(DOWN)[:, 0, 0], G, rtol=1e-9)
    np.testing.assert_allclose(gradient[:, 0], in_b, rtol=1e-9)
    np.testing.assert_allclose(gradient[:, 2], in_a1, rtol=1e-9)


def test_gradient_of_a_free_pole_agrees_with_finite_differences():
    """b / ((s + p)(s + q)) near p = 0, a0 = p q: the closed form of the sampled plant with two real poles."""
    b, a1, step = 0.3, 0.8, 3e-4
    z = np.exp(1j * np.linspace(0.05, 3.0, 20))

    def held(a0):
        large = (a1 + np.sqrt(a1**2 - 4 * a0)) / 2
        p, q = -a0 / large, -large
        parts = [np.expm1(x * H) / x / (x - y) / (z - np.exp(x * H)) for x, y in ((p, q), (q, p))]
        return b * sum(parts)

    model = plant_of([b], [1, a1, 0])
    expected = (8 * (held(step) - held(-step)) - (held(2 * step) - held(-2 * step))) / (12 * step)
    found = model.plant_gradient(np.angle(z))[:, 1, 0, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_double_and_delayed_integrators_have_their_closed_forms():
    z = np.exp(1j * DOWN)
    np.testing.assert_allclose(
        plant_of([1.0], [1, 0, 0]).plant_at(DOWN)[:, 0, 0], H**2 / 2 * (z + 1) / (z - 1) ** 2, rtol=1e-9
    )
    late = plant_of([1.0], [1, 0], 0.7)  # one sample and 0.2
    np.testing.assert_allclose(late.plant_at(DOWN)[:, 0, 0], (0.3 / z + 0.2 / z**2) / (z - 1), rtol=1e-9)
    np.testing.assert_allclose(
        late.plant_gradient(DOWN)[:, -1, 0, 0], (1 / z**2 - 1 / z) / (z - 1), rtol=1e-9
    )


@pytest.mark.parametrize("controller", [([1.2, -1.0], [1, -1]), ([0.9], [1])], ids=["PI", "P"])
def test_the_loop_around_an_integrator_equals_that_of_polynomials_down_to_zero(controller):
    """b / s and b1 q^-1 / (1 - q^-1) with b1 = b H; the poles are known."""
    C = TransferMatrix.build(*([[one]] for one in controller))
    models = (
        known(plant_of([0.4], [1, 0]), "a0"),
        known(PolynomialModel.single([0, 0.4 * H], F=[1, -1]), "f1"),
    )
    for one, other in zip(
        *(close_loop(x, C).sensitivity(np.r_[0.0, 1e-3, 0.3]) for x in models), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-5)


def test_an_integrator_shared_by_two_inputs_is_one_state():
    """A tank with two inflows is held by one controller: its level is a single state."""
    rows = [[[0.2], [0.5]]], [[[1, 0], [1, 0]]]
    plant = ContinuousModel.monic(descending(rows[0]), descending(rows[1]), np.eye(1))
    C = TransferMatrix.build([[[0.8]], [[0.0]]], [[[1]], [[1]]])
    Loop(SampledModel(plant, H), C).check_stability()
    apart = [[[0.2], [0]], [[0], [0.5]]], [[[1, 0], [1]], [[1], [1, 0]]]
    plant = ContinuousModel.monic(descending(apart[0]), descending(apart[1]), np.eye(2))
    C = TransferMatrix.build([[[0.8], [0.0]], [[0.0], [0.0]]], [[[1], [1]], [[1], [1]]])
    with pytest.raises(SpecError):  # the other tank is not controlled
        Loop(SampledModel(plant, H), C).check_stability()


@pytest.mark.parametrize("hold", [True, False])
def test_an_integrator_driven_by_samples_is_a_cumulative_sum(hold):
    rng = np.random.default_rng(1)
    u = np.convolve(rng.standard_normal(3000), np.hanning(64) / 32, mode="same")
    entry = HeldEntry.of(np.array([1.0]), np.array([0.0, 1.0]), H)
    y = Intersample(H, hold=hold).caused(entry, u)
    expected = H * np.concatenate([[0.0], np.cumsum(u[:-1])])
    if not hold:  # the trapezoidal rule is nearly exact for a signal that is slow
        expected = expected + 0.5 * H * u
    np.testing.assert_allclose(y, expected, atol=1e-9 if hold else 0.02 * np.abs(expected).max())


def test_the_gradient_of_a_record_agrees_with_finite_differences():
    model, record = plant_of([0.3], [1, 0.8, 0]), np.random.default_rng(2).standard_normal((300, 1))
    e = np.zeros((300, 1))

    def caused(moved):
        return model.at(moved).simulate(record, e, 1.0)[0]

    step = 1e-6 * np.eye(3)[[0, 2]]
    expected = [(caused(model.theta + d) - caused(model.theta - d)) / 2e-6 for d in step]
    psi = FiniteRecord(Experiment(model, 300), 300).gradient(record)[:, [0, 2], 0]
    np.testing.assert_allclose(psi, np.concatenate(expected, axis=1), atol=1e-6 * np.abs(psi).max())


def test_estimates_keep_a_known_integrator():
    """The pole stays where it is known to be: a0 = 0 in s, and f1 + f2 = -1 in q^-1."""
    in_s = SampledModel(lag_of([0.3], [1, 0.8, 0], variance=0.01), H)
    in_q = PolynomialModel.single([0, 0.2], F=[1, -1.6, 0.6], variance=0.01)
    terms, free = tuple(map(Expression, ("b", "-1 - p", "p"))), np.ones(2, dtype=bool)
    by = Parametrisation(("b", "p"), ("b", "p"), in_q.theta[[0, 2]], free, terms)
    rng = np.random.default_rng(3)
    for model in (known(in_s, "a0"), Reparametrised(in_q, by)):
        u = np.repeat(rng.choice([-1.0, 1.0], (200, 1)), 4, axis=0)
        y = sum(model.simulate(u, 0.1 * rng.standard_normal((800, 1)), 1.0))
        check_estimate(model, u, y, 0.8 * model.theta)
