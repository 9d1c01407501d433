"""Designs under limits against plain programs in cvxpy, on a Gram matrix and a frequency grid."""

import dataclasses

import cvxpy as cp
import numpy as np
import pytest

from inputdesign_cli.accuracy import Criterion
from inputdesign_cli.design.convex.limits import DensityLimit, PowerLimit, implied_power
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import PolynomialModel
from tests.support.convex_designs import ORDER, check, criterion, relative, resonant, solve


def gram_program(problem, order, unit=1.0):
    """A FIR spectrum as a Gram matrix: (c, M as an expression, constraints), unknowns over `unit`."""
    scaled = cp.Variable(order + 1)
    c = unit * scaled
    gram = cp.Variable((order + 1, order + 1), PSD=True)
    constraints = [cp.trace(gram) == scaled[0]]
    constraints += [cp.sum(cp.diag(gram, k)) == scaled[k] for k in range(1, order + 1)]
    maps = problem.information_map
    M = problem.baseline_information + sum(c[i] * maps[i] for i in range(order + 1))
    return c, M, constraints


@pytest.mark.parametrize("letter", ["D", "A", "E", "T"])
def test_criteria_agree_with_a_plain_program(letter):
    """log_det, tr_inv, lambda_min and trace of cvxpy under two power limits."""
    model = PolynomialModel.single([0, 1.0, 0.4], A=[1, -0.8], variance=0.5)
    experiment = Experiment(model, 100)
    limits = [PowerLimit("input", 1.0), PowerLimit("output", 2.5)]
    design = solve(experiment, "factor", criterion(letter), limits=limits)
    check(design)
    raw = dataclasses.replace(design.problem, experiment=experiment, finer=None)
    c, M, constraints = gram_program(raw, ORDER)
    constraints += [raw.power(limit.kind).vector @ c <= limit.bound for limit in limits]
    value = {
        "D": lambda: cp.log_det(M),
        "A": lambda: -cp.tr_inv(M),
        "E": lambda: cp.lambda_min(M),
        "T": lambda: cp.trace(M),
    }[letter]()
    plain = cp.Problem(cp.Maximize(value), constraints).solve(solver=cp.CLARABEL)
    ours = Criterion(letter, np.eye(3))
    assert ours.value(1 / design.result.objective) == pytest.approx(plain, rel=1e-5)


@pytest.mark.slow
def test_capped_least_cost_agrees_with_a_plain_program():
    """A cost that pulls one way and a limit that pulls the other: input cost under a cap on the output."""
    experiment, kind, order = resonant(), "output", 10
    free = solve(experiment, requirements=relative(0.1), order=order)
    quiet = solve(experiment, requirements=relative(0.1), order=order, cost={"output": 1.0})
    loud = free.problem.power(kind).at(free.result.x)
    assert quiet.result.objective < 0.9 * loud
    bound = 0.5 * (quiet.result.objective + loud)
    limits = [PowerLimit(kind, bound)]
    design = solve(experiment, requirements=relative(0.1), order=order, limits=limits)
    check(design)
    assert design.result.objective > free.result.objective
    problem = design.problem
    c, M, constraints = gram_program(problem, order, unit=design.result.objective)
    scale, requirement = design.result.objective, problem.requirements[0]
    w = np.union1d(np.linspace(0.0, np.pi, 200), design.result.active_frequencies)
    K = np.linalg.inv(np.linalg.cholesky(design.result.information))
    for at in w:
        slack = K @ (M - requirement.cut(float(at)).matrix) @ K.T
        constraints.append(0.5 * (slack + slack.T) >> 0)
    constraints.append(problem.power(kind).vector @ c / bound <= 1.0)
    plain = cp.Problem(cp.Minimize(problem.price.vector @ c / scale), constraints).solve(solver=cp.CLARABEL)
    assert plain == pytest.approx(1.0, rel=1e-5)


def test_density_limits_agree_with_a_plain_program(first_order):
    """Upper and lower bounds on Phi at every frequency against 400 rows of them."""
    upper = DensityLimit(lambda w: 1.5 + 0.5 * np.cos(w), np.linspace(0.0, np.pi, 300))
    lower = DensityLimit(lambda w: np.full(np.shape(w), 0.02), np.linspace(0.0, np.pi, 300), upper=False)
    design = solve(first_order, requirements=relative(0.02), densities=[upper, lower])
    check(design)
    problem = design.problem
    c, M, constraints = gram_program(problem, ORDER)
    requirement = problem.requirements[0]
    w = np.linspace(0.0, np.pi, 400)
    constraints += [M - requirement.cut(float(at)).matrix >> 0 for at in np.linspace(0, np.pi, 60)]
    functions = np.array([problem.basis.density(x, w) for x in np.eye(problem.basis.size)]).T
    constraints += [functions @ c <= upper.level(w), functions @ c >= lower.level(w)]
    plain = cp.Problem(cp.Minimize(problem.price.vector @ c), constraints).solve(solver=cp.CLARABEL)
    assert design.result.objective == pytest.approx(plain, rel=1e-4)
    assert design.result.objective >= plain * (1 - 1e-6)


def test_implied_power_bounds_the_power_of_every_spectrum_below(first_order):
    density = DensityLimit(lambda w: 2.0 + np.cos(3 * w), np.linspace(0.0, np.pi, 500))
    assert implied_power(density).bound == pytest.approx(2.0, rel=1e-2)
    assert implied_power(density).bound >= 2.0
