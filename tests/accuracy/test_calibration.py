"""Calibrated confidence against closed forms and plain Monte Carlo, and the designs that use it."""

import numpy as np
import pytest
import scipy.optimize
import scipy.signal
import scipy.stats

from inputdesign_cli import analyse, load_spec, parse_spec, simulate, solve
from inputdesign_cli.accuracy.calibration import Calibration
from inputdesign_cli.errors import InaccurateError, InfeasibleError
from inputdesign_cli.questions import build_task
from inputdesign_cli.questions.common.confidence import settled_alpha
from tests.support.refusals import code_of

BASE = """
plant: {%s}
noise: {variance: %s}
experiment: {samples: %d}
accuracy: {model_error: {%s, confidence: CONFIDENCE}}
%s
"""
FIR = BASE % ("B: [1.0, -0.4, 0.2]", 1, 400, "absolute: 0.1", "spectrum: {type: fir, order: 4}")


GAIN = BASE % ("B: [1.0]", 1, 200, "absolute: 0.1", "signal: {type: binary}")
POLE = BASE % ("B: [0, 1], F: [1, -0.9]", 1, 60, "relative: 0.3, band: [0.01, 1]", "spectrum: {type: white}")
TWO = BASE % (
    "B: [[[0.5], [0.2]], [[0.1], [0.8]]]",
    "[[1, 0], [0, 1]]",
    1000,
    "absolute: 0.2",
    "spectrum: {type: white}",
)
FEW = "{exact: 0.9, draws: 500, runs: 0}"


def spec(text, confidence, *overrides):
    return parse_spec(text.replace("CONFIDENCE", confidence), file="spec.yaml", overrides=list(overrides))


def errors_of(text):
    task = build_task(spec(text, "0.95"))
    return [make(task.simulation.nominal) for make in task.asked.question.requirements]


# The number of draws, and about three relative standard errors of their quantile.
DRAWS = pytest.mark.parametrize(
    ("draws", "close"), [(2500, 0.045), pytest.param(20_000, 0.02, marks=pytest.mark.slow)]
)


@DRAWS
def test_alpha_for_one_parameter_is_the_normal_quantile(draws, close):
    errors = errors_of(FIR.replace("[1.0, -0.4, 0.2]", "[1.0]"))
    alpha = Calibration(0.95, draws).alpha(errors, np.array([[7.0]]))
    assert alpha == pytest.approx(scipy.stats.norm.ppf(0.975), rel=close)


@DRAWS
def test_alpha_for_a_finite_impulse_response_agrees_with_plain_monte_carlo(draws, close):
    errors = errors_of(FIR)
    M = np.array([[900.0, 300.0, 0.0], [300.0, 800.0, 100.0], [0.0, 100.0, 500.0]])
    alpha = Calibration(0.9, draws).alpha(errors, M)
    rng = np.random.default_rng(99)
    theta = rng.multivariate_normal(np.zeros(3), np.linalg.inv(M), 10_000)
    phases = np.exp(-1j * np.outer(np.arange(3), np.linspace(0, np.pi, 200)))
    largest = np.abs(theta @ phases).max(axis=1)
    T = np.stack([phases.real, phases.imag], axis=1).transpose(2, 1, 0)
    size = np.linalg.norm(T @ np.linalg.cholesky(np.linalg.inv(M)), ord=2, axis=(1, 2)).max()
    assert alpha == pytest.approx(np.quantile(largest, 0.9) / size, rel=close)
    assert alpha < np.sqrt(scipy.stats.chi2(3).ppf(0.9))  # G is linear in theta: alpha is conservative


