"""Gradients of every kind of model against differences and formulas of the paper; sampling against scipy."""

from itertools import pairwise

import control
import numpy as np
import pytest

from inputdesign_cli.plant import (
    Coloured,
    ContinuousModel,
    PolynomialModel,
    SampledModel,
    input_gradients,
    noise_gradients,
)
from tests.support.loop_error import column, full_plant
from tests.support.plants import (
    arrays,
    arx,
    box_jenkins,
    descending,
    every_polynomial,
    in_words,
    known,
    lag_of,
    late_entries,
    polynomials,
    process,
    two_by_two,
)
from tests.support.random_plants import STRUCTURES, random_loop, random_model

W = np.array([0.05, 0.4, 1.3, 2.9])
STEP = 0.5
COMMON = ContinuousModel.monic(
    descending([[[2.0, 1.0], [1.0]], [[0.0], [3.0, -1.0, 2.0]]]),
    descending([[[2.0, 3.0, 2.0]] * 2] * 2),
    np.eye(2),
    common=True,
)


def late(tau) -> ContinuousModel:
    return lag_of([2.0, 1.0], [1.0, 0.7, 1.3], tau)


POLYNOMIALS = {
    "one channel": every_polynomial(),
    "arx": arx(),
    "common arx": arx(per_output=False),
    "box-jenkins": box_jenkins(),
    "loop error": full_plant(),
    "column": column().plant,
    **{name: random_model(np.random.default_rng(7), name, 3) for name in STRUCTURES},
}
MODELS = {
    **POLYNOMIALS,
    "coloured": Coloured(every_polynomial(), (np.array([1.0, 0.5, 0.2]),), (np.array([1.0, -0.7]),)),
    "continuous": two_by_two(),
    "common continuous": COMMON,
    "sampled": SampledModel(two_by_two(), 0.4),
    "common sampled": SampledModel(COMMON, 0.7),
    **{f"late {tau}": SampledModel(late(tau), STEP) for tau in (0.0, 0.1, 0.37, 0.5, 1.0, 2.24)},
    "late, continuous": late(0.37),
    "late entries": SampledModel(late_entries(), STEP),
    "late entries, continuous": late_entries(),
    "integrating": SampledModel(lag_of([0.3], [1, 0.8, 0]), STEP),
    "gain and time constant": in_words(SampledModel(process(), 0.7)),
    "gain and time constant, continuous": in_words(process()),
    "partly known": known(box_jenkins(), "c1[2]", "b2[1,1]", "a1"),
}


def slope(f, step=1e-3):
    """f'(0) from values on the right alone, by Richardson's extrapolation to fourth order."""
    here = f(0.0)
    once = [(f(step / 2**i) - here) / (step / 2**i) for i in range(4)]
    for order in range(1, 4):
        once = [(2**order * b - a) / (2**order - 1) for a, b in pairwise(once)]
    return once[0]


@pytest.mark.parametrize("name", MODELS)
def test_plant_gradients_agree_with_one_sided_differences(name):
    """Differences go towards longer dead times, the side promised at a whole number of samples."""
    model = MODELS[name]
    exact, theta = model.plant_gradient(W), model.theta
    assert exact.shape == (W.size, len(model.names), model.outputs, model.inputs)
    for k, unit in enumerate(np.eye(theta.size)):
        found = slope(lambda x, unit=unit: model.at(theta + x * unit).plant_at(W))
        np.testing.assert_allclose(exact[:, k], found, atol=1e-7 * max(1.0, np.abs(exact[:, k]).max()))
        assert model.in_plant[k] == np.any(found != 0.0)


def bode(polynomials, w):
    """G and H by plain polynomial evaluation."""
    z = np.exp(1j * w)
    A, B, C, D, F = (sum(c * z ** (-i) for i, c in enumerate(polynomials[letter])) for letter in "ABCDF")
    return B / (A * F), C / (A * D)


@pytest.mark.parametrize("name", POLYNOMIALS)
def test_noise_and_input_gradients_agree_with_the_responses(name):
    """H^-1 dG, and H^-1 dH by differences; G and H of one channel by their polynomials, name by name."""
    model, step = POLYNOMIALS[name], 1e-5
    H = model.noise_at(W)
    expected = np.linalg.solve(H[:, None], model.plant_gradient(W))
    np.testing.assert_allclose(input_gradients([model], W)[0], expected, atol=1e-12 * np.abs(expected).max())
    for k, unit in enumerate(step * np.eye(model.theta.size)):
        up, down = (model.at(model.theta + sign * unit) for sign in (1, -1))
        found = np.linalg.solve(H, up.noise_at(W) - down.noise_at(W)) / (2 * step)
        scale = max(np.abs(found).max(), 1.0)
        np.testing.assert_allclose(noise_gradients([model], W)[0, :, k], found, atol=1e-6 * scale)
        if model.outputs == model.inputs == 1:
            by_name = bode(polynomials(model, model.theta + unit), W)
            for own, plain in zip((up.plant_at(W), up.noise_at(W)), by_name, strict=True):
                np.testing.assert_allclose(own[:, 0, 0], plain, rtol=1e-9)


