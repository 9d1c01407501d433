"""The closed-loop error: equal designs for all parametrisations, and controllers from simulated estimates."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec, simulate, solve
from tests.support.refusals import refusal

REST = """
noise: {variance: 0.04}
experiment: {samples: 500}
accuracy:
  closed_loop_error:
    control: {model_reference: {numerator: [0, 0, 0, 0, 0.2], denominator: [1, -0.8]}}
    reference: {variance: 1}
limits: {input_power: 1}
spectrum: {type: pointwise}
signal: {samples: 100, candidates: 1}
"""
PARAMETERS = "parameters: {K: 2.0, T: 5.0, L: 2.3}"
IN_S = "continuous: {numerator: [K], denominator: [T, 1], delay: L}, sample: zoh"
WORDS = [
    f"{{{PARAMETERS}, {IN_S}}}",
    "{continuous: {gain: 2, time_constant: 5, dead_time: 2.3}, sample: zoh}",
    "{continuous: {numerator: [2], denominator: [5, 1], delay: 2.3}, sample: zoh}",
    f'{{{PARAMETERS}, state_space: {{A: [["-1/T"]], B: [["K/T"]], C: [[1]], delay: L}}, sample: zoh}}',
    f"{{{PARAMETERS}, B: [0, 0, 0, K*(1 - exp(-(3 - L)/T)), K*(exp(-(3 - L)/T) - exp(-1/T))], "
    "F: [1, -exp(-1/T)]}",
]
EXACT = "accuracy.closed_loop_error.covariance=parametric"


def losses(plant, *overrides, rest=REST):
    """The value of the design, and that of white input with the parametric covariance."""
    found = solve(parse_spec(f"plant: {plant}\n{rest}", overrides=overrides)).result
    return found["objective"]["value"], found["closed_loop_error"]["parametric"]["white"]["value"]


def assert_same(found, within=1e-9):
    """Asserts equal values, for designs within the solver's tolerance and for white input within `within`."""
    designs, white = np.array(found).T
    np.testing.assert_allclose(designs, designs[0], rtol=1e-7)
    np.testing.assert_allclose(white, white[0], rtol=within)


def sampled(K, T, L, w):
    """K exp(-L s) / (T s + 1) behind a hold with sample time one, 2 < L < 3, by its step response."""
    q, E = np.exp(-1j * w), np.exp(-1 / T)
    late = np.exp(-(3 - L) / T)
    return K * q**3 * (1 - late + (late - E) * q) / (1 - E * q)


@pytest.mark.parametrize("exact", [[], [EXACT]], ids=["asymptotic", "parametric"])
def test_five_parametrisations_of_one_plant_have_the_same_design(exact):
    assert_same([losses(plant, *exact) for plant in (WORDS[::2] if exact else WORDS)])


@pytest.mark.parametrize(
    ("known", "free"), [("", [0, 1, 2]), (", known: [L]", [0, 1]), (", known: [K, T]", [2])]
)
def test_known_parameters_add_nothing_to_the_parametric_error(known, free):
    """Reference: tr(W P) from finite differences of G and means over 4096 points of the unit circle."""
    w = 2 * np.pi * (np.arange(4096) + 0.5) / 4096
    nominal, step = np.array([2.0, 5.0, 2.3]), 1e-5
    slopes = [
        (sampled(*nominal + step * axis, w) - sampled(*nominal - step * axis, w)) / (2 * step)
        for axis in np.eye(3)[free]
    ]
    q = np.exp(-1j * w)
    T = 0.2 * q**4 / (1 - 0.8 * q)
    X = [(1 - T) * slope / sampled(*nominal, w) * T for slope in slopes]
    M, W = (np.array([[np.mean(a * np.conj(b)).real for a in rows] for b in rows]) for rows in (slopes, X))
    expected = np.trace(np.linalg.solve(M / 0.04, (1 + 0.04) * W))
    assert losses(f"{{{PARAMETERS}{known}, {IN_S}}}")[1] == pytest.approx(expected, rel=1e-8)


def test_the_asymptotic_design_does_not_depend_on_known_parameters():
    """The asymptotic covariance is that of a model of high order."""
    free, known = (losses(f"{{{PARAMETERS}{words}, {IN_S}}}") for words in ("", ", known: [L]"))
    assert known[0] == pytest.approx(free[0], rel=1e-12)
    assert known[1] < 0.6 * free[1]


