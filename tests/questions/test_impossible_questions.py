"""Specs that cannot be had: what they are told, and that it is true."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve, validate
from inputdesign_cli.errors import DataError, InfeasibleError
from tests.support.first_order_specs import ERROR, FIR, complaint_of, run
from tests.support.refusals import refusal


def test_infeasible_limits_are_explained():
    least = run(ERROR + FIR)["cost"]
    diagnostic = complaint_of(ERROR + FIR + "limits: {input_power: 0.2}\n", InfeasibleError)
    assert (diagnostic.code, diagnostic.key) == ("infeasible", "limits.input_power")
    assert diagnostic.location is not None
    needed = float(diagnostic.message.split(">= ")[1].split(",")[0])
    assert least <= needed <= least * (1 + 1e-4)
    factor = float(diagnostic.hint.split("errors ")[1].split(" times")[0])
    assert factor == pytest.approx(np.sqrt(least / 0.2), rel=1e-3)
    assert "type: free" in diagnostic.hint  # 0.1925 is enough for one sinusoid
    # What the message promises is true.
    assert run(ERROR + FIR + f"limits: {{input_power: {needed * (1 + 1e-6)}}}\n")["cost"] <= needed


def test_infeasible_without_a_way_out_by_one_limit():
    limits = "limits: {input_power: 0.01, output_power: 0.1}\n"
    diagnostic = complaint_of(ERROR + FIR + limits, InfeasibleError)
    assert "no change of a single limit is enough" in diagnostic.message
    times = float(diagnostic.message.split("have to be ")[1].split(" times")[0])
    # What the message promises is true, and no overstatement.
    raised = (
        f"limits: {{input_power: {0.01 * times * (1 + 1e-4)}, output_power: {0.1 * times * (1 + 1e-4)}}}\n"
    )
    assert run(ERROR + FIR + raised)["status"] == "optimal"
    lowered = (
        f"limits: {{input_power: {0.01 * times * (1 - 1e-3)}, output_power: {0.1 * times * (1 - 1e-3)}}}\n"
    )
    assert complaint_of(ERROR + FIR + lowered, InfeasibleError).code == "infeasible"


def test_a_density_that_is_too_low_is_told_its_factor():
    # A flat spectrum needs 1.705495; below that level no spectrum has more at any frequency.
    diagnostic = complaint_of(ERROR + FIR + "limits: {spectrum: 1.5}\n", InfeasibleError)
    times = float(diagnostic.message.split("limits.spectrum would have to be ")[1].split(" times")[0])
    assert times == pytest.approx(1.705495 / 1.5, rel=1e-4)


def test_contradictory_limits():
    limits = "limits: {input_power: 0.3, output_power: {min: 300}}\n"
    diagnostic = complaint_of(ERROR + FIR + limits, InfeasibleError)
    assert diagnostic.code == "contradictory-limits"
    assert "output_power" in diagnostic.message
    assert "input_power" in diagnostic.message


def test_too_long():
    limits = "objective: shortest_experiment\nlimits: {input_power: 0.2, samples: 400}\n"
    diagnostic = complaint_of(ERROR + FIR + limits, InfeasibleError)
    assert (diagnostic.code, diagnostic.key) == ("too-long", "limits.samples")


def test_a_table_of_levels_must_be_in_order(tmp_path):
    table = tmp_path / "level.csv"
    table.write_text("frequency,phi\n1,1\n0,1\n", encoding="utf-8")
    text = ERROR + FIR + f"limits: {{spectrum: {{max: {{table: {table}}}}}}}\n"
    diagnostic = complaint_of(text, DataError, validate)
    assert diagnostic.code == "bad-table"


def test_what_only_noise_tells_is_out_of_reach_of_any_power():
    """Of y = G u + (1 - 0.5 q^-1) e the variance of c1 is (1 - 0.5^2) / N, whatever u is."""
    spec = parse_spec(
        "plant: {B: [0, 3.6], F: [1, -0.7]}\nnoise: {C: [1, -0.5], variance: 1.0}\n"
        "experiment: {samples: 500}\naccuracy: {standard_deviation: {c1: 0.01}}\n"
        "spectrum: {type: fir, order: 3}\n"
    )
    diagnostic = refusal(lambda: solve(spec), InfeasibleError)
    ratio = np.sqrt((1 - 0.25) / 500) / 0.01
    assert f"{ratio:.6g} times what is asked" in diagnostic.message
    assert f"{ratio**2:.4g} times as many samples" in diagnostic.hint
