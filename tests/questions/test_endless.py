"""Designs with free and unlimited excitation are refused, or have no any-spectrum bound."""

import warnings

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve, validate
from inputdesign_cli.errors import InaccurateError, SpecError
from inputdesign_cli.questions.least_cost import solve as least_cost
from tests.support.outcomes import codes_in

SAMPLES, VARIANCE, NODES = 500, 0.1, 1 << 14


class Plant:
    """(1 - q)(1 - a q) y = (b1 q + b2 q^2) u + e under u = r - K y, by the textbook."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        a, b = rng.uniform(0.0, 0.6), rng.uniform([0.4, -0.3], [1.0, 0.3])
        self.A, self.B = np.convolve([1.0, -1.0], [1.0, -a]), np.array([0.0, *b])
        self.K = 0.2 * (1.0 - a)
        roots = np.roots(self.A + self.K * self.B)
        assert np.all(np.abs(roots) < 1.0)

    def text(self, criterion: str, rest: str) -> str:
        A, B = (p.tolist() for p in (self.A, self.B))
        return f"""
plant: {{A: {A}, B: {B}}}
noise: {{variance: {VARIANCE}}}
experiment: {{samples: {SAMPLES}, controller: {{numerator: [{self.K}], denominator: [1]}}}}
objective: best_accuracy
accuracy: {{criterion: {criterion}}}
signal: {{samples: 100, seed: 1, candidates: 1}}
{rest}
"""

    def _regressors(self, w, y, u):
        q = np.exp(-1j * w)
        return np.array([-q * y, -(q**2) * y, q * u, q**2 * u])

    def _loop(self, w):
        q = np.exp(-1j * w)
        A, B = np.polyval(self.A[::-1], q), np.polyval(self.B[::-1], q)
        return A, B, A + self.K * B

    def informations(self, lines, shares):
        """(n, 4, 4): information of lines (n, 2) with shares (2,) of an input power of one, and noise."""
        w = 2.0 * np.pi * (np.arange(NODES) + 0.5) / NODES
        A, B, below = self._loop(w)
        y = np.sqrt(VARIANCE) / below
        phi = self._regressors(w, y, -self.K * y)
        known = SAMPLES / VARIANCE * (phi @ phi.conj().T).real / NODES
        found = []
        for pair in lines:
            A, B, below = self._loop(pair)
            phi = self._regressors(pair, B / A, np.ones(2))  # for a unit of the input
            found.append(known + SAMPLES / VARIANCE * ((phi * shares) @ phi.conj().T).real)
        return np.array(found)

    def values(self, criterion, lines, shares=(0.5, 0.5)):
        M = self.informations(lines, np.array(shares))
        return {
            "D": lambda: np.linalg.slogdet(M)[1],
            "A": lambda: -np.trace(np.linalg.inv(M), axis1=1, axis2=2),
            "E": lambda: np.linalg.eigvalsh(M)[:, 0],
            "T": lambda: np.trace(M, axis1=1, axis2=2),
        }[criterion]()


RNG = np.random.default_rng(5)
LINES = np.column_stack([RNG.uniform(0.2, 3.1, 60), 10.0 ** RNG.uniform(-4, 0, 60)])
FAMILIES = ["{type: fir, order: 4}", "{type: white}", "{type: multisine, lines: 12}"]


@pytest.mark.first(4)
@pytest.mark.parametrize(("seed", "criterion"), [(1, "D"), (2, "A"), (3, "E"), (1, "T")])
@pytest.mark.parametrize("spectrum", FAMILIES)
def test_the_any_spectrum_bound_holds_for_pairs_of_lines_or_is_not_stated(seed, criterion, spectrum):
    plant = Plant(seed)
    result = solve(
        parse_spec(plant.text(criterion, f"limits: {{input_power: 1}}\nspectrum: {spectrum}"))
    ).result
    values = np.concatenate([plant.values(criterion, LINES, (p, 1.0 - p)) for p in (0.5, 0.99, 0.01)])
    bound = result["objective"].get("any_spectrum_bound", np.inf)
    assert values.max() <= bound + 1e-6 * abs(values.max())
    near = plant.values(criterion, np.array([[1.0, 1e-3], [1.0, 1e-5]]))
    endless = near[1] - near[0] > 0.1 * abs(near[0])
    assert endless == ("any_spectrum_bound" not in result["objective"])
    assert endless == ("no-bound-over-spectra" in codes_in(result))


@pytest.mark.first(4)
@pytest.mark.parametrize("criterion", "DAET")
@pytest.mark.parametrize(
    "limits",
    [
        "{input_power: 1, output_power: 20}",
        "{input_power: 1, excitation_power: 5}",
        "{input_power: 1, band: [0.0314, 3.14159]}",
    ],
)
def test_a_second_limit_or_a_band_gives_a_finite_optimum(criterion, limits):
    text = Plant(1).text(criterion, f"limits: {limits}\nspectrum: {{type: free}}")
    found = solve(parse_spec(text)).result
    assert found["status"] == "optimal"
    assert found["objective"]["relative_gap"] <= 1e-6
    if "band" in limits:
        inside = LINES[LINES[:, 1] > 0.0314]
        best = Plant(1).values(criterion, inside).max()
        assert best <= found["objective"]["any_spectrum_bound"] * (1 + np.sign(best) * 1e-6)


@pytest.mark.parametrize(("seed", "criterion"), [(2, "A"), (3, "E")])
def test_an_optimum_that_is_only_approached_is_reported(seed, criterion):
    plant = Plant(seed)
    text = plant.text(criterion, "limits: {input_power: 1}\nspectrum: {type: free}")
    found = solve(parse_spec(text)).result
    assert found["objective"]["relative_gap"] <= 1e-4
    assert "optimum-only-approached" in codes_in(found)
    best = plant.values(criterion, LINES).max()
    assert best <= found["objective"]["any_spectrum_bound"] + 1e-6 * abs(best)


def refused(text: str, *overrides: str) -> str:
    with pytest.raises(SpecError) as caught:
        solve(parse_spec(text, overrides=list(overrides)))
    return caught.value.diagnostics[0].code


OPEN = """
plant: {B: [0, 1, -1], A: [1, -0.5]}
noise: {variance: 0.1}
experiment: {samples: 500}
signal: {samples: 100, seed: 1, candidates: 1}
spectrum: {type: free}
"""


@pytest.mark.parametrize(
    ("rest", "code"),
    [
        ("objective: best_accuracy\naccuracy: {criterion: D}\nlimits: {output_power: 1}", "needs-limits"),
        ("objective: best_accuracy\naccuracy: {criterion: T}\nlimits: {output_power: 1}", "needs-limits"),
        ("cost: {input_power: 0, output_power: 1}\naccuracy: {standard_deviation: {b1: 0.1}}", None),
    ],
)
def test_a_zero_on_the_unit_circle_hides_input_power_from_the_output(rest, code):
    """Power at the zero informs on b1 + b2 alone, so the accuracy of b1 is limited by b1 - b2."""
    if code is None:
        assert solve(parse_spec(OPEN + rest)).result["status"] == "optimal"
    else:
        assert refused(OPEN + rest) == code


INSIDE = """
plant: {B: [0, 1], A: [1, -0.5, 1]}
noise: {variance: 0.1}
experiment: {samples: 500, controller: {numerator: [-0.2, -0.1], denominator: [1]}}
objective: best_accuracy
limits: {input_power: 1}
signal: {samples: 100, seed: 1, candidates: 1}
"""


@pytest.mark.parametrize("criterion", "DAET")
def test_free_power_at_a_pole_on_the_unit_circle_within_the_band_is_refused(criterion):
    text = f"{INSIDE}accuracy: {{criterion: {criterion}}}\n"
    assert refused(text, "spectrum={type: free}") == "needs-limits"
    on_it = f"spectrum={{type: multisine, frequencies: [0.4, {float(np.arccos(0.25))!r}, 2.0]}}"
    assert refused(text, on_it) == "needs-limits"
    fir = solve(parse_spec(text, overrides=["spectrum={type: fir, order: 2}"])).result
    assert "any_spectrum_bound" not in fir["objective"]
    beside = ["spectrum={type: free}", "limits.band=[1.35, 3.14159]"]
    assert solve(parse_spec(text, overrides=beside)).result["status"] == "optimal"


GAIN = """
plant: {parameters: {k: 0.2}, B: [0, k], F: [1, -1]}
noise: {variance: 0.1}
experiment: {samples: 500, controller: {numerator: [0.3], denominator: [1]}}
accuracy: {standard_deviation: {k: 0.001}}
signal: {samples: 100, seed: 1, candidates: 1}
"""


def test_the_gain_of_an_integrator_at_vanishing_cost_is_refused():
    """A unit of input power gives the information N / (variance |1 - q|^2) on k."""
    assert refused(GAIN, "cost={input_power: 1, output_power: 0}", "spectrum={type: free}") == "no-cost"
    fir = solve(parse_spec(GAIN, overrides=["cost={input_power: 1, output_power: 0}"])).result
    assert "any_spectrum_bound" not in fir["objective"]
    limited = ["objective=shortest_experiment", "limits={input_power: 1}", "spectrum={type: free}"]
    assert refused(GAIN, *limited) == "needs-limits"


def test_lines_at_a_pole_on_the_unit_circle_are_refused():
    spectrum = "spectrum={type: multisine, frequencies: [0, 0.5, 1.0]}"
    assert refused(Plant(1).text("D", "limits: {input_power: 1}"), spectrum) == "needs-limits"


APPROACHED = """
plant: {A: [1, -1], B: [0, 0.5, 0.2]}
noise: {variance: 0.1}
experiment: {samples: 500, controller: {numerator: [0.5], denominator: [1]}}
cost: {input_power: 1}
accuracy: {model_error: {absolute: 0.1, alpha: 2, band: [0.03142, 3.141]}}
signal: {samples: 100, seed: 1, candidates: 1}
spectrum: {type: free}
"""


def test_an_approached_optimum_is_reported_also_after_a_loss_of_precision(monkeypatch):
    """Power costs less and less towards frequency zero."""
    found = solve(parse_spec(APPROACHED)).result
    assert ("optimum-only-approached", "doubt") in {(f["code"], f["severity"]) for f in found["findings"]}

    def ended(*_args, **_more):
        raise InaccurateError.because("internal-disagreement", "digits ended", "ask for less")

    monkeypatch.setattr(least_cost, "audit", ended)
    with pytest.raises(InaccurateError) as caught:
        solve(parse_spec(APPROACHED))
    (told,) = caught.value.diagnostics
    assert told.code == "internal-disagreement"
    assert all(remedy in told.hint for remedy in ("cost.output_power", "limits.band", "ask for less"))


@pytest.mark.slow
def test_a_band_without_frequency_zero_has_an_optimum():
    """Its cost is less than 0.1 % above the lower bound without the band."""
    bound = solve(parse_spec(APPROACHED)).result["objective"]["lower_bound"]
    found = solve(parse_spec(APPROACHED + "limits: {band: [0.0314, 3.14159]}\n")).result
    assert found["status"] == "optimal"
    assert bound < found["cost"] < 1.001 * bound


TWO_INPUTS = """
plant: {B: [[[0, 1.0, 0.4], [0, -0.5, 0.3]]], F: [[[1, -0.7], [1, 0.4]]]}
noise: {variance: 1}
experiment: {samples: 500}
"""
TWO_OUTPUTS = """
plant: {A: [1, -0.7], B: [[[0, 1.0, 0.4], [0, -0.5, 0.3]], [[0, 0.3], [0, 0.8]]]}
noise: {variance: 1}
experiment: {samples: 500}
"""
ERROR = "accuracy: {model_error: {relative: 0.1}}\n"
LOOP = "experiment.controller={numerator: [[[0.1]], [[0]]], denominator: [1, -1]}"


def codes(text, *overrides):
    try:
        validate(parse_spec(text, overrides=list(overrides)))
    except SpecError as error:
        return [diagnostic.code for diagnostic in error.diagnostics]
    return []


@pytest.mark.parametrize("spectrum", ["{type: fir, order: 4}", "{type: free}", "{type: multisine, lines: 9}"])
def test_combinations_of_inputs_without_output_power_are_refused(spectrum):
    """The effects of two inputs may cancel at one output."""
    asked = (TWO_INPUTS + ERROR, f"spectrum={spectrum}")
    assert codes(*asked, "cost={output_power: 1}") == ["no-cost"]
    assert codes(*asked, "cost={output_power: 1, input_power: [0, 0.1]}") == []
    assert codes(*asked, "objective=shortest_experiment", "limits={output_power: 9}") == ["needs-limits"]
    assert codes(*asked, "objective=best_accuracy", "limits={output_power: 9}", LOOP) == ["needs-limits"]


def test_an_input_without_a_price_is_refused():
    assert codes(TWO_OUTPUTS + ERROR, "cost={input_power: [1, 0]}") == ["no-cost"]


def test_output_power_prices_as_many_inputs_as_there_are_independent_outputs():
    assert codes(TWO_OUTPUTS + ERROR, "cost={output_power: 1}") == []
    assert codes(TWO_OUTPUTS + "accuracy: {criterion: T}\n", "limits={output_power: [1, 2]}") == []
    parallel = "plant.B=[[[0, 1, 0.4], [0, 2, 0.8]], [[0, 0.3], [0, 0.6]]]"
    assert codes(TWO_OUTPUTS + ERROR, "cost={output_power: 1}", parallel) == ["no-cost"]


def test_a_limit_on_the_density_limits_every_combination_of_inputs():
    criterion = TWO_INPUTS + "accuracy: {criterion: D}\nspectrum: {type: fir, order: 4}\n"
    assert codes(criterion, "limits={output_power: 9}") == ["needs-limits"]
    assert codes(criterion, "limits={output_power: 9, spectrum: 4}") == []


@pytest.mark.slow
def test_an_output_limit_need_not_limit_combinations_that_the_cost_counts():
    """A limit 2 % below the output power of the cheapest design raises its cost by at most 1 %."""
    free = {"cost": "{input_power: 1}", "spectrum": "{type: fir, order: 3}", "signal": "{candidates: 1}"}
    overrides = [f"{key}={value}" for key, value in free.items()]
    least = solve(parse_spec(TWO_INPUTS + ERROR, overrides=overrides)).result
    most = 0.98 * sum(least["power"]["output"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        held = parse_spec(TWO_INPUTS + ERROR, overrides=[*overrides, f"limits.output_power={most}"])
        result = solve(held).result
    assert result["power"]["output"][0] <= most * (1.0 + 1e-9)
    assert least["cost"] * (1.0 - 1e-7) <= result["cost"] <= 1.01 * least["cost"]


# Rounding gives a pole of this loop a tiny angle, so that the frequency grid has a point next to zero.
INTEGRATING = """
plant:
  parameters: {a: 3.21, k: 0.9362, m: 1.865}
  state_space: {A: [[-a, 0], [m, -m]], B: [[k*a], [0]], C: [[0, 1]], delay: 0.04888}
  sample: zoh
  known: [m]
noise: {variance: 0.02358, C: [1.0, 0.23507, -0.52711]}
experiment: {samples: 1000, controller: {pid: {Kp: 0.3, Ti: 0.9346}}}
sample_time: 0.06794
accuracy: {standard_deviation: {k: 0.1024}}
objective: best_accuracy
limits: {input_power: 0.2527}
spectrum: {type: free}
signal: {seed: 81, type: multisine}
"""


def test_the_gap_closes_for_power_next_to_frequency_zero():
    """With a very slow input only the gain matters: var(k) <= v C(1)^2 / (N p), for G(0) = k."""
    found = solve(parse_spec(INTEGRATING)).result["objective"]
    assert found["relative_gap"] < 1e-7
    slow = np.sqrt(0.02358 / (1000 * 0.2527)) * (1 + 0.23507 - 0.52711)
    # The noise in the loop adds a little information.
    assert 0.99 * slow < found["value"] * 0.1024 < slow
    assert found["value"] == pytest.approx(found["any_spectrum_bound"], rel=1e-7)
