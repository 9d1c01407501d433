"""Calibrated confidence: closed forms, plain Monte Carlo, properties; the designs that use it."""

import numpy as np
import pytest
import scipy.stats
from typer.testing import CliRunner

from inputdesign_cli import analyse, parse_spec, simulate, solve
from inputdesign_cli.accuracy.calibration import Calibration
from inputdesign_cli.cli import app
from inputdesign_cli.errors import InaccurateError, SpecError
from inputdesign_cli.tasks.build.task import build_task
from inputdesign_cli.tasks.confidence import settled_alpha

FIR = """
plant: {B: [1.0, -0.4, 0.2]}
noise: {variance: 1}
experiment: {samples: 400}
accuracy: {model_error: {absolute: 0.1, confidence: CONFIDENCE}}
spectrum: {type: fir, order: 4}
"""


FEW = "{exact: 0.95, draws: 1000}"


def spec(text, confidence="{exact: 0.95}", *overrides):
    return parse_spec(text.replace("CONFIDENCE", confidence), file="spec.yaml", overrides=list(overrides))


def errors_of(text):
    task = build_task(spec(text, "0.95"))
    return [make(task.experiment) for make in task.question.requirements]


def test_of_one_parameter_it_is_the_normal_quantile():
    errors = errors_of(FIR.replace("[1.0, -0.4, 0.2]", "[1.0]"))
    alpha = Calibration(0.95, 20_000).alpha(errors, np.array([[7.0]]))
    assert alpha == pytest.approx(scipy.stats.norm.ppf(0.975), rel=0.02)  # 3 standard errors


def test_of_a_finite_response_it_is_that_of_a_plain_simulation():
    errors = errors_of(FIR)
    M = np.array([[900.0, 300.0, 0.0], [300.0, 800.0, 100.0], [0.0, 100.0, 500.0]])
    alpha = Calibration(0.9, 10_000).alpha(errors, M)
    rng = np.random.default_rng(99)
    theta = rng.multivariate_normal(np.zeros(3), np.linalg.inv(M), 20_000)
    phases = np.exp(-1j * np.outer(np.arange(3), np.linspace(0, np.pi, 400)))
    largest = np.abs(theta @ phases).max(axis=1)
    T = np.stack([phases.real, phases.imag], axis=1).transpose(2, 1, 0)
    size = np.linalg.norm(T @ np.linalg.cholesky(np.linalg.inv(M)), ord=2, axis=(1, 2)).max()
    assert alpha == pytest.approx(np.quantile(largest, 0.9) / size, rel=0.02)
    assert alpha < np.sqrt(scipy.stats.chi2(3).ppf(0.9))  # G is linear in theta: the ellipsoid is enough


def test_the_cost_of_a_linear_plant_falls_with_the_square_of_alpha():
    usual, exact = solve(spec(FIR, "0.95")).result, solve(spec(FIR)).result
    share = (exact["model_error"]["alpha"] / usual["model_error"]["alpha"]) ** 2
    assert exact["cost"] / usual["cost"] == pytest.approx(share, rel=1e-6)
    told = exact["model_error"]["confidence"]
    assert told["chi_squared_alpha"] == pytest.approx(usual["model_error"]["alpha"], rel=1e-12)
    assert told["linear"] == told["exact"]
    low, high = told["exact_limits"]
    assert low - 0.01 < 0.95 < high + 0.01
    assert "confidence" not in usual["model_error"]
    assert exact["signal"]["confidence"]["exact"] > 0.93


def test_an_analysis_of_the_design_needs_the_alpha_of_the_design():
    design = solve(spec(FIR, FEW, "spectrum={type: white}")).result
    power = design["power"]["excitation"][0]
    found = analyse(spec(FIR, FEW, f"spectrum={{given: {{type: white, power: {power!r}}}}}")).result
    assert found["model_error"]["alpha"] == pytest.approx(design["model_error"]["alpha"], rel=2e-3)


def test_several_entries_keep_their_bounds_together():
    text = """
plant: {B: [[[0.5], [0.2]], [[0.1], [0.8]]]}
noise: {variance: [[1, 0], [0, 1]]}
experiment: {samples: 1000}
accuracy: {model_error: {absolute: 0.2, confidence: CONFIDENCE}}
spectrum: {type: fir, order: 1}
"""
    design = solve(spec(text, FEW)).result
    # Two outputs without common noise: with white inputs of power p the four gains are independent, each of
    # variance 1 / (N p), and all four keep to 0.2 with the fourth power of what one does.
    one = scipy.stats.norm.ppf(0.5 + 0.5 * 0.95**0.25)
    assert design["model_error"]["alpha"] == pytest.approx(one, rel=0.05)


@pytest.mark.parametrize("steepness", [0.3, 1.0, 1.6, 4.0])
def test_the_alpha_that_its_design_needs_is_found(steepness):
    assert settled_alpha(lambda alpha: 3.0 * (alpha / 3.0) ** -steepness, 2.0) == pytest.approx(3, rel=1e-3)


def test_it_says_when_there_is_none():
    with pytest.raises(InaccurateError, match="no alpha was found") as caught:
        settled_alpha(lambda alpha: 2.0 * alpha, 1.0)
    assert caught.value.diagnostics[0].code == "confidence-not-settled"


@pytest.mark.parametrize(
    ("confidence", "code"),
    [
        ("{exact: 1.2}", "out-of-range"),
        ("{exact: 0.9, draws: 1.0e9}", "too-large"),
        ("{draws: 10}", "missing-key"),
        ("{exact: 0.9, ellipsoid: 0.9}", "conflicting-keys"),
    ],
)
def test_what_cannot_be_calibrated_is_refused(confidence, code):
    with pytest.raises(SpecError) as caught:
        spec(FIR, confidence)
    assert code in {d.code for d in caught.value.diagnostics}


def test_an_ellipsoid_has_no_exact_confidence(tmp_path):
    (tmp_path / "a.yaml").write_text(FIR.replace("CONFIDENCE}", "{exact: 0.9}, region: ellipsoid}"))
    done = CliRunner().invoke(app, ["validate", str(tmp_path / "a.yaml")])
    assert done.exit_code == 2
    assert "remove region" in done.stderr


@pytest.mark.slow
def test_runs_keep_the_bound_with_the_probability():
    text = """
plant: {A: [1, -1.5, 0.7], B: [0, 1, 0.5]}
noise: {C: [1, -1, 0.2], variance: 1}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1, band: [0.01, 1.5], confidence: CONFIDENCE}}
spectrum: {type: fir, order: 20}
simulation: {runs: 2000, seed: 3}
"""
    study = simulate(spec(text)).result["simulation"]["inputs"]["design"]
    assert study["within_r_adm"] == pytest.approx(0.95, abs=0.015)
