"""Plants that integrate: bounds on the error at the pole are refused, and other designs hold."""

import re

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve, validate
from inputdesign_cli.errors import Diagnostic
from inputdesign_cli.plant import input_gradients
from inputdesign_cli.questions.building.system import build_model
from tests.support.refusals import refusal

INTEGRATOR = """
plant: {A: [1, -1], B: [0, 0.2]}
noise: {C: [1, 0.3], variance: 0.1}
experiment: {samples: 1000, controller: {numerator: [1.0], denominator: [1, -0.2]}}
cost: {input_power: 1, output_power: 1}
spectrum: {type: fir, order: 8}
signal: {seed: 1, samples: 200}
"""
TWO = """
plant: {A: [[1, -1], [1, -0.6]], B: [[[0, 0.2], [0, 0.1]], [[0, 0.1], [0, 0.5]]]}
noise: {variance: [[0.1, 0], [0, 0.1]]}
experiment:
  samples: 1000
  controller: {numerator: [[[1.0], [0]], [[0], [0.3]]], denominator: [1, -0.2]}
cost: {input_power: 1, output_power: 1}
spectrum: {type: fir, order: 2}
signal: {seed: 1, samples: 200}
"""
ACCURACY = [
    "{model_error: {relative: 0.1, alpha: 2}}",
    "{model_error: {absolute: 0.1, alpha: 2}}",
    "{model_error: {sensitivity: {max_db: 12}}}",
    "{weighted_variance: {max: 0.01}}",
    "{weighted_variance: {max: 0.01, relative: true}}",
]


def refused(text: str, *overrides: str) -> Diagnostic:
    """The only diagnostic of a spec that cannot be solved."""
    return refusal(lambda: solve(parse_spec(text, overrides=list(overrides))))


@pytest.mark.parametrize("accuracy", ACCURACY)
@pytest.mark.parametrize("plant", [INTEGRATOR, TWO], ids=["one", "two"])
def test_a_bound_on_the_error_at_an_estimated_pole_is_refused_with_a_band(plant, accuracy):
    found = refused(f"{plant}accuracy: {accuracy}\n")
    assert found.code == "unbounded-error"
    assert "at 0 rad/s" in found.message
    key, band = re.search(r"accuracy\.(\w+)\.band: (\[.*\])", found.hint).groups()
    assert band == "[0.03142, 3.141]"
    parse_spec(f"{plant}accuracy: {accuracy}\n", overrides=[f"accuracy.{key}.band={band}"])


@pytest.mark.parametrize("bound", ["relative: 0.1", "absolute: 0.1"])
def test_a_design_for_the_proposed_band_just_meets_its_bound(bound):
    """r_u by central differences of G and the printed covariance, on a fine grid of the band."""
    accuracy = f"{{model_error: {{{bound}, alpha: 2, band: [0.03142, 3.1415]}}}}"
    result = solve(parse_spec(f"{INTEGRATOR}accuracy: {accuracy}\n")).result
    assert result["status"] == "optimal"
    w = np.concatenate([np.geomspace(0.03142, 3.1415, 3000), np.linspace(0.03142, 3.1415, 3000)])
    q = np.exp(-1j * w)

    def plant(a, b):
        return b * q / (1 + a * q)

    step = 1e-6
    names = result["information"]["parameters"]
    T = np.zeros((w.size, 2, len(names)))
    for column, name in enumerate(names):
        da, db = step * (name == "a1"), step * (name == "b1")
        slope = (plant(-1 + da, 0.2 + db) - plant(-1 - da, 0.2 - db)) / (2 * step)
        T[:, :, column] = np.stack([slope.real, slope.imag], axis=1)
    P = np.array(result["information"]["covariance"])
    r_u = 2 * np.sqrt(np.linalg.eigvalsh(T @ P @ T.swapaxes(1, 2))[:, -1])
    r_adm = 0.1 * np.abs(plant(-1, 0.2)) if "relative" in bound else 0.1
    assert np.max(r_u / r_adm) == pytest.approx(1.0, abs=1e-4)


