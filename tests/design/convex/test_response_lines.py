"""Lines for a frequency response: proportional powers, and linear programs against plain cvxpy ones."""

import cvxpy as cp
import numpy as np
import pytest

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.response_lines import (
    ResponseLines,
    ResponseProblem,
    UnreachableError,
    cheapest,
    most_accurate,
)


def random_problem(seed, *, floors):
    rng = np.random.default_rng(seed)
    n, caps = int(rng.integers(2, 12)), int(rng.integers(1, 4))
    needed, price = rng.uniform(0.1, 3.0, n), rng.uniform(0.0, 2.0, n)
    rows = rng.uniform(0.0, 2.0, (caps + floors, n))
    rows[:, rng.integers(n)] += 0.1
    used = rows @ needed
    # Floors that proportional powers within the caps just miss or just meet.
    bounds = [*(used[:caps] * rng.uniform(1.5, 4.0, caps)), *(used[caps:] * rng.uniform(0.5, 1.6, floors))]
    limits = [PowerLimit("output", float(b), i < caps, i) for i, b in enumerate(bounds)]
    return ResponseProblem(needed, price, tuple(limits), rows)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("floors", [0, 2])
def test_the_cheapest_lines_are_those_of_a_plain_program(seed, floors):
    problem = random_problem(seed, floors=floors)
    design = cheapest(problem)
    p = cp.Variable(problem.needed.size)
    held = [p >= problem.needed]
    for limit, row in zip(problem.limits, problem.rows, strict=True):
        held.append(row @ p <= limit.bound if limit.upper else row @ p >= limit.bound)
    plain = cp.Problem(cp.Minimize(problem.price @ p), held)
    plain.solve(solver=cp.CLARABEL)
    assert design.value == pytest.approx(plain.value, rel=1e-6)
    assert design.value == pytest.approx(problem.price @ design.powers, rel=1e-12)
    assert design.bound <= design.value * (1 + 1e-12)
    assert design.gap < 1e-8


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("floors", [0, 2])
def test_the_most_accurate_lines_are_those_of_a_plain_program(seed, floors):
    problem = random_problem(100 + seed, floors=floors)
    design = most_accurate(problem)
    p, s = cp.Variable(problem.needed.size), cp.Variable()
    held = [p >= s * problem.needed]
    for limit, row in zip(problem.limits, problem.rows, strict=True):
        held.append(row @ p <= limit.bound if limit.upper else row @ p >= limit.bound)
    plain = cp.Problem(cp.Maximize(s), held)
    plain.solve(solver=cp.CLARABEL)
    assert design.value == pytest.approx(plain.value, rel=1e-6)
    assert design.value == pytest.approx(np.min(design.powers / problem.needed), rel=1e-9)
    assert design.bound >= design.value * (1 - 1e-12)
    assert design.gap < 1e-8


def test_without_limits_every_line_just_meets_its_bound():
    lines = ResponseLines(
        np.ones((3, 1, 1)) + 0j, np.array([[0.5], [1.0], [2.0]]), np.array([0.1, 0.2, 0.1]).reshape(3, 1, 1)
    )
    needed = lines.needed(100)
    assert needed[:, 0] == pytest.approx([1.0, 0.5, 4.0])  # 2 Phi_v / (N r_adm^2)
    assert lines.ratios(lines.deviations(needed, 100)) == pytest.approx(1.0)
    problem = ResponseProblem(needed.ravel(), np.ones(3), (), np.zeros((0, 3)))
    assert cheapest(problem).powers == pytest.approx(needed.ravel())


def test_the_worst_output_of_an_input_sets_the_power_of_its_lines():
    admitted = np.array([[[0.1, 1.0], [0.2, 0.1]]])
    lines = ResponseLines(np.ones((1, 2, 2)) + 0j, np.array([[1.0, 4.0]]), admitted)
    needed = lines.needed(200)
    assert needed[0] == pytest.approx([2.0 / 200 / 0.01, 8.0 / 200 / 0.01])
    assert lines.ratios(lines.deviations(needed, 200)) == pytest.approx(1.0)


def test_limits_that_are_too_tight_say_by_how_much():
    limit = PowerLimit("input", 1.0)
    problem = ResponseProblem(np.array([1.0, 3.0]), np.ones(2), (limit,), np.ones((1, 2)))
    with pytest.raises(UnreachableError) as caught:
        cheapest(problem)
    assert caught.value.factor == pytest.approx(2.0)  # a quarter of the power: twice the deviation
    assert caught.value.limits == (limit,)


def test_limits_that_contradict_each_other_are_told():
    rows = np.array([[1.0, 1.0], [1.0, 1.0]])
    limits = (PowerLimit("input", 5.0), PowerLimit("output", 6.0, upper=False))
    problem = ResponseProblem(np.ones(2), np.ones(2), limits, rows)
    for solve in (cheapest, most_accurate):
        with pytest.raises(UnreachableError) as caught:
            solve(problem)
        assert np.isinf(caught.value.factor)
