"""Expressions that are zero at the nominal parameters are treated as any other coefficient."""

import numpy as np
import pytest

from inputdesign_cli import analyse, parse_spec, solve
from inputdesign_cli.questions.building.system import build_experiment, build_model
from tests.support.refusals import code_of

REST = (
    "noise: {variance: 0.04}\nexperiment: {samples: 300}\naccuracy: {criterion: D}\n"
    "spectrum: {given: {type: white, power: 1}}\n"
)
# Each has a coefficient, an entry or a dead time that is zero where K = 2.
PLANTS = {
    "first of B": "parameters: {K: %s, f: -0.8}, B: [0, K-2, K], F: [1, f]",
    "last of B": "parameters: {K: %s, f: -0.8}, B: [0, K, K-2], F: [1, f]",
    "last of F": "parameters: {K: %s, f: -0.8}, B: [0, K], F: [1, f, K-2]",
    "of A": "parameters: {K: %s, f: -0.8}, B: [0, K], A: [1, f, K-2]",
    "entry of B": "parameters: {K: %s, f: -0.8}, B: [[[0, K], [0, K-2]]], F: [[[1, f], [1, f]]]",
    "first of a numerator": "parameters: {K: %s, T: 5}, sample: zoh, "
    "continuous: {numerator: [K-2, K], denominator: [T, 1]}",
    "of a strictly proper numerator": "parameters: {K: %s, T: 5}, sample: zoh, "
    "continuous: {numerator: [K-2, K], denominator: [T, 2, 1]}",
    "in factors": "parameters: {K: %s, T: 5}, sample: zoh, "
    "continuous: {numerator: [K-2, K], denominator: [[T, 1], [2, 1]]}",
    "entry of a numerator": "parameters: {K: %s, T: 5}, sample: zoh, "
    "continuous: {numerator: [[[K], [K-2]]], denominator: [T, 1]}",
    "gain": "parameters: {K: %s, T: 5}, sample: zoh, continuous: {gain: [[K, K-2]], time_constant: [[T, T]]}",
    "gain of second order": "parameters: {K: %s, w: 0.5}, sample: zoh, "
    "continuous: {gain: [[K, K-2]], damping: [[0.5, 1]], natural_frequency: [[w, w]]}",
    "dead time": "parameters: {K: %s, T: 5}, sample: zoh, "
    "continuous: {gain: [[K, 1]], time_constant: [[T, T]], dead_time: [[K-1.5, K-2]]}",
    "delay": "parameters: {K: %s, T: 5}, sample: zoh, "
    "continuous: {numerator: [[[1], [1]]], denominator: [T, 1], delay: [[K-1.5, K-2]]}",
    "common delay": "parameters: {K: %s, T: 5}, sample: zoh, "
    "continuous: {numerator: [1], denominator: [T, 1], delay: K-2}",
    "B of states": "parameters: {K: %s, f: 0.8}, "
    "state_space: {A: [[f]], B: [[K, K-2]], C: [[1]], time: discrete}",
    "D of states": "parameters: {K: %s, f: 0.8}, "
    "state_space: {A: [[f]], B: [[K]], C: [[1]], D: [[K-2]], time: discrete}",
    "delay of states": "parameters: {K: %s, T: 5}, sample: zoh, "
    "state_space: {A: [[-1/T]], B: [[1]], C: [[1]], delay: K-2}",
}


def spec_at(name, value, rest=REST):
    return parse_spec("plant: {" + PLANTS[name] % repr(value) + "}\n" + rest)


@pytest.mark.parametrize("name", PLANTS)
def test_the_gradient_is_that_of_plants_nearby(name):
    """The reference is a difference quotient of the responses of specs with other parameters."""
    w, h = np.linspace(0.05, 3.1, 40), 1e-5
    model = build_model(spec_at(name, 2.0))
    at, once, twice = (build_model(spec_at(name, 2.0 + k * h)).plant_at(w) for k in range(3))
    slope = (4.0 * once - 3.0 * at - twice) / (2.0 * h)
    gradient = model.plant_gradient(w)[:, model.names.index("K")]
    np.testing.assert_allclose(gradient, slope, atol=1e-6 * np.abs(slope).max())


@pytest.mark.first(2)
@pytest.mark.parametrize("name", ["first of B", "of A", "first of a numerator", "gain", "common delay"])
def test_the_information_is_the_limit_of_that_of_plants_nearby(name):
    at, near = (analyse(spec_at(name, value)).result["information"] for value in (2.0, 2.0 + 1e-7))
    assert at["parameters"] == near["parameters"]
    size = np.sqrt(np.diag(near["matrix"]))
    np.testing.assert_allclose(
        at["matrix"] / np.outer(size, size), near["matrix"] / np.outer(size, size), atol=1e-5
    )


DESIGN = "noise: {variance: 0.04}\nexperiment: {samples: 300}\nspectrum: {type: fir, order: 4}\n"


@pytest.mark.first(1)
@pytest.mark.parametrize("name", ["entry of B", "gain", "B of states"])
def test_an_entry_that_vanishes_must_be_as_accurate_as_the_others(name):
    rest = DESIGN + "accuracy: {model_error: {absolute: 0.1}}\n"
    at, near = (solve(spec_at(name, value, rest)).result for value in (2.0, 2.0 + 1e-6))
    assert at["cost"] == pytest.approx(near["cost"], rel=1e-4)
    assert (
        code_of(solve, spec_at(name, 2.0, DESIGN + "accuracy: {model_error: {relative: 0.1}}\n"))
        == "admissible-not-positive"
    )


@pytest.mark.parametrize("name", ["first of a numerator", "D of states"])
def test_a_vanishing_direct_term_makes_a_loop_algebraic(name):
    loop = REST.replace("{samples: 300}", "{samples: 300, controller: {numerator: [0.1], denominator: [1]}}")
    for value in (2.0, 2.0 + 1e-6):
        assert code_of(build_experiment, spec_at(name, value, loop)) == "algebraic-loop"
