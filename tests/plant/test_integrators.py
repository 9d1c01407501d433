"""Plants in s that integrate, behind a hold: against closed forms, polynomials, and plain recursions."""

import numpy as np
import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.expressions import Expression
from inputdesign_cli.identification import identify
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.plant import (
    ContinuousModel,
    Intersample,
    Loop,
    Parametrisation,
    PolynomialModel,
    Reparametrised,
    SampledModel,
    TransferMatrix,
    close_loop,
)
from inputdesign_cli.plant.held import HeldEntry
from inputdesign_cli.spectrum import FirBasis
from tests.support.plants import descending

H = 0.5
W = np.concatenate([np.geomspace(1e-6, 0.1, 30), np.linspace(0.1, np.pi, 40)])


def sampled(numerator, denominator, delay=()):
    plant = ContinuousModel.monic(
        descending([[numerator]]), descending([[denominator]]), np.eye(1), delay=delay
    )
    return SampledModel(plant, H)


def lagging_tank(b, a, z):
    """b / (s (s + a)) behind a hold, and its derivatives in b and a, from the response to a step."""
    E, k, T = np.exp(-a * H), b / a, 1.0 / a
    G = k * (H / (z - 1) - T * (1 - E) / (z - E))
    in_k = G / k
    slope = E * H * a**2  # dE/dT
    in_T = -k * ((1 - E - slope * T) / (z - E) + T * (1 - E) * slope / (z - E) ** 2)
    return G, in_k / a, -in_k * b / a**2 - in_T / a**2


def test_response_and_gradient_are_those_of_the_closed_form_down_to_the_pole():
    model = sampled([0.3], [1, 0.8, 0])
    gradient = model.plant_gradient(W)[:, :, 0, 0]
    G, in_b, in_a1 = lagging_tank(0.3, 0.8, np.exp(1j * W))
    assert model.names == ("b0", "a0", "a1")
    np.testing.assert_allclose(model.plant_at(W)[:, 0, 0], G, rtol=1e-9)
    np.testing.assert_allclose(gradient[:, 0], in_b, rtol=1e-9)
    np.testing.assert_allclose(gradient[:, 2], in_a1, rtol=1e-9)


