"""State-space plants in the words of a spec: one plant in three words, and what is refused."""

import numpy as np
import pytest

from inputdesign_cli import analyse, parse_spec, simulate, solve
from inputdesign_cli.outcome.model_words import blocks_of
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
WORDS = [
    f'{{{PARAMETERS}, state_space: {{A: [["-1/T"]], B: [["K/T"]], C: [[1]], delay: L}}, sample: zoh}}',
    f"{{{PARAMETERS}, continuous: {{numerator: [K], denominator: [T, 1], delay: L}}, sample: zoh}}",
    # behind the hold, by hand: a lag of one sample and 0.185, and E = exp(-h/T)
    f"{{{PARAMETERS}, state_space: {{time: discrete, B: [[0], [0], [1]], C: [[1, 0, 0]], "
    'A: [["exp(-0.5/T)", "K*(exp(-(1 - L)/T) - exp(-0.5/T))", "K*(1 - exp(-(1 - L)/T))"], '
    "[0, 0, 1], [0, 0, 0]]}}",
]


def spec_of(plant, rest=REST, **kwargs):
    return parse_spec(f"plant: {plant}\n{rest}", **kwargs)


@pytest.mark.slow
def test_one_plant_in_three_words_is_one_design():
    results = [solve(spec_of(plant)) for plant in WORDS]
    costs = [found.result["cost"] for found in results]
    np.testing.assert_allclose(costs, costs[0], rtol=1e-9)
    r_u = [np.array(found.tables["bound"].columns["r_u"]) for found in results]
    for other in r_u[1:]:
        np.testing.assert_allclose(other, r_u[0], rtol=1e-6)


def test_the_error_of_one_spectrum_is_the_same_in_all_words():
    """Without a solver in between."""
    found = [largest_errors(build_experiment(spec_of(plant))) for plant in WORDS]
    np.testing.assert_allclose(found, np.broadcast_to(found[0], np.shape(found)), rtol=1e-9)


def test_a_gain_is_coloured_noise():
    """x+ = a x + b u + k e is ARMAX: A = 1 - a q^-1, C = 1 + (k - a) q^-1."""
    states = (
        "{parameters: {a: 0.8, b: 0.5, k: 0.3}, "
        "state_space: {time: discrete, A: [[a]], B: [[b]], C: [[1]], K: [[k]]}}"
    )
    found = build_experiment(spec_of(states, REST))
    armax = REST.replace("{variance: 0.1}", "{C: [1, -0.5], variance: 0.1}")
    other = build_experiment(spec_of("{A: [1, -0.8], B: [0, 0.5]}", armax))
    J = np.array([[-1.0, 0, 0], [0, 1, 0], [-1, 0, 1]])  # a1, b1, c1 in a, b, k
    w = np.array([0.0, 0.4, 2.0])
    gradient = np.einsum("nkpr,kl->nlpr", other.excitation_gradient(w), J)
    np.testing.assert_allclose(found.excitation_gradient(w), gradient, rtol=1e-10)
    expected = J.T @ other.noise_information @ J
    np.testing.assert_allclose(found.noise_information, expected, rtol=1e-9, atol=1e-9)


def test_an_estimate_is_written_in_the_words_of_the_spec():
    model = build_model(spec_of(WORDS[0], design=False))
    moved = model.at([1.5, 4.0, 0.3])
    plant = blocks_of(moved)["plant"]
    assert plant["parameters"] == {"K": 1.5, "T": 4.0, "L": 0.3}
    again = build_model(spec_of(plant, "sample_time: 0.5\nnoise: {variance: 0.1}", design=False))
    np.testing.assert_allclose(again.theta, moved.theta)


@pytest.mark.slow
def test_a_study():
    rest = REST.replace("samples: 60", "samples: 300") + "simulation: {runs: 40, seed: 2}\n"
    found = simulate(spec_of(WORDS[0], rest)).result["simulation"]["inputs"]["design"]
    assert found["within_r_u"] > 0.8


def test_an_unstable_plant_under_a_controller():
    states = "{time: discrete, A: [[a]], B: [[b]], C: [[1]], K: [[0.9]]}"
    plant = f"{{parameters: {{a: 1.1, b: 0.5}}, state_space: {states}}}"
    rest = REST.replace("{samples: 300}", "{samples: 300, controller: {numerator: [0.8]}}")
    assert solve(spec_of(plant, rest)).result["status"] == "optimal"


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
