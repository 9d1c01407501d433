"""From the spec to the result: figures, files, other laws and limits, and refusals."""

import csv
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import load_spec, simulate, solve
from inputdesign_cli.outcome.run_directory import write_run
from tests.support.refusals import refused

CONTROL = "accuracy.closed_loop_error.control"
SHORT = ("experiment.samples=1000", "signal.candidates=2")


def spec(*overrides):
    return load_spec(Path(__file__).parents[3] / "specs" / "distillation_column.yaml", overrides)


@cache
def solved(*overrides):
    """The outcome for a short experiment; no test may change it."""
    return solve(spec(*SHORT, *overrides))


def test_the_design_of_the_column_has_the_figures_of_the_errata(tmp_path):
    outcome = solved()
    result = outcome.result
    assert result["status"] == "optimal"
    assert result["objective"]["kind"] == "closed_loop_error"
    # (mean tr Z^{1/2})^2 / power, from docs/errata.md: mean S2, the noise, eigenvalues of the matrix root.
    by_hand = (1.637898 * 1e-5 * np.sqrt(2) * 72.376130) ** 2 / 2
    assert result["objective"]["value"] == pytest.approx(by_hand, rel=1e-5)
    assert 0 <= result["objective"]["relative_gap"] < 1e-10
    assert sum(result["power"]["input"]) == pytest.approx(2.0, rel=1e-9)
    structure = result["closed_loop_error"]["parametric"]
    assert structure["design"]["value"] == pytest.approx(5.26270e-6, rel=1e-5)
    assert structure["white"]["value"] == pytest.approx(1.02222e-5, rel=5e-6)
    assert result["information"]["parameters"] == ["a1", "b1[1,1]", "b1[1,2]", "b1[2,1]", "b1[2,2]"]
    assert set(outcome.curves) == {"spectrum", "directions", "signal"}
    write_run(outcome, tmp_path / "run", {})
    with (tmp_path / "run" / "spectrum.csv").open(encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header == ["frequency_rad_per_min", "phi_11", "phi_12_re", "phi_12_im", "phi_22"]
    values = np.array(rows, dtype=float)
    assert values.shape == (512, 5)
    assert values[-1, 0] == pytest.approx(np.pi / 2)
    # The grid is even, so that the trapezoidal rule gives back the power.
    weights = np.full(512, 1 / 511)
    weights[[0, -1]] /= 2
    assert (values[:, 1] + values[:, 4]) @ weights == pytest.approx(2.0, rel=2e-3)
    saved = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    assert saved["spectrum"]["peak"]["frequency"] == pytest.approx(0.02667 / 2, abs=1e-5)


def test_the_signal_keeps_its_limits_and_nearly_reaches_the_designed_error():
    limits = "limits={input_power: [1.2, 0.5], output_power: [0.001, 0.001]}"
    outcome = solve(spec("experiment.samples=2000", "signal.candidates=2", limits))
    u = np.array([outcome.tables["signal"].columns[f"u{i}"] for i in (1, 2)])
    assert np.all(np.mean(u**2, axis=1) <= np.array([1.2, 0.5]) * (1 + 1e-9))
    result = outcome.result
    assert [row["attained"] for row in result["closed_loop_error"]["limits"]] == pytest.approx(
        [result["power"]["input"][0], 0.5, result["power"]["output"][0], 0.001], rel=1e-6
    )
    designed = result["closed_loop_error"]["parametric"]["design"]["value"]
    assert result["signal"]["parametric_value"] == pytest.approx(designed, rel=0.08)
    assert result["objective"]["relative_gap"] < 1e-10


@pytest.mark.first(2)
@pytest.mark.parametrize(
    ("settings", "kind"), [("", "taps"), (", order: 2", "filter"), (", order: 4", "filter")]
)
def test_filtered_noise_reports_its_factor(settings, kind):
    signal = solved(f"signal={{type: filtered_noise, candidates: 2{settings}}}").result["signal"]
    assert signal["type"] == "filtered_noise"
    assert kind in signal
    assert signal["spectral_factor_residual"] < 0.01
    assert signal["floor"] == pytest.approx(1e-4, rel=1e-6)
    if kind == "filter":
        assert signal["pole_radius"] < 1
        assert signal["filter_value"] < 6.3e-6


def test_the_exact_covariance_gives_lines_and_a_better_input():
    result = solved("accuracy.closed_loop_error.covariance=parametric").result
    value, found = result["objective"]["value"], result["closed_loop_error"]["parametric"]["design"]["value"]
    assert (value, found) == pytest.approx((5.204e-6, value), rel=1e-4)
    assert result["objective"]["relative_gap"] < 1e-6
    assert result["spectrum"]["type"] == "multisine"


def test_a_band_counts_the_error_inside_it_only():
    inside, whole = solved("limits.band=[0.005, 0.5]").result, solved().result
    assert inside["objective"]["value"] < whole["objective"]["value"]
    assert inside["closed_loop_error"]["band"] == pytest.approx([0.005, 0.5])
    assert sum(inside["power"]["input"]) == pytest.approx(2.0, rel=1e-9)


T = "[0, 0.3]"
WAYS = {
    "scalar": f"{{model_reference: {{numerator: {T}, denominator: [1, -0.7]}}}}",
    "matrix": f"{{model_reference: {{numerator: [[{T}, [0]], [[0], {T}]], denominator: [1, -0.7]}}}}",
    "internal model": "{internal_model: {numerator: [0.3], denominator: [1, -0.7]}}",
    "in s": "{model_reference: {continuous: {numerator: [[[1], [0]], [[0], [1]]], denominator: [75, 1]}}}",
}


@pytest.mark.parametrize(
    ("one", "other"), [("scalar", "matrix"), ("scalar", "internal model"), ("in s", None)]
)
def test_equivalent_descriptions_of_a_loop_give_one_design(one, other):
    """Without zeros outside the circle, internal model control equals model reference control."""
    first, second = (solved(*([f"{CONTROL}={WAYS[way]}"] if way else [])).result for way in (one, other))
    assert first["objective"]["value"] == pytest.approx(second["objective"]["value"], rel=1e-10)
    if other == "internal model":
        assert second["closed_loop_error"]["law"] == "internal_model"


def test_minimum_variance_reports_the_error_that_no_input_reduces():
    result = solved(f"{CONTROL}={{minimum_variance: true}}").result
    part = result["closed_loop_error"]["noise_model_part"]
    assert 0 < part < result["objective"]["value"]


def test_a_continuous_time_plant_is_sampled():
    plant = (
        "plant={continuous: {numerator: [[[0.878], [-0.864]], [[1.082], [-1.096]]], denominator: [75, 1]}, "
        "sample: zoh}"
    )
    noise = "noise={D: [1, -0.9736857494], variance: 1.0e-10}"
    result = solved(plant, noise).result
    loop = result["spectrum"]["loop_input"]
    np.testing.assert_allclose(
        loop["matrix"], [[2586.76231842, 2582.4486396], [2582.4486396, 2578.65557718]], rtol=1e-9
    )
    np.testing.assert_allclose(loop["root_eigenvalues"], [0.50707707, 71.86905293], rtol=1e-7)


def test_a_sensitivity_with_a_zero_on_the_circle_has_a_finite_criterion():
    """S = 1 - T vanishes at pi/2 rad/sample, where C is infinite: the criterion stays finite and settles."""
    T = [0, 0.2, -0.5, 0.2, 0.5]
    assert abs(1 - np.polynomial.polynomial.polyval(-1j, T)) < 1e-12
    result = solved(f"{CONTROL}={{model_reference: {{numerator: {T}, denominator: [1]}}}}").result
    assert np.isfinite(result["objective"]["value"])
    assert result["solver"]["settled"] < 1e-10


def test_simulate_adds_a_study_that_agrees_with_theory():
    outcome = simulate(spec("experiment.samples=1000", "signal.candidates=1", "simulation.runs=40"))
    study = outcome.result["simulation"]
    assert study["runs"] == 40
    assert set(study["inputs"]) == {"design", "white"}
    white = study["inputs"]["white"]
    assert white["theory"]["loss"]["mean"] == pytest.approx(0.002835, rel=1e-3)
    assert abs(white["loss"]["mean"] - white["theory"]["loss"]["mean"]) < 4 * white["loss"]["standard_error"]
    assert white["exact"]["squared"]["mean"] == pytest.approx(white["squared"]["mean"], rel=0.1)
    assert study["improvement"]["theory"] == pytest.approx(0.277, abs=1e-3)
    assert "loss" in outcome.curves


def test_simulate_uses_a_stated_true_system():
    """The S1 design of the paper: H without its pole in the design, with it in the true system."""
    outcome = simulate(
        spec(
            "experiment.samples=1000",
            "signal.candidates=1",
            "simulation.runs=20",
            "noise.C=[1, -0.9736857494]",
            "simulation.noise={variance: 1.0e-10}",
        )
    )
    theory = outcome.result["simulation"]["inputs"]["design"]["theory"]["loss"]
    assert (theory["mean"], theory["sd"]) == pytest.approx((0.002283, 0.001015), rel=1e-3)


@pytest.mark.parametrize(
    ("words", "overrides"),
    [
        ("compared with white inputs", ["simulation.compare=[prbs]"]),
        ("model-reference and internal-model", [f"{CONTROL}={{minimum_variance: true}}"]),
        ("least squares", ["noise.C=[1, 0.5]"]),
        ("relative_std", ["simulation.noise={relative_std: 0.1}"]),
    ],
)
def test_unsupported_simulations_are_refused_with_a_reason(words, overrides):
    (told,) = refused(simulate, spec(*overrides))
    assert told.code == "not-supported"
    assert words in f"{told.message} {told.hint} {told.key}"


@pytest.mark.slow
def test_the_mean_losses_agree_with_the_monte_carlo_row_of_table_i():
    study = simulate(spec("signal.candidates=1")).result["simulation"]
    for name, mean in (("white", 0.002835), ("design", 0.002050)):
        loss = study["inputs"][name]["loss"]
        assert abs(loss["mean"] - mean) < 4 * loss["standard_error"]