def test_the_cost_of_a_linear_plant_is_proportional_to_alpha_squared():
    fast = "solver.any_spectrum=false"
    usual, exact = solve(spec(FIR, "0.9", fast)).result, solve(spec(FIR, FEW, fast)).result
    share = (exact["model_error"]["alpha"] / usual["model_error"]["alpha"]) ** 2
    assert exact["cost"] / usual["cost"] == pytest.approx(share, rel=1e-6)
    told = exact["model_error"]["confidence"]
    assert told["chi_squared_alpha"] == pytest.approx(usual["model_error"]["alpha"], rel=1e-12)
    assert told["linear"] == told["exact"]
    low, high = told["exact_limits"]
    assert low - 0.01 < 0.9 < high + 0.01
    assert "confidence" not in usual["model_error"]
    assert exact["signal"]["confidence"]["exact"] > 0.86


def test_all_entries_stay_within_their_bounds_jointly_with_the_stated_confidence():
    found = analyse(spec(TWO, FEW, "spectrum={given: {type: white, power: 1}}")).result
    # With uncorrelated noise and white inputs of power p the four gains are independent, each of variance
    # 1 / (N p). All four errors stay below 0.2 with the fourth power of the probability of one.
    one = scipy.stats.norm.ppf(0.5 + 0.5 * 0.9**0.25)
    assert found["model_error"]["alpha"] == pytest.approx(one, rel=0.05)


@pytest.mark.parametrize("steepness", [0.3, 1.0, 1.6, 4.0])
def test_settled_alpha_finds_the_alpha_that_its_own_design_needs(steepness):
    assert settled_alpha(lambda alpha: 3.0 * (alpha / 3.0) ** -steepness, 2.0) == pytest.approx(3, rel=1e-3)


def test_settled_alpha_without_a_solution_is_refused():
    assert (
        code_of(settled_alpha, lambda alpha: 2.0 * alpha, 1.0, kind=InaccurateError)
        == "confidence-not-settled"
    )


@pytest.mark.slow
def test_estimates_that_are_normal_at_every_length_need_no_correction():
    """The least-squares estimate of a gain from a binary signal is normal of variance 1 / (N p) for all N."""
    told = solve(spec(GAIN, "{exact: 0.95, draws: 1000, runs: 1000}", "spectrum={type: white}")).result
    error = told["model_error"]
    assert error["confidence"]["excess"] == pytest.approx(1.0, abs=0.13)  # 3 standard errors
    assert error["alpha"] == pytest.approx(scipy.stats.norm.ppf(0.975), rel=0.1)
    assert error["confidence"]["kept"] == pytest.approx(0.95, abs=0.025)


@pytest.mark.slow
def test_alpha_for_short_records_keeps_the_confidence_in_plain_monte_carlo():
    """The test simulates a first-order plant and fits it by least squares of the output error."""
    runs = "{exact: 0.9, draws: 1000, runs: 1000}"
    found = solve(spec(POLE, runs)).result
    power = found["power"]["excitation"][0]
    told = found["model_error"]["confidence"]
    assert told["kept"] == pytest.approx(0.9, abs=0.04)
    rng, w, kept = np.random.default_rng(5), np.linspace(0.01, 1, 60), []

    def response(b, f, u):
        return scipy.signal.lfilter([0.0, b], [1.0, f], u)

    def plant(b, f):
        return b * np.exp(-1j * w) / (1 + f * np.exp(-1j * w))

    for _ in range(300):
        u = rng.standard_normal(60)
        u *= np.sqrt(power / np.mean(u**2))
        y = response(1.0, -0.9, u) + rng.standard_normal(60)
        fit = scipy.optimize.least_squares(lambda p, u=u, y=y: y - response(*p, u), [1.0, -0.9])
        kept.append(np.all(abs(plant(*fit.x) - plant(1.0, -0.9)) <= 0.3 * abs(plant(1.0, -0.9))))
    assert np.mean(kept) == pytest.approx(0.9, abs=0.055)  # 3 standard errors of 300 runs
    plain = solve(spec(POLE, "{exact: 0.9, draws: 1000, runs: 0}")).result
    share = told["excess"]
    assert share == pytest.approx(found["model_error"]["alpha"] / plain["model_error"]["alpha"], rel=0.15)


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("text", "runs", "close"),
    [(FIR, 0, 2e-3), (POLE, 500, 0.12)],  # the latter two standard errors
)
def test_an_analysis_of_the_design_has_the_alpha_of_the_design(text, runs, close):
    exact = FEW if text == FIR else f"{{exact: 0.9, draws: 1000, runs: {runs}}}"
    design = solve(spec(text, exact, "spectrum={type: white}")).result
    power = design["power"]["excitation"][0]
    found = analyse(spec(text, exact, f"spectrum={{given: {{type: white, power: {power!r}}}}}")).result
    assert found["model_error"]["alpha"] == pytest.approx(design["model_error"]["alpha"], rel=close)
    assert not runs or found["model_error"]["confidence"]["runs"] == runs


