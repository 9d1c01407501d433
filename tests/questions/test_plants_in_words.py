"""Parametrisations of one plant have one model, one error and one design; written models are read back."""

import json

import numpy as np
import pytest

from inputdesign_cli import analyse, parse_spec, simulate, solve
from inputdesign_cli.explore.structures import Process, process_models
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.plant import input_gradients, noise_gradients
from inputdesign_cli.questions.building.system import build_experiment, build_model
from tests.support.words import largest_errors

REST = """
sample_time: 0.5
noise: {variance: 0.1}
experiment: {samples: 300}
accuracy: {model_error: {relative: 0.1, band: [0.05, 1.5]}}
spectrum: {type: fir, order: 4}
solver: {tolerance: 1.0e-10}
signal: {seed: 1, samples: 60}
"""
PARAMETERS = "parameters: {K: 2.0, T: 3.0, L: 0.685}"
E = float(np.exp(-0.5 / 3.0))
# By gain, time constant and dead time, by expressions, by coefficients, by states, and behind the hold by
# hand: a lag of one sample and 0.185, and E = exp(-h/T).
WORDS = {
    "first order": [
        "{continuous: {gain: 2.0, time_constant: 3.0, dead_time: 0.685}, sample: zoh}",
        f"{{{PARAMETERS}, sample: zoh, continuous: {{numerator: [K], denominator: [T, 1], delay: L}}}}",
        "{parameters: {lnK: 0.6931471805599453, r: 0.3333333333333333, L: 6.85}, sample: zoh, "
        "continuous: {numerator: [exp(lnK)*r], denominator: [1, r], delay: L/10}}",
        "{continuous: {numerator: [2.0], denominator: [3.0, 1], delay: 0.685}, sample: zoh}",
        f'{{{PARAMETERS}, state_space: {{A: [["-1/T"]], B: [["K/T"]], C: [[1]], delay: L}}, sample: zoh}}',
        f"{{{PARAMETERS}, state_space: {{time: discrete, B: [[0], [0], [1]], C: [[1, 0, 0]], "
        'A: [["exp(-0.5/T)", "K*(exp(-(1 - L)/T) - exp(-0.5/T))", "K*(1 - exp(-(1 - L)/T))"], '
        "[0, 0, 1], [0, 0, 0]]}}",
    ],
    "second order": [
        "{continuous: {gain: 2, damping: 0.4, natural_frequency: 0.8, dead_time: 1}, sample: zoh}",
        "{continuous: {numerator: [1.28], denominator: [1, 0.64, 0.64], delay: 1}, sample: zoh}",
    ],
    "in q": [
        "{parameters: {g: 0.3, p: 0.8}, B: [0, 0, g], F: [1, -p]}",
        "{parameters: {g: 0.3, T: 4.481420117724551}, B: [0, 0, g], F: [1, -exp(-1/T)]}",
        "{B: [0, 0, 0.3], F: [1, -0.8]}",
    ],
    "in s and in q": [
        "{continuous: {numerator: [2], denominator: [3, 1]}, sample: zoh}",
        f"{{B: [0, {2 * (1 - E)!r}], F: [1, {-E!r}]}}",
    ],
}
NOISES = [
    "{C: [1, 0.5], D: [1, -0.7], variance: 0.1}",
    "{C: [1, -0.4], drift: true, variance: 0.1}",
    "{D: [1, -1.7, 0.7], known: [d1, d2], variance: 0.1}",
]


PI = "experiment: {samples: 300, controller: {numerator: [0.5, -0.4], denominator: [1, -1]}}"


def spec_of(plant, rest=REST, noise="{variance: 0.1}", **kwargs):
    return parse_spec(f"plant: {plant}\n{rest.replace('{variance: 0.1}', noise)}", **kwargs)


@pytest.mark.parametrize("noise", ["{variance: 0.1}", *NOISES])
@pytest.mark.parametrize("words", WORDS.values(), ids=WORDS)
def test_the_error_of_one_spectrum_is_the_same_in_all_parametrisations(words, noise):
    """The spectrum is given, so no solver is involved."""
    found = [largest_errors(build_experiment(spec_of(plant, noise=noise))) for plant in words]
    np.testing.assert_allclose(found, np.broadcast_to(found[0], np.shape(found)), rtol=1e-9)


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("name", "noise", "loop"),
    [("in s and in q", NOISES[1], PI), *((name, "{variance: 0.1}", None) for name in WORDS)],
)
def test_all_parametrisations_of_a_plant_have_the_same_design(name, noise, loop):
    rest = REST if loop is None else REST.replace("experiment: {samples: 300}", loop)
    found = [solve(spec_of(plant, rest, noise)) for plant in WORDS[name]]
    costs = [one.result["cost"] for one in found]
    np.testing.assert_allclose(costs, costs[0], rtol=1e-9)
    for other in found[1:]:
        np.testing.assert_allclose(other.bound["r_u"], found[0].bound["r_u"], rtol=1e-6)