@pytest.mark.parametrize("structure", STRUCTURES)
@pytest.mark.parametrize("closed", [False, True])
def test_prediction_gradient_equals_the_formulas_of_the_paper(structure, closed):
    """F_u = Lambda_G / H and F_r, F_v of (15), where no pole is near the circle to spoil the division."""
    rng, w = np.random.default_rng(11), np.array([0.0, 0.01, 0.3, 1.0, 2.5, np.pi])
    model = random_model(rng, structure, 2)
    loop = random_loop(rng, model, closed=closed)
    G, H = bode(polynomials(model), w)
    C = loop.controller.at(w)[:, 0, 0] if closed else np.zeros_like(G)
    S = 1 / (1 + C * G)
    relative = noise_gradients([model], w)[0]
    dG, dH = model.plant_gradient(w)[:, :, 0, 0], relative[:, :, 0, 0] * H[:, None]
    excited = loop.excitation_gradient(w) if closed else input_gradients([model], w)[0]
    noise = (loop.noise_gradient(w) if closed else relative)[:, :, 0, 0]
    np.testing.assert_allclose(excited[:, :, 0, 0], (S / H)[:, None] * dG, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(noise, dH / H[:, None] - (C * S)[:, None] * dG, rtol=1e-8, atol=1e-8)


def test_names_carry_output_and_input():
    delayed = PolynomialModel.single([0, 0, 0, 0.1, 0.2], A=[1, -0.5], C=[1, 0.1])
    for model, first, last in (
        (arx(), ("a1[1]", "a1[2]", "b1[1,1]", "b2[1,1]"), ()),
        (arx(per_output=False), ("a1", "a2", "b1[1,1]"), ()),
        (two_by_two(), ("b0[1,1]", "b0[1,2]", "b0[2,1]", "b0[2,2]"), ("a0[2,2]", "a1[2,2]")),
        (COMMON, ("b0[1,1]", "b1[1,1]", "b0[1,2]", "b0[2,2]", "b1[2,2]", "b2[2,2]", "a0", "a1"), ()),
        (lag_of([2.0], [1.0, 3.0]), ("b0", "a0"), ()),
        (delayed, ("a1", "b3", "b4", "c1"), ()),
        (late(0.3), ("b0", "b1", "a0", "a1", "delay"), ()),
        (late_entries(), (), ("delay[1,1]", "delay[1,2]", "delay[2,2]")),
        (late_entries(common=True), (), ("delay",)),
        (column().plant, ("a1", "b1[1,1]", "b1[1,2]", "b1[2,1]", "b1[2,2]"), ()),
        (full_plant(), ("a1[1]", "a1[2]", "a2[2]", "b1[1,1]"), ()),
    ):
        assert (model.names[: len(first)], model.names[len(model.names) - len(last) :]) == (first, last)
    assert list(delayed.in_plant) == [True, True, True, False]


def test_zeros_and_poles_of_a_sampled_entry_agree_with_python_control():
    system = control.tf([3.125], [1, 1.5, 1.563]).sample(0.4)
    roots = np.concatenate([system.poles(), system.zeros()])
    points = np.abs(np.angle(roots)) + 1j * np.abs(np.log(np.abs(roots)))
    ours = SampledModel(two_by_two(), 0.4).entry_singularities(0, 0)
    np.testing.assert_allclose(np.sort_complex(ours), np.sort_complex(points), atol=1e-8)


def test_widely_separated_time_constants_survive_sampling():
    """Poles at 1e-3 and 1e3 rad/s, sampled slowly: the static gain must come out to rounding."""
    sampled = SampledModel(lag_of([1.0], [1.0, 1000.001, 1.0]), 1.0)
    assert sampled.plant_at(np.zeros(1))[0, 0, 0] == pytest.approx(1.0, rel=1e-9)


def test_scaling_numerator_and_denominator_alike_changes_no_parameter():
    scaled = ContinuousModel.monic(arrays([[[4.0, 2.0]]]), arrays([[[2.0, 6.0, 2.0]]]), np.eye(1))
    np.testing.assert_allclose(scaled.theta, [2.0, 1.0, 1.0, 3.0])
