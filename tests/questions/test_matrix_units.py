"""Designs with several inputs whatever their units, their limits and the order of their spectra."""

import pytest

from inputdesign_cli import solve
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.specification import parse_spec
from tests.support.matrix_specs import changed

GAINS = """
plant: {A: [[1, -0.7], [1, 0.4]], B: [[[0, 1.0, 0.4], [0, -0.5, 0.3]], [[0, 0.6, 0.2], [0, 1.2, -0.5]]]}
noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1}}
"""
# u2 in thousandths: its coefficients are a thousand times smaller, its power 1e6 times larger.
MILLI = "plant.B=[[[0, 1.0, 0.4], [0, -0.0005, 0.0003]], [[0, 0.6, 0.2], [0, 0.0012, -0.0005]]]"


@pytest.mark.first(1)
@pytest.mark.parametrize("spectrum", ["{type: fir, order: 4}", "{type: free}"])
@pytest.mark.parametrize(
    ("asked", "same"),
    [
        (["cost={input_power: [1, 1]}"], ["cost={input_power: [1, 1.0e-6]}"]),
        (
            ["limits={input_power: [2, 1]}", "objective=best_accuracy"],
            ["limits={input_power: [2, 1.0e6]}", "objective=best_accuracy"],
        ),
        (
            ["limits={input_power: [2, 1]}", "objective=shortest_experiment"],
            ["limits={input_power: [2, 1.0e6]}", "objective=shortest_experiment"],
        ),
    ],
)
def test_the_units_of_the_inputs_do_not_matter(spectrum, asked, same):
    found = []
    for overrides in (asked, [*same, MILLI]):
        spec = changed(GAINS, f"spectrum={spectrum}", *overrides)
        found.append(build_convex(spec).designed().design)
    assert found[1].result.objective == pytest.approx(found[0].result.objective, rel=1e-6)
    bounds = [design.any_spectrum.certificate.bound for design in found]
    assert bounds[1] == pytest.approx(bounds[0], rel=2e-5)


def test_a_limit_that_hardly_matters_does_not_spoil_the_proof():
    """Input 1 may have nearly any power: what it is worth is below the accuracy of a solver."""
    spec = parse_spec(
        "plant: {A: [[1, -0.35], [1, -0.3]], B: [[[0, 1.4, -0.7], [0, 0.3]], [[0, -0.2], [0, 1.4, -0.2]]]}\n"
        "noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}\nexperiment: {samples: 500}\n"
        "accuracy: {criterion: E}\nspectrum: {type: fir, order: 6}\n"
        "limits: {input_power: [1000000.0, 2.5]}\n"
    )
    result = build_convex(spec).designed().design.result
    assert result.gap < 1e-6


def test_a_spectrum_of_order_zero_is_white_in_time():
    """No better than order one, and no worse than the best flat spectrum, which is one of its members."""
    costs = [
        solve(
            changed(GAINS, f"spectrum={{{kind}}}", "signal.candidates=1", "solver.any_spectrum=false")
        ).result["cost"]
        for kind in ("type: fir, order: 1", "type: fir, order: 0", "type: white")
    ]
    assert costs[0] < costs[1] < costs[2]


@pytest.mark.slow
def test_free_spectra_of_unequal_limits_are_proved():
    """Many rounds pass here before a sinusoid is found that pays: no reason to stop."""
    spec = changed(
        "plant: {B: [[[0, 1.0], [0, -0.5]], [[0, 0.6], [0, 1.2]]],\n"
        "  F: [[[1, -0.7], [1, 0.3]], [[1, -0.5], [1, -0.8]]]}\n"
        "noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}\nexperiment: {samples: 500}\n"
        "accuracy: {model_error: {relative: 0.1}}\nobjective: best_accuracy\n"
        "limits: {input_power: [2, 1]}\nspectrum: {type: free}\n"
    )
    assert build_convex(spec).designed().design.result.gap < 1e-6
