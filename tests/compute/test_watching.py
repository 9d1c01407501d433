"""How far it is, is told to whoever watches: rounds in order with bounds that only rise, and counts."""

from itertools import pairwise

from inputdesign_cli import parse_spec, simulate, solve
from inputdesign_cli.compute.watching import Counted, Round, tell, watching

SPEC = """
plant: {B: [0, 1], F: [1, -0.7]}
noise: {variance: 1}
experiment: {samples: 500}
cost: {input_power: 1}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 4}
"""


def test_a_design_tells_its_rounds():
    told = []
    with watching(told.append):
        result = solve(parse_spec(SPEC)).result
    design = told[: result["solver"]["rounds"]]
    assert [done.number for done in design] == list(range(1, len(design) + 1))
    assert all(earlier.bound <= later.bound for earlier, later in pairwise(design))
    assert design[-1].bound == result["objective"]["lower_bound"]
    assert len(told) > len(design), "the bound over every spectrum has rounds of its own"


def test_what_comes_after_the_design_is_counted():
    """Fresh plants, then runs: what takes longest is not silent."""
    told = []
    uncertain = "uncertainty: {covariance: [[0.001, 0], [0, 4.0e-4]], scenarios: 3, fresh: 70}\n"
    with watching(told.append):
        simulate(parse_spec(f"{SPEC}{uncertain}simulation: {{runs: 120}}\n"))
    assert Counted("fresh plants", 70, 70) in told
    assert [str(one) for one in told[-2:]] == ["simulated runs: 100 of 120", "simulated runs: 120 of 120"]


def test_nobody_has_to_watch():
    tell(Round(1, 2.0, 1.0, 3))
    assert str(Round(1, 2.0, 1.0, 3)) == "round 1: 2, proved to 5.0e-01, 3 cuts"
