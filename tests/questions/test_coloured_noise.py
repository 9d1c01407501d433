"""Coloured and drifting noise in the words of a spec: one system in several words, and what is refused."""

import numpy as np
import pytest

from inputdesign_cli import analyse, parse_spec, solve
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.plant import input_gradients
from inputdesign_cli.questions.building.system import build_model

REST = """
sample_time: 0.5
experiment: {samples: 300}
accuracy: {model_error: {relative: 0.1, band: [0.05, 1.5]}}
spectrum: {type: fir, order: 4}
solver: {tolerance: 1.0e-10}
signal: {seed: 1, samples: 100}
"""
PI = "experiment: {samples: 300, controller: {numerator: [0.5, -0.4], denominator: [1, -1]}}"
IN_S = "{continuous: {numerator: [2], denominator: [3, 1]}, sample: zoh}"
E = float(np.exp(-0.5 / 3.0))
IN_Q = f"{{B: [0, {2 * (1 - E)!r}], F: [1, {-E!r}]}}"
NOISES = [
    "{C: [1, 0.5], D: [1, -0.7], variance: 0.1}",
    "{C: [1, -0.4], drift: true, variance: 0.1}",
    "{D: [1, -1.7, 0.7], known: [d1, d2], variance: 0.1}",
]


def spec_of(plant, noise, rest=REST, **kwargs):
    return parse_spec(f"plant: {plant}\nnoise: {noise}\n{rest}", **kwargs)


@pytest.mark.first(2)
@pytest.mark.parametrize(("noise", "loop"), [*((noise, None) for noise in NOISES), (NOISES[1], PI)])
def test_the_same_noise_on_one_plant_in_s_and_in_q_is_one_design(noise, loop):
    rest = REST if loop is None else REST.replace("experiment: {samples: 300}", loop)
    costs = [solve(spec_of(plant, noise, rest)).result["cost"] for plant in (IN_S, IN_Q)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-9)


def test_drift_is_a_known_root_of_one():
    """In two words; d1 has the value of the root, and no row of the information."""
    noises = "{drift: true, variance: 0.1}", "{D: [1, -1], known: [d1], variance: 0.1}"
    results = [solve(spec_of(IN_S, noise)).result for noise in noises]
    assert results[0]["cost"] == pytest.approx(results[1]["cost"], rel=1e-9)
    assert results[0]["information"]["parameters"] == results[1]["information"]["parameters"] == ["b0", "a0"]


def test_a_constant_tells_nothing_where_the_noise_drifts():
    """(1 - q^-1) G u of a constant u is zero."""
    for noise, least in (("{variance: 0.1}", 1.0), ("{drift: true, variance: 0.1}", 0.0)):
        model = build_model(spec_of(IN_S, noise, design=False))
        size = np.abs(input_gradients([model], np.array([0.0]))[0]).max()
        assert (size > 0.5) == (least > 0)


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("plant", [IN_S, IN_Q])
def test_an_estimate_is_written_in_words_that_say_the_same(plant, noise):
    model = build_model(spec_of(plant, noise, design=False))
    blocks = blocks_of(model)
    again = build_model(spec_of(blocks["plant"], blocks["noise"], "sample_time: 0.5", design=False))
    w = np.array([0.1, 1.0])
    np.testing.assert_allclose(input_gradients([model], w)[0], input_gradients([again], w)[0], rtol=1e-9)
    assert model.names == again.names


def test_outputs_have_noise_of_their_own():
    plant = "{B: [[[0, 0.3], [0, 0.1]], [[0, 0.2], [0, 0.5]]], F: [[[1, -0.5], [1, -0.5]], [[1], [1, -0.8]]]}"
    noise = "{C: [[1, 0.3], [1]], D: [[1], [1, -1]], known: ['d1[2]'], drift: [true, false], variance: 0.1}"
    model = build_model(spec_of(plant, noise, design=False))
    assert [name for name in model.names if name[0] in "cd"] == ["c1[1]"]
    gradient = input_gradients([model], np.array([0.0]))[0]
    np.testing.assert_allclose(gradient, 0.0, atol=1e-12)  # both outputs are differenced
    white = spec_of(plant, noise, overrides=["spectrum={given: {type: white, power: 1}}"])
    assert "c1[1]" in analyse(white).result["information"]["standard_deviation"]
