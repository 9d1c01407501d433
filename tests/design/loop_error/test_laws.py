"""Each control law gives the loop it promises, and its derivative is that of finite differences."""

import numpy as np
import pytest

from inputdesign_cli.design.loop_error import InternalModel, MinimumVariance, ModelReference
from inputdesign_cli.design.loop_error.laws import propagation
from inputdesign_cli.plant import Rational, TransferMatrix, zero_order_hold
from tests.support.loop_error import matrix_plant, random_complex, random_plant

W = np.array([0.1, 0.7, 1.9, 3.0])


def laws(n):
    rng = np.random.default_rng(n)
    plant = random_plant(rng, n)
    matrix = TransferMatrix.build(
        [[[0.0, 0.4 if i == j else 0.1 * (i - j)] for j in range(n)] for i in range(n)],
        [[[1.0, -0.5] if i == j else [1.0, -0.2] for j in range(n)] for i in range(n)],
    )
    scalar = TransferMatrix.diagonal(Rational.build([0.0, 0.3], [1.0, -0.7]), n)
    return {
        "model_reference": ModelReference(scalar),
        "model_reference, matrix": ModelReference(matrix),
        "internal_model": InternalModel.build(plant, Rational.build([0.5], [1.0, -0.5])),
        "minimum_variance": MinimumVariance(plant),
    }


CASES = [(n, name) for n in (1, 2, 3) for name in laws(1)]


def difference(function, G, step=1e-6):
    """d vec f / d vec G by central differences in complex directions; checks that f is analytic."""
    K, n, _ = G.shape
    columns = []
    for j in range(n):
        for i in range(n):
            E = np.zeros((n, n))
            E[i, j] = step
            along = (function(G + E) - function(G - E)) / (2 * step)
            across = (function(G + 1j * E) - function(G - 1j * E)) / (2j * step)
            np.testing.assert_allclose(along, across, rtol=1e-5, atol=1e-6 * np.abs(along).max())
            columns.append(np.swapaxes(along, 1, 2).reshape(K, -1))
    return np.stack(columns, axis=2)


@pytest.mark.parametrize(("n", "name"), CASES)
def test_propagation_is_the_derivative_of_the_true_loop(n, name):
    law = laws(n)[name]
    G = random_complex(np.random.default_rng(8), W.size, n, n) + 2 * np.eye(n)

    def loop(estimate):
        L = G @ law.controller(estimate, W)
        return np.linalg.solve(np.eye(n) + L, L)

    expected = difference(loop, G)
    np.testing.assert_allclose(
        propagation(law, G, W), expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max()
    )


@pytest.mark.parametrize(("n", "name"), CASES)
def test_the_loop_is_the_one_that_the_law_promises(n, name):
    law = laws(n)[name]
    G = random_complex(np.random.default_rng(9), W.size, n, n)
    L = G @ law.controller(G, W)
    np.testing.assert_allclose(np.linalg.solve(np.eye(n) + L, L), law.complementary(W), atol=1e-11)


@pytest.mark.parametrize("n", [1, 2])
def test_minimum_variance_leaves_the_unavoidable_part_of_the_noise(n):
    for delay in (1, 2, 3):
        plant = random_plant(np.random.default_rng(delay), n, delay=delay)
        law = MinimumVariance(plant)
        w = 2 * np.pi * np.arange(256) / 256
        output = (np.eye(n) - law.complementary(w)) @ plant.noise_at(w)
        taps = np.fft.ifft(output, axis=0)
        H = np.fft.ifft(plant.noise_at(w), axis=0)
        np.testing.assert_allclose(taps[:delay], H[:delay], atol=1e-10)
        np.testing.assert_allclose(taps[delay:], 0, atol=1e-10)


def test_the_noise_jacobian_is_that_of_finite_differences():
    rng = np.random.default_rng(3)
    plant = random_plant(rng, 2, delay=2)
    law = MinimumVariance(plant)
    G, H, E = plant.plant_at(W), plant.noise_at(W), law.unavoidable(W)
    expected = difference(lambda X: np.linalg.inv(G) @ (X @ np.linalg.inv(E) - np.eye(2)), H)
    np.testing.assert_allclose(law.noise_jacobian(G, W), expected, rtol=1e-6, atol=1e-8)


def test_internal_model_keeps_zeros_outside_and_the_delay_in_the_loop():
    plant = matrix_plant(B=[[[0, 0, 1.0, -2.0]]], A=[[1, -0.5]], covariance=[[1.0]])
    law = InternalModel.build(plant, Rational.build([0.4], [1.0, -0.6]))
    w = np.linspace(0, np.pi, 50)
    f = 0.4 / np.abs(1 - 0.6 * np.exp(-1j * w))
    np.testing.assert_allclose(np.abs(law.complementary(w)[:, 0, 0]), f, rtol=1e-12)
    assert law.desired.whole.delay == 2
    at_zero = np.polynomial.polynomial.polyval(1 / 2.0, law.desired.whole.numerator[0, 0])
    assert abs(at_zero) < 1e-12
    # A stable filter inverse: G^-1 T has no pole outside.
    np.testing.assert_allclose(law.complementary(np.zeros(1))[0, 0, 0], 1.0, rtol=1e-12)


def test_a_zero_order_hold_of_a_lag():
    held = zero_order_hold([1.0], [75.0, 1.0], 2.0)
    above, below = held.numerator, held.denominator_polynomial
    a = np.exp(-2 / 75)
    np.testing.assert_allclose(above, [0, 1 - a], atol=1e-15)
    np.testing.assert_allclose(below, [1, -a], atol=1e-15)
    assert above[0] == 0.0