def test_a_criterion_for_an_integrator_needs_no_band():
    result = solve(parse_spec(f"{INTEGRATOR}accuracy: {{criterion: D}}\nlimits: {{excitation_power: 1}}\n"))
    assert result.result["status"] == "optimal"
    assert np.all(np.isfinite(result.tables["bound"].columns["r_u"]))


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["at zero", "at the Nyquist frequency"])
def test_a_weight_with_a_zero_at_the_pole_keeps_the_error_bounded(sign):
    """W G' / G is -q and W / b in closed form, taken with the printed covariance over the whole band."""
    spec = f"""
plant: {{A: [1, {-sign}], B: [0, 0.5]}}
noise: {{variance: 0.1}}
experiment: {{samples: 1000, controller: {{numerator: [{sign}]}}}}
cost: {{input_power: 1}}
accuracy:
  model_error: {{relative: 0.1, alpha: 2, weight: {{numerator: [1, {-sign}], denominator: [1]}}}}
spectrum: {{type: fir, order: 6}}
signal: {{seed: 1, samples: 200}}
"""
    result = solve(parse_spec(spec)).result
    assert result["status"] == "optimal"
    w = np.linspace(0.0, np.pi, 4001)
    q = np.exp(-1j * w)
    rows = np.stack([-q, (1.0 - sign * q) / 0.5], axis=1)
    both = np.stack([rows.real, rows.imag], axis=1)
    names = result["information"]["parameters"]
    assert [name[0] for name in names] == ["a", "b"]
    covariance = np.array(result["information"]["covariance"])
    sizes = np.linalg.eigvalsh(both @ covariance @ both.transpose(0, 2, 1)).max(axis=1)
    assert 2.0 * np.sqrt(sizes.max()) / 0.1 == pytest.approx(1.0, abs=1e-5)


TANK = """
sample_time: 2
noise: {variance: 0.04}
experiment: {samples: 600}
accuracy: {model_error: {relative: 0.1, band: [0.02, 1.5]}}
spectrum: {type: multisine, lines: 60}
signal: {seed: 1, samples: 240}
solver: {tolerance: 1.0e-10}
"""
IN_WORDS = [
    "{parameters: {k: 0.05, T: 10}, sample: zoh, "
    "continuous: {numerator: [k], denominator: [[1, 0], [T, 1]]}}",
    "{continuous: {numerator: [0.005], denominator: [1, 0.1, 0]}, sample: zoh, known: [a0]}",
    # the plant behind the hold, with E = exp(-2/T): poles 1 and E, numerator from the step response
    "{parameters: {k: 0.05, E: 0.8187307530779818}, F: [1, -1 - E, E], "
    "B: [0, k*(2 + 2/log(E)*(1 - E)), -k*(2*E + 2/log(E)*(1 - E))]}",
]


PI = "experiment: {samples: 600, controller: {numerator: [0.5, -0.48], denominator: [1, -1]}}"


@pytest.mark.first(1)
@pytest.mark.parametrize("loop", [None, PI], ids=["open loop", "PI"])
def test_three_parametrisations_of_one_tank_have_the_same_cost(loop):
    rest = TANK if loop is None else TANK.replace("experiment: {samples: 600}", loop)
    costs = [solve(parse_spec(f"plant: {plant}{rest}")).result["cost"] for plant in IN_WORDS]
    np.testing.assert_allclose(costs, costs[0], rtol=1e-9)


@pytest.mark.parametrize(
    "change",
    [
        "spectrum={type: fir, order: 4}",
        "spectrum={type: white}",
        "spectrum={type: multisine, frequencies: [0, 0.1, 0.4]}",
    ],
)
def test_power_at_the_pole_is_refused_in_open_loop(change):
    found = refused(f"plant: {IN_WORDS[0]}{TANK}", change)
    assert (found.code, found.key) == ("infinite-information", "spectrum")
    assert "about k" in found.message


WEAK = """
noise: {variance: 0.04}
experiment: {samples: 300}
accuracy: {model_error: {relative: 0.2, band: [0.01, 1]}}
spectrum: {type: fir, order: 2}
solver: {any_spectrum: false}
signal: {samples: 100, seed: 1, candidates: 1}
"""
HIDDEN = [
    "{parameters: {k: 0.1, a: 0.2}, sample: zoh, state_space: {A: [[-a, 0], [0, 0]], "
    "B: [[k], [k*%s]], C: [[1, 1]]}}",
    "{parameters: {k: 1, T: 5}, sample: zoh, continuous: {numerator: [k*(1 + %s*T), k*%s], "
    "denominator: [[T, 1], [1, 0]]}}",
    "{parameters: {k: 0.1, f: -0.8}, B: [0, k*(1 + %s), -k*(1 - f*%s)], F: [1, f - 1, -f]}",
]


@pytest.mark.parametrize("plant", HIDDEN, ids=["states", "in s", "in q^-1"])
@pytest.mark.parametrize("share", ["1", "1e-3", "1e-5", "1e-8"])
def test_an_integrator_of_any_strength_has_infinite_information_in_open_loop(plant, share):
    """The derivative with respect to k has the residue k * share at frequency zero."""
    found = refused(f"plant: {plant.replace('%s', share)}{WEAK}")
    assert found.code == "infinite-information"
    assert "about k" in found.message


