"""Gradients of models against finite differences and formulas of the paper; sampling against scipy."""

import control
import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.plant import ContinuousModel, PolynomialModel, SampledModel
from tests.support.plants import arrays, arx, box_jenkins, descending, two_by_two
from tests.support.random_plants import STRUCTURES, random_loop, random_model

W = np.array([0.05, 0.4, 1.3, 2.9])
COMMON = ContinuousModel.monic(
    descending([[[2.0, 1.0], [1.0]], [[0.0], [3.0, -1.0, 2.0]]]),
    descending([[[2.0, 3.0, 2.0]] * 2] * 2),
    np.eye(2),
    common=True,
)
SINGLE = PolynomialModel.single([0, 2.0, 0.3], A=[1, -0.5], C=[1, 0.2], D=[1, 0.6], F=[1, -0.1, 0.4])
MODELS = {
    "one channel": SINGLE,
    "arx": arx(),
    "common arx": arx(per_output=False),
    "box-jenkins": box_jenkins(),
    "continuous": two_by_two(),
    "common continuous": COMMON,
    "sampled": SampledModel(two_by_two(), 0.4),
    "common sampled": SampledModel(COMMON, 0.7),
}


def moved(model, index, step):
    """The model with one parameter changed."""
    return model.at(model.theta + step * np.eye(model.theta.size)[index])


@pytest.mark.parametrize("name", MODELS)
def test_plant_gradient_is_the_finite_difference(name):
    model, step = MODELS[name], 1e-5
    exact = model.plant_gradient(W)
    for index in range(len(model.names)):
        if not model.in_plant[index]:
            assert np.all(exact[:, index] == 0)
            continue
        difference = (moved(model, index, step).plant_at(W) - moved(model, index, -step).plant_at(W)) / (
            2 * step
        )
        scale = np.abs(exact[:, index]).max()
        np.testing.assert_allclose(exact[:, index], difference, rtol=0, atol=1e-8 * scale + 1e-11)


def noise_filter(model, w):
    q = np.exp(-1j * w)
    H = np.zeros((w.size, model.outputs, model.outputs), dtype=complex)
    for i in range(model.outputs):
        value = [
            np.polynomial.polynomial.polyval(q, rows[0 if len(rows) == 1 else i])
            for rows in (model.C, model.A, model.D)
        ]
        H[:, i, i] = value[0] / (value[1] * value[2])
    return H


@pytest.mark.parametrize("name", ["one channel", "arx", "common arx", "box-jenkins"])
def test_prediction_gradients_are_those_of_plant_and_noise_filter(name):
    model, step = MODELS[name], 1e-5
    inverse = np.linalg.inv(noise_filter(model, W))
    expected = np.einsum("npq,nkqr->nkpr", inverse, model.plant_gradient(W))
    np.testing.assert_allclose(model.input_gradient(W), expected, atol=1e-12)
    for index in range(len(model.names)):
        up, down = moved(model, index, step), moved(model, index, -step)
        difference = inverse @ (noise_filter(up, W) - noise_filter(down, W)) / (2 * step)
        np.testing.assert_allclose(model.noise_gradient(W)[:, index], difference, atol=2e-9)


def test_names_carry_output_and_input():
    assert arx().names[:4] == ("a1[1]", "a1[2]", "b1[1,1]", "b2[1,1]")
    assert arx(per_output=False).names[:3] == ("a1", "a2", "b1[1,1]")
    assert two_by_two().names[:4] == ("b0[1,1]", "b0[1,2]", "b0[2,1]", "b0[2,2]")
    assert two_by_two().names[-2:] == ("a0[2,2]", "a1[2,2]")
    assert COMMON.names == ("b0[1,1]", "b1[1,1]", "b0[1,2]", "b0[2,2]", "b1[2,2]", "b2[2,2]", "a0", "a1")
    single = ContinuousModel.monic(descending([[[2.0]]]), descending([[[1.0, 3.0]]]), np.eye(1))
    assert single.names == ("b0", "a0")
    delayed = PolynomialModel.single([0, 0, 0, 0.1, 0.2], A=[1, -0.5], C=[1, 0.1])
    assert delayed.names == ("a1", "b3", "b4", "c1")
    assert list(delayed.in_plant) == [True, True, True, False]