@pytest.mark.parametrize(
    "law", ["{minimum_variance: true}", "{internal_model: {numerator: [0.5], denominator: [1, -0.5]}}"]
)
def test_a_kalman_gain_has_the_design_of_an_armax_model(law):
    """x+ = a x + b u + k e is ARMAX with C = 1 + (k - a) q^-1 and as many coefficients."""
    rest = REST.replace("{model_reference: {numerator: [0, 0, 0, 0, 0.2], denominator: [1, -0.8]}}", law)
    states = (
        "{parameters: {a: 0.8, b: 0.5, k: 0.3}, "
        "state_space: {time: discrete, A: [[a]], B: [[b]], C: [[1]], K: [[k]]}}"
    )
    armax = rest.replace("{variance: 0.04}", "{C: [1, -0.5], variance: 0.04}")
    assert_same([losses(states, EXACT, rest=rest), losses("{A: [1, -0.8], B: [0, 0.5]}", EXACT, rest=armax)])


ZEROS = """
plant: {A: [1, -0.8], B: [0, 1, -1.5]}
noise: {variance: 0.01}
experiment: {samples: 1000}
accuracy: {closed_loop_error: {control: {internal_model: {numerator: [0.4], denominator: [1, -0.6]}}}}
limits: {input_power: 1}
signal: {candidates: 1}
simulation: {runs: 100, seed: 1, compare: [white]}
"""


def simulated(*overrides):
    return simulate(parse_spec(ZEROS, overrides=list(overrides))).result


@pytest.mark.parametrize("true", ["{A: [1, -0.8], B: [0, 1, -1.5]}", "{A: [1, -0.7], B: [0, 1, -2.5]}"])
def test_simulated_non_minimum_phase_plants_are_stable_and_agree_with_theory(true):
    """The second plant differs from the spec; both controllers keep its own zero."""
    found = simulated(f"simulation.plant={true}")
    for entry in found["simulation"]["inputs"].values():
        assert entry["unstable"] == 0
        exact = entry["exact"]["squared"]
        assert exact["mean"] == pytest.approx(entry["theory"]["value"], abs=4 * exact["standard_error"])
    assert "notes" not in found


def test_unstable_simulated_loops_are_counted_and_reported():
    found = simulated("noise.variance=10", "experiment.samples=60")
    inputs = found["simulation"]["inputs"]
    counts = [entry["unstable"] for entry in inputs.values()]
    assert min(counts) > 0
    said = {one["where"]: one["figures"] for one in found["findings"] if one["code"] == "unstable-runs"}
    assert said == {name: {"unstable": entry["unstable"], "runs": 100} for name, entry in inputs.items()}


LAW = "accuracy.closed_loop_error.control={model_reference: {numerator: [0, 0.4], denominator: [1, -0.6]}}"
UNSTABLE = (LAW, "plant.B=[0, 1]", "simulation.plant={A: [1, -0.8], B: [0, 1, -1.5]}")
NAMED = ("plant={parameters: {b: 0.5}, A: [1, -0.8], B: [0, b, -0.75]}",)


@pytest.mark.parametrize(
    ("overrides", "code", "key"),
    [(UNSTABLE, "non-minimum-phase", "simulation.plant"), (NAMED, "not-supported", "plant")],
)
def test_plants_that_cannot_be_simulated_are_refused(overrides, code, key):
    found = refusal(lambda: simulated(*overrides))
    assert (found.code, found.key) == (code, key)


def test_simulated_records_are_as_long_as_the_signal():
    """The design without a length is per sample; the signal has 1000 samples."""
    long, found = simulated(), simulated("experiment=null", "signal.samples=1000")
    assert (found["samples"], found["simulation"]["samples"]) == (1, 1000)
    for name, entry in found["simulation"]["inputs"].items():
        assert entry["loss"] == long["simulation"]["inputs"][name]["loss"]


MATRIX = """
noise: {variance: [[0.04, 0.01], [0.01, 0.09]]}
experiment: {samples: 500}
accuracy: {closed_loop_error: {control: {internal_model: {numerator: [0, 0.3], denominator: [1, -0.7]}},
  reference: {variance: [1, 2]}}}
limits: {input_power: [1, 0.5]}
spectrum: {type: pointwise}
signal: {samples: 100, candidates: 1}
"""


@pytest.mark.parametrize("exact", [[], pytest.param([EXACT], marks=pytest.mark.slow)])
def test_states_and_transfer_functions_of_two_channels_have_the_same_design(exact):
    """The entries in s are the transfer functions of the states."""
    parameters = "parameters: {k: 1.5, T: 4.0, c: 0.4}"
    words = [
        f"{{{parameters}, sample: zoh, state_space: {{A: [['-1/T', 0], [0, -0.5]], B: [[k/T, 0], [0, 1]], "
        "C: [[1, c], [0.3, 1]]}}",
        f"{{{parameters}, sample: zoh, continuous: {{numerator: [[[k], [c]], [[0.3*k], [1]]], "
        "denominator: [[[T, 1], [1, 0.5]], [[T, 1], [1, 0.5]]]}}",
    ]
    # The powers of lines come from the solver and agree within its tolerance only.
    assert_same([losses(plant, *exact, rest=MATRIX) for plant in words], 1e-7 if exact else 1e-9)
