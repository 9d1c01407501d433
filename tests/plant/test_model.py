"""Gradients against finite differences, the predictor form against the formulas of the paper."""

import dataclasses

import numpy as np
import pytest
from plants import STRUCTURES, random_loop, random_model

from inputdesign_cli.errors import SpecError
from inputdesign_cli.plant import Loop, PolynomialModel, Rational

W = np.array([0.0, 0.01, 0.3, 1.0, 2.5, np.pi])


def with_theta(model, theta):
    values = dict(zip(model.names, theta, strict=True))
    changed = {}
    for letter in "ABCDF":
        polynomial = np.array(getattr(model, letter), dtype=float)
        for lag in range(len(polynomial)):
            name = f"{letter.lower()}{lag}"
            if name in values:
                polynomial[lag] = values[name]
        changed[letter] = polynomial
    return dataclasses.replace(model, **changed)


def bode(model, w):
    """G and H by plain polynomial evaluation."""
    z = np.exp(1j * w)

    def value(p):
        return sum(c * z ** (-i) for i, c in enumerate(p))

    A, B, C, D, F = (value(getattr(model, letter)) for letter in "ABCDF")
    return B / (A * F), C / (A * D)


@pytest.mark.parametrize("structure", STRUCTURES)
def test_gradients_equal_finite_differences(structure):
    model = random_model(np.random.default_rng(7), structure, 3)
    response = model.response(W)
    G, H = bode(model, W)
    np.testing.assert_allclose(response.G[:, 0, 0], G, rtol=1e-10)
    np.testing.assert_allclose(response.H[:, 0, 0], H, rtol=1e-10)
    h = 1e-6
    for k in range(len(model.names)):
        step = h * np.eye(len(model.names))[k]
        up, down = (
            bode(with_theta(model, model.theta + step), W),
            bode(with_theta(model, model.theta - step), W),
        )
        for analytic, plus, minus in ((response.dG, up[0], down[0]), (response.dH, up[1], down[1])):
            difference = (plus - minus) / (2 * h)
            np.testing.assert_allclose(
                analytic[:, k, 0, 0], difference, rtol=1e-5, atol=1e-5 * np.abs(analytic).max()
            )


@pytest.mark.parametrize("structure", STRUCTURES)
@pytest.mark.parametrize("closed", [False, True])
def test_prediction_gradient_equals_the_formulas_of_the_paper(structure, closed):
    """F_u = Lambda_G / H and F_r, F_v of (15), where no pole is near the circle to spoil the division."""
    rng = np.random.default_rng(11)
    model = random_model(rng, structure, 2)
    loop = random_loop(rng, model, closed=closed)
    G, H = bode(model, W)
    C = loop.controller.at(W) if closed else np.zeros_like(G)
    S = 1 / (1 + C * G)
    dG, dH = model.plant_gradient(W), model.noise_gradient(W)
    t = loop.responses(W)
    excited = model.prediction_gradient(W, t.y_x, t.u_x, np.zeros_like(G))
    noise = model.prediction_gradient(W, t.y_e, t.u_e, np.ones_like(G))
    np.testing.assert_allclose(excited, (S / H)[:, None] * dG, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(noise, dH / H[:, None] - (C * S)[:, None] * dG, rtol=1e-8, atol=1e-8)


def test_names_follow_the_contract():
    model = PolynomialModel.single(
        B=np.array([0, 0, 0, 0.1, 0.2]), A=np.array([1, -0.5]), C=np.array([1, 0.1])
    )
    assert model.names == ("a1", "b3", "b4", "c1")
    assert list(model.in_plant) == [True, True, True, False]


def test_unstable_plant_in_a_stable_loop_has_finite_gradients():
    """An ARX plant with an integrator: S G and the gradients stay finite at DC."""
    model = PolynomialModel.single(A=np.array([1.0, -1.0]), B=np.array([0.0, 1.0]))
    loop = Loop(model, Rational.build([0.5]))
    loop.check_stability()
    t = loop.responses(np.array([0.0]))
    assert t.y_x[0] == pytest.approx(2.0)  # 1 / C at DC
    assert abs(t.u_x[0]) == pytest.approx(0.0)
    assert np.all(np.isfinite(model.prediction_gradient(np.array([0.0]), t.y_x, t.u_x, np.zeros(1))))


def test_unstable_and_algebraic_loops_are_refused():
    model = PolynomialModel.single(A=np.array([1.0, -0.9]), B=np.array([0.0, 1.0]))
    with pytest.raises(SpecError) as unstable:
        Loop(model, Rational.build([-0.5])).check_stability()
    assert unstable.value.diagnostics[0].code == "unstable-loop"
    direct = PolynomialModel.single(B=np.array([1.0, 0.5]))
    with pytest.raises(SpecError) as algebraic:
        Loop(direct, Rational.build([-1.0])).check_stability()
    assert algebraic.value.diagnostics[0].code == "algebraic-loop"


def test_an_input_that_answers_the_noise_at_once_is_refused_where_the_plant_has_no_delay():
    direct, delayed = (PolynomialModel.single(B=np.array(B)) for B in ([1.0, 0.5], [0.0, 1.0]))
    now, later = Rational.build([0.3]), Rational.build([0.0, 0.3])
    with pytest.raises(SpecError) as caught:
        Loop(direct, now).check_delay()
    assert caught.value.diagnostics[0].code == "algebraic-loop"
    for plant, controller in ((direct, later), (delayed, now), (direct, None)):
        Loop(plant, controller).check_delay()
