"""White excitation with the means of the design: its error is that of an analysis of just that excitation."""

import numpy as np
import pytest

from inputdesign_cli import analyse, parse_spec, solve
from tests.support.pages import LOOP, SPEC

PRIOR = ", prior: {information: [[30.0, 2.0], [2.0, 20.0]]}"
SHORTEST = ["objective=shortest_experiment", "limits={input_power: 0.7}"]


def error_of_white(text, power, samples):
    given = f"spectrum={{given: {{type: white, power: {power!r}}}}}"
    told = ["limits=null", "objective=null", f"experiment.samples={samples}", given]
    return np.array(analyse(parse_spec(text, overrides=told)).bound["r_u"])


@pytest.mark.parametrize("more", ["", LOOP, PRIOR])
def test_of_the_cheapest_experiment_at_its_cost(more):
    found = solve(parse_spec(SPEC % more))
    white = found.result["baseline"]["white"]
    expected = error_of_white(SPEC % more, white["power"]["excitation"][0] / white["ratio"], 100)
    np.testing.assert_allclose(found.bound["r_u_equal"][[0, -1]], expected[[0, -1]], rtol=1e-6)
    assert (found.bound["r_u_equal"] / found.bound["r_adm"]).max() > 1.0


def test_of_the_shortest_experiment_at_its_length():
    found = solve(parse_spec(SPEC % "", overrides=SHORTEST))
    samples = found.result["samples"]
    expected = error_of_white(SPEC % "", found.result["baseline"]["white"]["power"]["excitation"][0], samples)
    np.testing.assert_allclose(found.bound["r_u_equal"][[0, -1]], expected[[0, -1]], rtol=1e-6)


def test_of_the_best_experiment_within_limits_there_is_none():
    limited = ["objective=best_accuracy", "limits={input_power: 0.7}"]
    assert "r_u_equal" not in solve(parse_spec(SPEC % "", overrides=limited)).bound
