"""Gradients of one channel against finite differences, the predictor form against formulas of the paper."""

import numpy as np
import pytest

from inputdesign_cli.plant import PolynomialModel
from tests.support.random_plants import STRUCTURES, random_loop, random_model

W = np.array([0.0, 0.01, 0.3, 1.0, 2.5, np.pi])


def polynomials(model, theta=None):
    """A, B, C, D and F by letter, with the values of `theta` by the names of its parameters."""
    values = dict(zip(model.names, model.theta if theta is None else theta, strict=True))
    own = {"A": model.A[0], "B": model.B[0][0], "C": model.C[0], "D": model.D[0], "F": model.F[0][0]}
    return {
        letter: [values.get(f"{letter.lower()}{lag}", c) for lag, c in enumerate(p)]
        for letter, p in own.items()
    }


def bode(polynomials, w):
    """G and H by plain polynomial evaluation."""
    z = np.exp(1j * w)
    A, B, C, D, F = (sum(c * z ** (-i) for i, c in enumerate(polynomials[letter])) for letter in "ABCDF")
    return B / (A * F), C / (A * D)


@pytest.mark.parametrize("structure", STRUCTURES)
def test_gradients_equal_finite_differences(structure):
    """dG is the model's own, dH that of its H^-1 dH."""
    model = random_model(np.random.default_rng(7), structure, 3)
    G, H = bode(polynomials(model), W)
    np.testing.assert_allclose(model.plant_at(W)[:, 0, 0], G, rtol=1e-10)
    np.testing.assert_allclose(model.noise_at(W)[:, 0, 0], H, rtol=1e-10)
    dG = model.plant_gradient(W)[:, :, 0, 0]
    dH = model.noise_gradient(W)[:, :, 0, 0] * H[:, None]
    h = 1e-6
    for k, step in enumerate(h * np.eye(len(model.names))):
        up, down = (bode(polynomials(model, model.theta + sign * step), W) for sign in (1, -1))
        for analytic, plus, minus in ((dG, up[0], down[0]), (dH, up[1], down[1])):
            difference = (plus - minus) / (2 * h)
            np.testing.assert_allclose(
                analytic[:, k], difference, rtol=1e-5, atol=1e-5 * np.abs(analytic).max()
            )


@pytest.mark.parametrize("structure", STRUCTURES)
@pytest.mark.parametrize("closed", [False, True])
def test_prediction_gradient_equals_the_formulas_of_the_paper(structure, closed):
    """F_u = Lambda_G / H and F_r, F_v of (15), where no pole is near the circle to spoil the division."""
    rng = np.random.default_rng(11)
    model = random_model(rng, structure, 2)
    loop = random_loop(rng, model, closed=closed)
    G, H = bode(polynomials(model), W)
    C = loop.controller.at(W)[:, 0, 0] if closed else np.zeros_like(G)
    S = 1 / (1 + C * G)
    dG, dH = model.plant_gradient(W)[:, :, 0, 0], model.noise_gradient(W)[:, :, 0, 0] * H[:, None]
    source = loop if closed else model
    excited = (source.excitation_gradient if closed else source.input_gradient)(W)[:, :, 0, 0]
    noise = source.noise_gradient(W)[:, :, 0, 0]
    np.testing.assert_allclose(excited, (S / H)[:, None] * dG, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(noise, dH / H[:, None] - (C * S)[:, None] * dG, rtol=1e-8, atol=1e-8)


def test_names_follow_the_contract():
    model = PolynomialModel.single([0, 0, 0, 0.1, 0.2], A=[1, -0.5], C=[1, 0.1])
    assert model.names == ("a1", "b3", "b4", "c1")
    assert list(model.in_plant) == [True, True, True, False]