def test_gradient_of_a_free_pole_is_that_of_differences():
    """b / ((s + p)(s + q)) near p = 0, a0 = p q: the closed form of the sampled plant with two real poles."""
    b, a1, step = 0.3, 0.8, 3e-4
    z = np.exp(1j * np.linspace(0.05, 3.0, 20))

    def held(a0):
        large = (a1 + np.sqrt(a1**2 - 4 * a0)) / 2
        p, q = -a0 / large, -large
        parts = [np.expm1(x * H) / x / (x - y) / (z - np.exp(x * H)) for x, y in ((p, q), (q, p))]
        return b * sum(parts)

    model = sampled([b], [1, a1, 0])
    expected = (8 * (held(step) - held(-step)) - (held(2 * step) - held(-2 * step))) / (12 * step)
    found = model.plant_gradient(np.angle(z))[:, 1, 0, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_double_integrator_and_dead_time():
    z = np.exp(1j * W)
    np.testing.assert_allclose(
        sampled([1.0], [1, 0, 0]).plant_at(W)[:, 0, 0], H**2 / 2 * (z + 1) / (z - 1) ** 2, rtol=1e-9
    )
    late = sampled([1.0], [1, 0], ((np.array([0.7]),),))  # one sample and 0.2
    np.testing.assert_allclose(late.plant_at(W)[:, 0, 0], (0.3 / z + 0.2 / z**2) / (z - 1), rtol=1e-9)
    np.testing.assert_allclose(late.plant_gradient(W)[:, -1, 0, 0], (1 / z**2 - 1 / z) / (z - 1), rtol=1e-9)


def known_pole(model, name):
    return Reparametrised(model, Parametrisation.identity(model.names, model.theta, [name]))


def pair(controller, below):
    """b / s and b1 q^-1 / (1 - q^-1) with b1 = b H, in one loop; the poles are known."""
    C = TransferMatrix.build([[controller]], [[below]])
    models = (
        known_pole(sampled([0.4], [1, 0]), "a0"),
        known_pole(PolynomialModel.single([0, 0.4 * H], F=[1, -1]), "f1"),
    )
    return [Experiment(model, 7, loop=close_loop(model, C)) for model in models]


@pytest.mark.parametrize("controller", [([1.2, -1.0], [1, -1]), ([0.9], [1])], ids=["PI", "P"])
def test_the_loop_around_an_integrator_is_that_of_polynomials(controller):
    held, polynomial = pair(*controller)
    w = np.array([0.0, 1e-3, 0.3, np.pi])
    for one, other in zip(held.loop.sensitivity(w), polynomial.loop.sensitivity(w), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-5)
    basis = FirBasis(1, 4)
    maps = [basis.integrals(e.information_density, e.singularities) for e in (held, polynomial)]
    np.testing.assert_allclose(maps[0], H**2 * maps[1], rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(held.noise_information, H**2 * polynomial.noise_information, rtol=1e-9)
    powers = [
        basis.integrals(lambda w, e=e: e.power_density("output", w), e.singularities)
        for e in (held, polynomial)
    ]
    np.testing.assert_allclose(powers[0], powers[1], rtol=1e-9, atol=1e-10)
    rng = np.random.default_rng(0)
    r, e = rng.standard_normal((2, 3, 200, 1))
    for one, other in zip(held.loop.signals(r, e), polynomial.loop.signals(r, e), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


MATRICES = {
    "excitation": lambda e: FirBasis(1, 0).integrals(e.information_density, e.singularities)[0],
    "noise": lambda e: e.noise_information,
}


def test_information_next_to_the_pole_is_that_of_simulated_impulses():
    """psi of the gain alone, sample by sample: the integral over frequency is the sum over time."""
    gain = pair([0.9], [1])[0]
    samples = 400
    for source, found in (("r", "excitation"), ("e", "noise")):
        r, e = np.zeros((2, samples, 1))
        (r if source == "r" else e)[0] = 1.0
        _, u = gain.loop.signals(r, e)
        psi = H * np.concatenate([[0.0], np.cumsum(u[:-1, 0])])  # d(y) / db
        value = MATRICES[found](gain)[0, 0]
        assert value == pytest.approx(7 * psi @ psi, rel=1e-9)


def test_integrators_that_inputs_share_are_one():
    """A tank with two inflows is held by one controller: its level is a single state."""
    rows = [[[0.2], [0.5]]], [[[1, 0], [1, 0]]]
    plant = ContinuousModel.monic(descending(rows[0]), descending(rows[1]), np.eye(1))
    C = TransferMatrix.build([[[0.8]], [[0.0]]], [[[1]], [[1]]])
    Loop(SampledModel(plant, H), C).check_stability()
    apart = [[[0.2], [0]], [[0], [0.5]]], [[[1, 0], [1]], [[1], [1, 0]]]
    plant = ContinuousModel.monic(descending(apart[0]), descending(apart[1]), np.eye(2))
    C = TransferMatrix.build([[[0.8], [0.0]], [[0.0], [0.0]]], [[[1], [1]], [[1], [1]]])
    with pytest.raises(SpecError):  # the other tank is left to itself
        Loop(SampledModel(plant, H), C).check_stability()


@pytest.mark.parametrize("hold", [True, False])
def test_samples_drive_an_integrator_as_a_sum(hold):
    rng = np.random.default_rng(1)
    u = np.convolve(rng.standard_normal(3000), np.hanning(64) / 32, mode="same")
    entry = HeldEntry.of(np.array([1.0]), np.array([0.0, 1.0]), H)
    y = Intersample(H, hold=hold).caused(entry, u)
    expected = H * np.concatenate([[0.0], np.cumsum(u[:-1])])
    if not hold:  # the trapezoidal rule is nearly exact for a signal that is slow
        expected = expected + 0.5 * H * u
    np.testing.assert_allclose(y, expected, atol=1e-9 if hold else 0.02 * np.abs(expected).max())


def test_the_gradient_of_a_record_is_that_of_differences():
    model, record = sampled([0.3], [1, 0.8, 0]), np.random.default_rng(2).standard_normal((300, 1))
    e = np.zeros((300, 1))

    def caused(moved):
        return model.at(moved).simulate(record, e, 1.0)[0]

    step = 1e-6 * np.eye(3)[[0, 2]]
    expected = [(caused(model.theta + d) - caused(model.theta - d)) / 2e-6 for d in step]
    psi = FiniteRecord(Experiment(model, 300), 300).gradient(record)[:, [0, 2], 0]
    np.testing.assert_allclose(psi, np.concatenate(expected, axis=1), atol=1e-6 * np.abs(psi).max())


def test_estimates_hold_the_integrator():
    """Within four standard deviations; the pole stays where it is known to be."""
    plant = ContinuousModel.monic(descending([[[0.3]]]), descending([[[1, 0.8, 0]]]), 0.01 * np.eye(1))
    rng = np.random.default_rng(3)
    for truth in (SampledModel(plant, H), PolynomialModel.single([0, 0.2], F=[1, -1.6, 0.6], variance=0.01)):
        model = known(truth)
        u = np.repeat(rng.choice([-1.0, 1.0], (200, 1)), 4, axis=0)
        y = sum(truth.simulate(u, 0.1 * rng.standard_normal((800, 1)), 1.0))
        found = identify(model, u, y, start=0.8 * model.theta)
        assert found.search.converged
        assert np.all(np.abs(found.theta - model.theta) < 4 * np.sqrt(np.diag(found.covariance)))


def known(model) -> Reparametrised:
    """a0 of a plant in s is known, and f1 + f2 = -1 of one in q^-1."""
    if model.names == ("b0", "a0", "a1"):
        return known_pole(model, "a0")
    terms = tuple(map(Expression, ("b", "-1 - p", "p")))
    return Reparametrised(
        model, Parametrisation(("b", "p"), ("b", "p"), model.theta[[0, 2]], np.ones(2, dtype=bool), terms)
    )
