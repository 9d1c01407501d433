"""Gradients of models against finite differences; sampling against scipy and python-control."""

from dataclasses import replace

import control
import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.plant import ContinuousModel, PolynomialModel, SampledModel
from tests.support.plants import arrays, arx, box_jenkins, descending, two_by_two

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
    """The model with one parameter changed: every coefficient that it stands for."""
    if isinstance(model, SampledModel):
        return SampledModel(moved(model.continuous_plant, index, step), model.sample_time)
    parameter = model.parameters[index]
    if isinstance(model, ContinuousModel):
        field = "numerator" if parameter.letter == "b" else "denominator"
    else:
        field = parameter.letter.upper()
    rows = getattr(model, field)

    def bumped(values):
        changed = values.copy()
        changed[parameter.power] += step
        return changed

    if isinstance(rows[0], tuple):
        new = tuple(
            tuple(bumped(v) if (i, j) in parameter.places else v for j, v in enumerate(row))
            for i, row in enumerate(rows)
        )
    elif len(rows) == 1:
        new = (bumped(rows[0]),)
    else:
        outputs = {place[0] for place in parameter.places}
        new = tuple(bumped(v) if i in outputs else v for i, v in enumerate(rows))
    return replace(model, **{field: new})


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
