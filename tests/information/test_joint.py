"""Plants that are looked at together tell, and cost, what each does alone."""

from dataclasses import replace

import numpy as np
import pytest

from inputdesign_cli.information import (
    Experiment,
    joint_information,
    joint_noise,
    jointly_whitened,
    mean_cost,
)
from inputdesign_cli.plant import (
    PolynomialModel,
    close_loop,
    disturbance_gradients,
    excitation_gradients,
    excited,
)
from inputdesign_cli.plant.polynomial import evaluate
from inputdesign_cli.plant.transfer import Rational, TransferMatrix
from inputdesign_cli.spectrum import FirBasis, FlatBasis, LinesBasis
from tests.support.plants import arx
from tests.support.scenarios import around, moved

EVERY = PolynomialModel.single(
    [0, 2.0, 0.3], A=[1, -0.5], C=[1, 0.2], D=[1, 0.6], F=[1, -0.1, 0.4], variance=0.7
)
OUTPUT_ERROR = PolynomialModel.single([0, 0.5], F=[1, -0.8])
SLOW, INTEGRATING = ([0.4], [1, -0.95]), ([0.2], [1, -1])


def controlled(model, controller):
    numerator, denominator = map(np.array, controller)
    return close_loop(model, TransferMatrix.diagonal(Rational.build(numerator, denominator), 1))


CASES = {
    "every polynomial": Experiment(EVERY, 50),
    "output error": Experiment(OUTPUT_ERROR, 50),
    "in a loop": Experiment(OUTPUT_ERROR, 50, loop=controlled(OUTPUT_ERROR, SLOW)),
    "under integral action": Experiment(OUTPUT_ERROR, 50, loop=controlled(OUTPUT_ERROR, INTEGRATING)),
    "several channels": Experiment(arx(), 50),
}


@pytest.fixture(params=CASES)
def plants(request):
    nominal = CASES[request.param]
    return [nominal, *(moved(nominal, theta) for theta in around(nominal, 40, 0.03))]


def test_each_is_white_in_coordinates_of_its_own(plants):
    """Flat excitation of that power tells the identity, by the integrals of the plant alone."""
    for white in jointly_whitened(plants, 2.0):
        basis = FlatBasis(white.inputs, white.band)
        told = basis.integrals(white.information_density, white.singularities, white.information_factor)
        np.testing.assert_allclose(
            white.noise_information + 2.0 * told[0], np.eye(white.size), rtol=0, atol=1e-9
        )


def test_the_noise_tells_what_it_tells_of_each(plants):
    told = joint_noise(plants)
    for own, plant in zip(told, plants, strict=True):
        alone = replace(plant).noise_information
        np.testing.assert_allclose(own, alone, rtol=1e-9, atol=1e-10 * np.abs(alone).max())


@pytest.mark.parametrize("basis", [FirBasis(1, 7), LinesBasis.at(np.array([0.1, 0.9, 2.2]), 1)])
def test_integrals_are_those_of_each(plants, basis):
    if plants[0].inputs > 1:
        basis = LinesBasis.at(np.array([0.1, 0.9, 2.2]), 2)
    white = jointly_whitened(plants, 1.0)
    told = joint_information(white, basis.integrals)
    assert told.shape == (basis.size, len(plants), white[0].size, white[0].size)
    for number, plant in enumerate(white):
        alone = basis.integrals(plant.information_density, plant.singularities)
        np.testing.assert_allclose(told[:, number], alone, rtol=0, atol=1e-10 * np.abs(alone).max())


@pytest.mark.parametrize("samples", [3, 3000])
def test_the_mean_cost_is_the_mean_of_the_powers(plants, samples):
    w = np.linspace(0.01, 3.1, samples)
    weights = [("input", None, 1.0), ("output", 0, 0.3), ("excitation", None, 0.1)]
    each = [
        sum(weight * p.power_density(kind, w, channel) for kind, channel, weight in weights) for p in plants
    ]
    np.testing.assert_allclose(mean_cost(plants, weights, w), np.mean(each, axis=0), rtol=1e-10)


