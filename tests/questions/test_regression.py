"""Regression problems from spec to result: designs, signals, simulations, figures and refusals."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import load_spec, simulate, solve
from inputdesign_cli.design.regression.model import Regression
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.figures.plots import draw_all
from inputdesign_cli.monte_carlo.regression import run_experiments
from inputdesign_cli.outcome.run_directory import write_run
from inputdesign_cli.signal.moments import delayed_regressors, free_regressors
from tests.support.refusals import code_of, refusal

SPECS = Path(__file__).parents[2] / "specs"
FREE, FIR = SPECS / "regression.yaml", SPECS / "regression_fir.yaml"
E = "accuracy.mean_squared_error"
FOUR = [
    "plant.regression={estimated: 2, neglected: 2}",
    f"{E}.estimated=[0.94, 0.166]",
    f"{E}.neglected=[2.245, 1.096]",
    f"{E}.neglected_norm=0.5",
    "simulation=null",
    "experiment.samples=200",
]


@cache
def solved(path, *overrides, verb=solve):
    """The results of a spec; no test may change them."""
    return verb(load_spec(path, list(overrides)))


def result(path, *overrides, verb=solve):
    return solved(path, *overrides, verb=verb).result


def test_the_mean_squared_error_is_squared_bias_plus_variance():
    found = result(FIR, *FOUR)
    error, objective = found["mean_squared_error"], found["objective"]
    assert error["value"] == pytest.approx(error["bias_squared"] + error["variance"])
    assert objective["any_structure_bound"] < objective["lower_bound"] <= objective["value"]
    assert found["status"] == "optimal"
    assert found["cost"] == pytest.approx(np.trace(found["moments"]["R"]))
    assert found["baseline"] == {}  # white cannot always meet the target
    assert "signal" not in result(FIR, *FOUR, "experiment.samples=3")


def test_the_least_error_at_the_least_energy_is_the_target():
    energy = result(FIR, *FOUR)["cost"]
    found = result(FIR, *FOUR, f"{E}.target=null", f"limits.energy={energy:.17g}")
    assert found["objective"]["kind"] == "mean_squared_error"
    assert found["objective"]["value"] == pytest.approx(1.0, rel=1e-8)
    assert found["baseline"]["white"]["ratio"] > 1.0


def test_the_alternation_states_its_gap():
    found = result(FIR, *FOUR, "solver.method=alternating", "limits.energy=8", f"{E}.target=null")
    assert found["status"] == "gap_open"
    assert found["objective"]["relative_gap"] > 0.01
    assert found["objective"]["lower_bound"] == pytest.approx(1.072300, abs=2e-6)


@pytest.mark.parametrize(("samples", "periods"), [(100, None), (101, None), (100, 25), (4, None), (3, None)])
def test_free_regressors_have_their_moments_exactly(samples, periods):
    rng = np.random.default_rng(samples)
    F = rng.standard_normal((4, 3))
    R = F @ F.T
    period = samples // periods if periods else samples
    Phi = free_regressors(R, samples, period)
    np.testing.assert_allclose(Phi.T @ Phi, R, atol=1e-12 * np.trace(R))
    np.testing.assert_array_equal(Phi[:period], Phi[-period:])


def test_the_signal_printed_for_example_2_has_the_designed_moments():
    """The printed realisation has period 2 and is rounded to 1e-5; its u2 begins with a misprint."""
    R = result(FREE)["moments"]["R"]
    Phi = np.tile([[0.00057, 0.00057], [0.01529, 0.00944]], (5000, 1))
    np.testing.assert_allclose(Phi.T @ Phi, R, atol=2e-3)


def test_example_3_is_a_constant_signal():
    np.testing.assert_allclose(np.abs(solved(FIR).tables["signal"].columns["u1"]), 0.01, rtol=1e-9)


def test_a_period_of_20_samples_has_the_error_that_the_errata_state():
    entry = result(FIR, *FOUR, f"{E}.target=null", "limits.energy=8", "signal.periods=10")["signal"]
    assert entry["mean_squared_error"] == pytest.approx(1.072477, abs=1.5e-6)
    assert not entry["on_grid"]
    assert entry["energy"] == pytest.approx(8.0)


def test_samples_with_a_periodic_past_meet_the_target():
    outcome = solved(FIR, *FOUR)
    Phi = delayed_regressors(outcome.tables["signal"].columns["u1"], 4, "steady")
    entry = outcome.result["signal"]
    assert entry["energy"] == pytest.approx(np.trace(Phi.T @ Phi))
    assert entry["mean_squared_error"] == pytest.approx(1.0, rel=1e-9)
    assert entry["energy"] < 1.001 * outcome.result["cost"]


def test_regressors_from_rest_begin_with_zeros_and_have_less_energy():
    entry = result(FIR, *FOUR, "signal.start=zero")["signal"]
    assert entry["energy"] == entry["from_rest"]["energy"]
    assert entry["energy"] < result(FIR, *FOUR)["signal"]["energy"]
    for start, before in (("zero", 0), ("steady", 3)):
        found = delayed_regressors(np.arange(1.0, 4.0), 2, start)
        np.testing.assert_array_equal(found, [[1, before], [2, 1], [3, 2]])


@pytest.mark.parametrize(("path", "mean"), [(FREE, 1.381966), (FIR, 1.0)])
def test_simulated_errors_of_examples_2_and_3_agree_with_theory(path, mean):
    """Theory depends on Phi^T Phi only; 10000 runs of 200 samples agree within four standard errors."""
    study = result(path, "experiment.samples=200", "simulation.compare=[white]", verb=simulate)["simulation"]
    design, white = study["inputs"]["design"], study["inputs"]["white"]
    assert abs(design["mse"] - 1.0) < 4 * design["mse_standard_error"]
    assert abs(design["mean_estimate"][0] - mean) < 4 * design["mean_estimate_standard_error"][0]
    assert design["theory"]["mse"] == pytest.approx(1.0, rel=1e-6)
    assert design["mse_standard_error"] == pytest.approx(np.sqrt(2) / 100, rel=0.1)
    assert abs(white["mse"] - white["theory"]["mse"]) < 4 * white["mse_standard_error"]
    assert white["energy"] == pytest.approx(design["energy"])


def test_simulated_estimates_are_least_squares_estimates():
    rng = np.random.default_rng(0)
    Phi, theta = rng.standard_normal((30, 4)), np.array([1.0, 2.0, 3.0, 4.0])
    regression = Regression(np.array([1.0, 0.0]), np.array([0.0, 1.0]), 1.0, 0.25)
    found = run_experiments(regression, Phi, theta, runs=3, seed=1)
    noise = np.random.default_rng(np.random.SeedSequence(1, spawn_key=(0,))).standard_normal((3, 30))
    for row, v in zip(found.theta, noise, strict=True):
        expected = np.linalg.lstsq(Phi[:, :2], Phi @ theta + 0.5 * v, rcond=None)[0]
        np.testing.assert_allclose(row, expected, rtol=1e-10)
    np.testing.assert_allclose(found.error, found.theta[:, 0] - 1.0 - 4.0)


def test_a_run_of_a_regression_writes_its_files(tmp_path):
    outcome = solved(FIR, "experiment.samples=60")
    files = {file.name for file in write_run(outcome, tmp_path / "run", draw_all(outcome))}
    wanted = "spec.yaml signal.csv signal.png spectrum.csv error.png moments.png figures.json result.json"
    assert files == set(wanted.split())
    free = solved(FREE)
    assert (set(free.tables), set(free.curves)) == ({"signal"}, {"signal", "error", "moments"})


@pytest.mark.parametrize(
    ("verb", "override", "code"),
    [
        (solve, "signal.periods=7", "bad-period"),
        (simulate, "simulation=null", "missing-key"),
        (simulate, "simulation.compare=[prbs]", "not-supported"),
        (simulate, "experiment.samples=1", "wrong-shape"),
    ],
)
def test_unsupported_signals_and_simulations_are_refused(verb, override, code):
    assert code_of(verb, load_spec(FIR, [override])) == code


def test_an_infeasible_target_is_refused_with_feasible_values():
    """Example 4 at alpha = 2: |b| is at least 1, so a target of 4 or an alpha of 1 is the border."""
    two = f"{E}.neglected=[2]"
    told = refusal(lambda: solve(load_spec(FIR, [two, f"{E}.neglected_norm=2"])), InfeasibleError)
    assert told.code == "target-out-of-reach"
    text = f"{told.message} {told.hint}"
    assert all(part in text for part in ("above 4", "neglected_norm below 1", "proved"))
    with pytest.raises(InfeasibleError):
        solve(load_spec(FIR, [two, f"{E}.neglected_norm=1"]))
    assert result(FIR, two, f"{E}.neglected_norm=2", f"{E}.target=4.04")["status"] == "optimal"