def test_missing_estimates_count_as_errors_beyond_r_adm():
    """With 20 % of the estimates missing no alpha keeps 90 % confidence; with 5 % missing one does."""
    calibration = Calibration(0.9, 1000)
    errors, M = errors_of(FIR), np.diag([900.0, 800.0, 500.0])
    lost = np.full((100, 3), np.nan)
    lost[:80] = errors[0].experiment.model.theta
    assert calibration.corrected(errors, M, lost).excess == np.inf
    lost[80:95] = errors[0].experiment.model.theta + 1.0
    assert np.isfinite(calibration.corrected(errors, M, lost).excess)


PLANTS = {
    "first order": ("{B: [0, 3.6], F: [1, -0.7]}\nnoise: {C: [1, -0.9], variance: 1.0}", "relative: 0.01"),
    "resonance": (
        "{B: [0, 1, 0.5], F: [1, -1.601, 0.9409]}\nnoise: {variance: 1.0}",
        "relative: 0.1, band: [0.01, 1.5]",
    ),
    "armax": (
        "{A: [1, -1.5, 0.7], B: [0, 1, 0.5]}\nnoise: {C: [1, -1, 0.2], variance: 1.0}",
        "relative: 0.1, band: [0.01, 1.5]",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", [*PLANTS, "flexible transmission"])
def test_simulated_runs_stay_within_r_adm_with_the_stated_confidence(name):
    study = {"simulation.runs": 1000, "simulation.seed": 3}
    if name in PLANTS:
        plant, error = PLANTS[name]
        asked = parse_spec(
            f"plant: {plant}\naccuracy: {{model_error: {{{error}, confidence: {{exact: 0.95}}}}}}\n"
            "experiment: {samples: 500}\nspectrum: {type: fir, order: 20}\n"
        )
    else:
        asked = load_spec("specs/flexible_transmission.yaml").with_(
            **{"accuracy.model_error.alpha": None, "accuracy.model_error.confidence": {"exact": 0.95}}
        )
        study["simulation.plant"] = None  # the plant of the design
        study["simulation.noise"] = None
    kept = simulate(asked.with_(**study)).result["simulation"]["inputs"]["design"]["within_r_adm"]
    assert kept == pytest.approx(0.95, abs=0.015)


@pytest.mark.slow
def test_a_power_limit_just_above_the_least_power_is_feasible_and_one_below_is_not():
    few = FEW.replace("500", "200")
    free = solve(spec(FIR, few)).result["power"]["input"][0]
    within = solve(spec(FIR, few, f"limits={{input_power: {1.002 * free!r}}}")).result
    assert within["power"]["input"][0] == pytest.approx(free, rel=2e-3)
    with pytest.raises(InfeasibleError, match="that there is none is not proved") as caught:
        solve(spec(FIR, few, f"limits={{input_power: {0.9 * free!r}}}"))
    assert caught.value.diagnostics[0].code == "infeasible"


def test_a_best_accuracy_design_reports_the_coverage_at_its_own_ratio():
    best = ["objective=best_accuracy", "limits={input_power: 0.01}"]
    told = solve(spec(FIR, FEW, *best)).result
    assert told["objective"]["value"] > 1.1
    assert told["model_error"]["confidence"]["exact"] == pytest.approx(0.9, abs=0.04)
    assert told["signal"]["confidence"]["exact"] == pytest.approx(0.9, abs=0.04)