@pytest.mark.parametrize("model", [two_by_two(), COMMON], ids=["strictly proper", "biproper"])
def test_zero_order_hold_is_that_of_the_matrix_exponential(model):
    period = 0.4
    sampled = SampledModel(model, period)
    for i, j in model.active:
        top, bottom = model.numerator[i][j][::-1], model.denominator[i][j][::-1]
        num, den, _ = scipy.signal.cont2discrete((top, bottom), period, method="zoh")
        _, expected = scipy.signal.freqz(num.ravel(), den, worN=W)
        np.testing.assert_allclose(sampled.plant_at(W)[:, i, j], expected, rtol=1e-10)


def test_sampled_zeros_and_poles_are_those_of_the_sampled_entry():
    model = two_by_two()
    system = control.tf([3.125], [1, 1.5, 1.563]).sample(0.4)
    roots = np.concatenate([system.poles(), system.zeros()])
    points = np.abs(np.angle(roots)) + 1j * np.abs(np.log(np.abs(roots)))
    ours = SampledModel(model, 0.4).entry_singularities(0, 0)
    np.testing.assert_allclose(np.sort_complex(ours), np.sort_complex(points), atol=1e-8)


def test_widely_separated_time_constants_survive_sampling():
    """Poles at 1e-3 and 1e3 rad/s, sampled slowly: the static gain must come out to rounding."""
    model = ContinuousModel.monic(arrays([[[1.0]]]), arrays([[[1.0, 1000.001, 1.0]]]), np.eye(1))
    assert SampledModel(model, 1.0).plant_at(np.zeros(1))[0, 0, 0] == pytest.approx(1.0, rel=1e-9)


def test_plant_of_any_scale_of_leading_coefficients_is_the_same():
    scaled = ContinuousModel.monic(arrays([[[4.0, 2.0]]]), arrays([[[2.0, 6.0, 2.0]]]), np.eye(1))
    np.testing.assert_allclose(scaled.theta, [2.0, 1.0, 1.0, 3.0])


AROUND = np.array([0.0, 0.01, 0.3, 1.0, 2.5, np.pi])


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
    G, H = bode(polynomials(model), AROUND)
    np.testing.assert_allclose(model.plant_at(AROUND)[:, 0, 0], G, rtol=1e-10)
    np.testing.assert_allclose(model.noise_at(AROUND)[:, 0, 0], H, rtol=1e-10)
    dG = model.plant_gradient(AROUND)[:, :, 0, 0]
    dH = model.noise_gradient(AROUND)[:, :, 0, 0] * H[:, None]
    h = 1e-6
    for k, step in enumerate(h * np.eye(len(model.names))):
        up, down = (bode(polynomials(model, model.theta + sign * step), AROUND) for sign in (1, -1))
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
    G, H = bode(polynomials(model), AROUND)
    C = loop.controller.at(AROUND)[:, 0, 0] if closed else np.zeros_like(G)
    S = 1 / (1 + C * G)
    dG, dH = model.plant_gradient(AROUND)[:, :, 0, 0], model.noise_gradient(AROUND)[:, :, 0, 0] * H[:, None]
    source = loop if closed else model
    excited = (source.excitation_gradient if closed else source.input_gradient)(AROUND)[:, :, 0, 0]
    noise = source.noise_gradient(AROUND)[:, :, 0, 0]
    np.testing.assert_allclose(excited, (S / H)[:, None] * dG, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(noise, dH / H[:, None] - (C * S)[:, None] * dG, rtol=1e-8, atol=1e-8)