def test_a_kalman_gain_has_the_information_of_an_armax_model():
    """x+ = a x + b u + k e is ARMAX: A = 1 - a q^-1, C = 1 + (k - a) q^-1."""
    states = (
        "{parameters: {a: 0.8, b: 0.5, k: 0.3}, "
        "state_space: {time: discrete, A: [[a]], B: [[b]], C: [[1]], K: [[k]]}}"
    )
    found = build_experiment(spec_of(states))
    other = build_experiment(spec_of("{A: [1, -0.8], B: [0, 0.5]}", noise="{C: [1, -0.5], variance: 0.1}"))
    J = np.array([[-1.0, 0, 0], [0, 1, 0], [-1, 0, 1]])  # a1, b1, c1 in a, b, k
    w = np.array([0.0, 0.4, 2.0])
    gradient = np.einsum("nkpr,kl->nlpr", other.excitation_gradient(w), J)
    np.testing.assert_allclose(found.excitation_gradient(w), gradient, rtol=1e-10)
    expected = J.T @ other.noise_information @ J
    np.testing.assert_allclose(found.noise_information, expected, rtol=1e-9, atol=1e-9)


def check_written_blocks(model):
    """Asserts that the written blocks give the same names, values and responses; returns the plant."""
    blocks = blocks_of(model)
    text = "\n".join(f"{key}: {json.dumps(block)}" for key, block in blocks.items())
    again = build_model(parse_spec(f"{text}\nsample_time: 0.5", design=False))
    assert again.names == model.names
    np.testing.assert_allclose(again.theta, model.theta, rtol=1e-12)
    w = np.array([0.1, 1.0])
    np.testing.assert_allclose(again.plant_at(w), model.plant_at(w), rtol=1e-10)
    np.testing.assert_allclose(input_gradients([again], w)[0], input_gradients([model], w)[0], rtol=1e-9)
    np.testing.assert_allclose(
        noise_gradients([again], w)[0], noise_gradients([model], w)[0], rtol=1e-9, atol=1e-12
    )
    return blocks["plant"]


OTHERS = [
    "{B: [0, 1, 0.5], F: [1, -0.5], known: [f1]}",
    "{continuous: {gain: [[1, 0], [2, 3]], time_constant: [[1, 1], [2, 3]], "
    'dead_time: [[1, 0], [0, 3]]}, sample: zoh, known: ["gain[2,1]"]}',
    "{continuous: {numerator: [[[1]], [[2]]], denominator: [2, 1], delay: 0.7}, sample: zoh}",
]


@pytest.mark.parametrize("noise", ["{variance: 0.1}", *NOISES])
@pytest.mark.parametrize("plant", [*(one for words in WORDS.values() for one in words), *OTHERS])
def test_the_written_blocks_of_a_model_are_read_back_as_the_same_model(plant, noise):
    """`identify` writes the model that it has found in these blocks."""
    spec = parse_spec(f"plant: {plant}\nnoise: {noise}\nsample_time: 0.5\n", design=False)
    model = build_model(spec)
    written = check_written_blocks(model.at(1.01 * model.theta))
    assert ("parameters" in plant) == ("parameters" in written)


@pytest.mark.parametrize("outputs", [1, 2])
@pytest.mark.parametrize("noise", [0, 2])
@pytest.mark.parametrize(("order", "zero"), [(1, False), (2, False), (2, True)])
def test_the_written_blocks_of_an_explored_process_are_read_back(order, zero, noise, outputs):
    rng = np.random.default_rng(order)
    rows, thetas = [], []
    for _ in range(outputs):
        rows.append(Process((1,) * outputs, order, 0.5, zero, noise))
        plant = rng.uniform(0.6, 1.4, rows[-1].size - 2 * noise)
        thetas.append(np.concatenate([plant, rng.uniform(-0.3, 0.3, 2 * noise)]))
    check_written_blocks(process_models(rows, thetas, np.diag(rng.uniform(0.5, 1.0, outputs))))


@pytest.mark.slow
def test_simulated_experiments_estimate_the_named_parameters():
    rest = REST.replace("samples: 60", "samples: 300") + "simulation: {runs: 40, seed: 2}\n"
    for plant in (WORDS["first order"][0], WORDS["first order"][4]):
        found = simulate(spec_of(plant, rest)).result["simulation"]["inputs"]["design"]
        assert set(found["mean_estimate"]) == set(build_model(spec_of(plant)).names)
        assert found["within_r_u"] > 0.8
        assert 0.2 < min(found["covariance_eigenvalues"]) < max(found["covariance_eigenvalues"]) < 4.0


@pytest.mark.parametrize("given", [True, False])
def test_an_output_that_no_input_reaches_has_no_power(given):
    """The inputs drive one mode, x2 = 2 x1, and output 2 reads 2 x1 - x2: zero but for rounding."""
    states = (
        "{parameters: {g: 1.3, s: 1.1}, sample: zoh, "
        "state_space: {A: [['-0.7*s', '0.1*s'], ['0.2*s', '-0.6*s']], "
        "B: [['0.1*g'], ['0.2*g']], C: [[1, 0.2], [0.2, -0.1]]}}"
    )
    asked = "{model_error: {relative: 0.1, band: [0.05, 1.5]}}"
    rest = REST.replace(asked, "{standard_deviation: {s: 0.05}}")
    spec = spec_of(states, rest, overrides=["spectrum={given: {type: white, power: 1}}"] if given else [])
    result = (analyse if given else solve)(spec).result
    pole = np.exp(-0.5 * 0.5 * 1.1)  # the mode x' = -0.5 s x + 0.1 g u
    size = 1.4 * 0.1 * 1.3 / (0.5 * 1.1) * (1 - pole)
    assert result["power"]["output"][1] == 0.0
    if given:
        assert result["power"]["output"][0] == pytest.approx(size**2 / (1 - pole**2), rel=1e-10)