def test_an_integrator_that_no_input_reaches_does_not_change_the_cost():
    plain = "{parameters: {k: 0.1, a: 0.2}, sample: zoh, state_space: {A: [[-a]], B: [[k]], C: [[1]]}}"
    costs = [solve(parse_spec(f"plant: {p}{WEAK}")).result["cost"] for p in (HIDDEN[0] % "0", plain)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-6)


def test_a_free_integrating_pole_of_the_noise_is_refused_with_remedies_that_work():
    """A known root of D on the unit circle is the integrator of drift: true."""
    text = """
plant: {B: [0, 1], F: [1, -0.7]}
noise: {variance: 1, D: [1, -0.99999999]}
accuracy: {model_error: {relative: 0.1}}
experiment: {samples: 500}
"""
    found = refused(text)
    assert (found.code, found.key) == ("infinite-information", "noise")
    assert "fed back" not in found.message
    assert "noise.known: [d1]" in found.hint
    assert "drift: true" in found.hint
    known = solve(parse_spec(text, overrides=["noise.known=[d1]"])).result
    drifting = solve(parse_spec(text, overrides=["noise={variance: 1, drift: true}"])).result
    assert known["cost"] == pytest.approx(drifting["cost"], rel=1e-5)


def test_lines_for_an_integrator_in_continuous_time_have_the_closed_form_cost():
    """The lines are off frequency zero; the record meets the accuracy by the information of its samples."""
    text = """
sample_time: 0.5
plant: {parameters: {k: 0.05}, continuous: {numerator: [k], denominator: [1, 0]}}
noise: {variance: 0.04}
experiment: {samples: 600}
accuracy: {standard_deviation: {k: 0.001}}
limits: {band: [0, 2]}
spectrum: {type: multisine, frequencies: [0.0837758, 0.335103]}
signal: {type: multisine, samples: 600, seed: 1}
"""
    found = solve(parse_spec(text)).result
    # N / sigma^2 sum |1 / jw|^2 p: the lower line informs more
    assert found["cost"] == pytest.approx(0.04 / 600 / 0.001**2 * 0.0837758**2, rel=1e-6)
    assert found["signal"]["worst_ratio"] <= 1.0 + 1e-9


@pytest.mark.parametrize("last", [0.0, -1.0], ids=["proportional", "integrates"])
@pytest.mark.parametrize("drift", ["[true, false]", "[false, true]"])
def test_drift_of_only_one_output_in_a_loop_is_refused_with_any_controller(drift, last):
    text = f"""
plant:
  {{B: [[[0, 0.3], [0, 0.1]], [[0, 0.2], [0, 0.5]]], F: [[[1, -0.5], [1, -0.5]], [[1, -0.2], [1, -0.8]]]}}
noise: {{drift: {drift}, variance: 0.1}}
experiment:
  {{samples: 300, controller: {{numerator: [[[0.3], [0]], [[0], [0.2]]], denominator: [1, {last}]}}}}
accuracy: {{standard_deviation: {{"b1[1,1]": 0.01}}}}
"""
    found = refusal(lambda: validate(parse_spec(text)))
    assert found.code == "infinite-information"
    assert "let every output drift" in found.hint
    validate(parse_spec(text, overrides=["noise.drift=true"]))


# Three ways to write k q^-1 / (1 - q^-1).
SUMS = [
    "{parameters: {k: 0.2}, B: [0, k], F: [1, -1]}",
    "{parameters: {k: 0.2}, continuous: {numerator: [k], denominator: [1, 0]}, sample: zoh}",
    "{parameters: {k: 0.2}, state_space: {A: [[1]], B: [[k]], C: [[1]], time: discrete}}",
]
DRIFTING = "noise: {drift: true, variance: 0.04}\nexperiment: {samples: 300}\n"


@pytest.mark.parametrize("plant", SUMS)
def test_an_integrator_with_drifting_noise_has_equal_information_at_all_frequencies(plant):
    """(1 - q^-1) G = k q^-1: the information in k is N power / variance, whatever the spectrum."""
    asked = "accuracy: {standard_deviation: {k: 0.01}}\nspectrum: {type: multisine, lines: 20}\n"
    spec = parse_spec(f"plant: {plant}\n{DRIFTING}{asked}")
    assert solve(spec).result["cost"] == pytest.approx(0.04 / (300 * 0.01**2), rel=1e-9)
    w = np.array([0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, np.pi])
    gradient = input_gradients([build_model(spec)], w)[0, :, 0, 0, 0]
    np.testing.assert_allclose(gradient, np.exp(-1j * w), atol=2e-5)


@pytest.mark.parametrize("plant", SUMS)
def test_designs_with_infinite_output_power_are_refused(plant):
    found = refused(f"plant: {plant}\n{DRIFTING}accuracy: {{standard_deviation: {{k: 0.01}}}}\n")
    assert found.code == "infinite-output"
    assert "multisine" in found.hint