def test_what_loops_cause_is_the_definition():
    """G S at y and S at u, with S = 1 / (1 + C G), also where one of the plants integrates."""
    w = np.array([0.3, 1.2, 2.9])
    q = np.exp(-1j * w)
    models = [PolynomialModel.single([0, b], F=[1, -f]) for b, f in ((0.5, 0.8), (0.4, 1.0), (0.3, 0.5))]
    for numerator, denominator in (SLOW, INTEGRATING):
        C = numerator[0] / (denominator[0] + denominator[1] * q)
        y, u = excited([controlled(model, (numerator, denominator)) for model in models], w)
        for number, model in enumerate(models):
            G = model.plant_at(w)[:, 0, 0]
            np.testing.assert_allclose(u[number, :, 0, 0], 1.0 / (1.0 + C * G), rtol=1e-12)
            np.testing.assert_allclose(y[number, :, 0, 0], G / (1.0 + C * G), rtol=1e-12)


@pytest.mark.parametrize("samples", [3, 700])  # few frequencies, and many
@pytest.mark.parametrize("controllers", [(SLOW, SLOW, SLOW), (INTEGRATING,) * 3, (SLOW, INTEGRATING, SLOW)])
def test_gradients_of_loops_are_the_derivatives_of_the_predictor(samples, controllers):
    """y = G S r + .. and u = S r put into (D A / C) y - (D B / (C F)) u, by finite differences.

    The last coefficients of the first plant vanish: those of the others do not.
    """
    w = np.linspace(0.2, 3.0, samples)
    models = [
        PolynomialModel.single([0, 0.5, b2], A=[1, -0.4, a2], C=[1, 0.2], D=[1, d1])
        for a2, b2, d1 in ((0.0, 0.0, 0.3), (0.1, 0.2, 0.1), (-0.2, 0.1, 0.5))
    ]
    loops = [controlled(model, controller) for model, controller in zip(models, controllers, strict=True)]
    q = np.exp(-1j * w)

    def filters(model, theta):
        at = model.at(theta)
        A, B, C, D = (np.polynomial.polynomial.polyval(q, c) for c in (at.A[0], at.B[0][0], at.C[0], at.D[0]))
        return D * A / C, D * B / C

    of_r, of_e = excitation_gradients(loops, w), disturbance_gradients(loops, w)
    for number, (model, (above, below)) in enumerate(zip(models, controllers, strict=True)):
        C = above[0] / (below[0] + below[1] * q)
        G, H = model.plant_at(w)[:, 0, 0], model.noise_at(w)[:, 0, 0]
        S = 1.0 / (1.0 + C * G)
        for index in range(len(model.theta)):
            step = np.zeros(len(model.theta))
            step[index] = 1e-6
            (Y1, U1), (Y0, U0) = filters(model, model.theta + step), filters(model, model.theta - step)
            dY, dU = (Y1 - Y0) / 2e-6, (U1 - U0) / 2e-6
            for found, y, u in ((of_r, G * S, S), (of_e, S * H, -C * S * H)):
                # epsilon = dY y - dU u, and the gradient of the prediction is minus that.
                np.testing.assert_allclose(found[number, :, index, 0, 0], dU * u - dY * y, rtol=0, atol=1e-7)


@pytest.mark.parametrize("length", [1, 2, 5])
def test_several_polynomials_have_the_values_of_each(length):
    rng = np.random.default_rng(length)
    coefficients, q = rng.normal(size=(4, length)), np.exp(-1j * rng.uniform(0, 3, size=6))
    for number in (1, 4):
        expected = np.polynomial.polynomial.polyval(q, coefficients[:number].T)
        np.testing.assert_allclose(evaluate(coefficients[:number], q), expected, rtol=1e-13)
