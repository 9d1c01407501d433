"""Design goals against each other, plain programs and published examples, and proofs of infeasibility."""

import dataclasses

import cvxpy as cp
import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.accuracy import (
    Criterion,
    EllipsoidError,
    InformationTarget,
    ModelError,
    WeightedVariance,
)
from inputdesign_cli.design.convex.coordinates import least_white_power
from inputdesign_cli.design.convex.exchange import exchange
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.limits import DensityLimit, PowerLimit, implied_power
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import PolynomialModel, zero_order_hold
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.spectrum import LinesBasis
from tests.support.convex_designs import (
    ORDER,
    OnGrid,
    alone,
    anywhere,
    check,
    criterion,
    gram_program,
    optimum,
    relative,
    resonant,
    solve,
)
from tests.support.refusals import refused


@pytest.mark.first(1)
@pytest.mark.parametrize("case", ["first_order", "flexible"])
def test_goals_are_inverse_to_each_other(case, request):
    """With the least power as the limit, the best factor is one and the shortest experiment has N samples."""
    experiment = request.getfixturevalue(case)
    fraction, alpha = (0.01, 2.45) if case == "first_order" else (0.3, 3.55)
    factories = relative(fraction, alpha)
    least = solve(experiment, requirements=factories, cost={"input": 1.0})
    limits = [PowerLimit("input", least.result.objective)]
    best = solve(experiment, "factor", factories, limits=limits)
    check(best)
    assert best.result.objective == pytest.approx(1.0, abs=1e-6)
    one = dataclasses.replace(experiment, samples=1)
    shortest = solve(one, "samples", factories, limits=limits)
    check(shortest)
    assert shortest.result.objective == pytest.approx(experiment.samples, rel=1e-6)
    if case == "first_order":  # nothing is learnt about G without excitation: N times the power is fixed
        limits = [PowerLimit("input", 4 * least.result.objective)]
        assert optimum(one, "samples", factories, limits=limits) == pytest.approx(
            experiment.samples / 4, rel=1e-6
        )


def test_enough_prior_information_needs_no_excitation(first_order):
    known = dataclasses.replace(first_order, prior=1e9 * np.eye(3))
    solution = solve(known, requirements=relative())
    assert (solution.white_power, solution.result.objective) == (0.0, 0.0)


def test_a_power_limit_raises_the_cost_only_where_it_binds(first_order):
    """A lower limit above the optimal power raises the cost; a lower one, or a high upper limit, does not."""
    plain = solve(first_order, requirements=relative())
    roomy = solve(first_order, requirements=relative(), limits=[PowerLimit("input", 10.0)])
    assert roomy.result.objective == plain.result.objective
    assert roomy.result.certificate.limits == pytest.approx([0.0])
    power = plain.problem.power("output").at(plain.result.x)
    low = solve(first_order, requirements=relative(), limits=[PowerLimit("output", 0.5 * power, upper=False)])
    high = solve(
        first_order, requirements=relative(), limits=[PowerLimit("output", 1.5 * power, upper=False)]
    )
    check(low)
    check(high)
    assert low.result.objective == pytest.approx(plain.result.objective, rel=1e-6)
    assert high.result.objective > plain.result.objective
    assert high.problem.power("output").at(high.result.x) == pytest.approx(1.5 * power, rel=1e-6)


def test_the_multiplier_of_a_limit_is_the_slope_of_the_cost():
    """The multiplier of a limit is minus the derivative of the cost with respect to it."""
    experiment, asked = resonant(), relative(0.1)
    quiet = optimum(experiment, requirements=asked, cost={"output": 1.0})
    middle, step = 1.05 * quiet, 1e-3 * quiet
    low, high = (
        alone(experiment, requirements=asked, limits=[PowerLimit("output", middle + d)])
        for d in (-step, step)
    )
    slope = (high.objective - low.objective) / (2 * step)
    assert slope < 0
    prices = [one.certificate.limits[0] for one in (low, high)]
    assert np.mean(prices) == pytest.approx(-slope, rel=1e-3)


def test_the_exact_ellipsoid_costs_slightly_more_than_the_linearisation(first_order):
    """With r_adm = 0.01 |G| the exact region costs more than the linear one, by less than 5 %."""
    exact = solve(first_order, requirements=relative(kind=EllipsoidError))
    check(exact)
    linear = optimum(first_order, requirements=relative(kind=ModelError))
    assert linear < exact.result.objective < 1.05 * linear


def test_application_example_of_moose2():
    """y = 10 u(t-1) - 9 u(t-2) + e: chi2(0.95, 2) * 100 / 2 * 2 = N c_0 for b2, by hand 1.1982929."""
    experiment = Experiment(PolynomialModel.single([0, 10.0, -9.0]), 500)
    target = 5.991464547107979 * 100 / 2 * np.diag([0.0, 2.0])
    design = solve(experiment, requirements=[lambda e: InformationTarget(e.whiten_matrix(target))], order=19)
    check(design)
    assert design.result.objective == pytest.approx(1.1982929, rel=1e-5)
    assert design.result.objective == pytest.approx(5.991464547107979 * 100 / 500, rel=1e-7)


@pytest.mark.parametrize(("letter", "value"), [("A", -1.0412035), ("E", 1.0), ("D", 4.6912898)])
def test_criteria_of_the_moose2_example(letter, value):
    experiment = Experiment(PolynomialModel.single([1.0], A=[1, 0.95]), 1)
    design = solve(experiment, "factor", criterion(letter), order=19, limits=[PowerLimit("input", 1.0)])
    check(design)
    ours = Criterion(letter, np.eye(2))
    assert ours.value(1 / design.result.objective) == pytest.approx(value, rel=1e-5)
    if letter == "D":
        assert ours.value(1 / design.any_spectrum.objective) == pytest.approx(4.7488407, rel=1e-5)


def test_weighted_variance_example_of_moose2():
    """The cost is 0.8726511 at every frequency, and 0.5692322 on the grid of 100 points of MOOSE2."""
    A = [1, -1.99185, 2.20265, -1.84083, 0.89413]
    experiment = Experiment(PolynomialModel.single([0, 0, 0, 0.10276, 0.18123], A=A, variance=0.05), 500)
    asked = {"band": (0.0, np.pi), "entry": (0, 0), "limit": 0.01, "relative": True}
    asked["weight"] = zero_order_hold([0.16], [1, 0.56, 0.16], 1.0)
    design = solve(experiment, requirements=[lambda e: WeightedVariance(experiment=e, **asked)], order=19)
    check(design)
    assert design.result.objective == pytest.approx(0.8726511, rel=1e-5)
    requirement = design.problem.requirements[0]
    grid = np.linspace(1e-3, np.pi, 100)

    coarse = dataclasses.replace(design.problem, requirements=(OnGrid(requirement, grid),))
    answer = exchange(coarse, design.white_power * coarse.basis.even, tolerance=1e-7)
    assert answer.objective == pytest.approx(0.5692322, rel=1e-5)


@pytest.mark.parametrize("alone", [False, True])
def test_the_factor_by_which_limits_must_be_loosened_is_proved(first_order, alone):
    """Half the least power must be doubled. Two limits contradict each other if the output power exceeds the
    input power times the peak of |G|^2, 144.
    """
    limits = [PowerLimit("output", 288.0, upper=False), PowerLimit("input", 1.0)]
    more = {"basis": anywhere()} if alone else {}
    if not alone:
        limits = [PowerLimit("input", 0.5 * optimum(first_order, requirements=relative()))]
    with pytest.raises(UnreachableError) as caught:
        solve(first_order, requirements=relative(), limits=limits, **more)
    expected = 288.0 / 144.0 if alone else 2.0
    assert caught.value.nearest.certificate.bound == pytest.approx(expected, rel=1e-4)
    assert caught.value.limits_alone == alone


def test_too_few_lines_are_refused():
    B, A = [0, 1.0, 0.5], [1, -0.5, 0.3]
    experiment = Experiment(PolynomialModel.single(B, A=A), 100000)
    oe = Experiment(PolynomialModel.single(B, F=A), 100)
    found = refused(solve, oe, requirements=relative(0.1), basis=LinesBasis.at(np.array([0.4]), 1))
    assert found[0].code == "too-few-lines"
    # ARX learns from the noise as well, so that a modest accuracy is within reach of a single line.
    line = LinesBasis.at(np.array([0.4]), 1)
    assert solve(experiment, requirements=relative(0.3), basis=line).result.gap <= 1e-6
    with pytest.raises(InfeasibleError):
        solve(experiment, requirements=relative(0.001), basis=line)


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
    """The input power is least under an upper limit on the output power, which binds."""
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
    """Bounds on Phi from above and below at every frequency agree with bounds at 400 frequencies."""
    upper = DensityLimit(lambda w: 1.5 + 0.5 * np.cos(w), np.linspace(0.0, np.pi, 300))
    lower = DensityLimit(lambda w: np.full(np.shape(w), 0.02), np.linspace(0.0, np.pi, 300), upper=False)
    design = solve(first_order, requirements=relative(0.02), densities=[upper, lower])
    check(design)
    problem = design.problem
    c, M, constraints = gram_program(problem, ORDER)
    requirement = problem.requirements[0]
    w = np.linspace(0.0, np.pi, 400)
    places = np.union1d(np.linspace(0, np.pi, 9), design.result.active_frequencies)
    constraints += [M - requirement.cut(float(at)).matrix >> 0 for at in places]
    functions = np.array([problem.basis.density(x, w) for x in np.eye(problem.basis.size)]).T
    constraints += [functions @ c <= upper.level(w), functions @ c >= lower.level(w)]
    plain = cp.Problem(cp.Minimize(problem.price.vector @ c), constraints).solve(solver=cp.CLARABEL)
    assert design.result.objective == pytest.approx(plain, rel=1e-4)
    assert design.result.objective >= plain * (1 - 1e-6)


def test_implied_power_bounds_the_power_of_every_spectrum_below(first_order):
    density = DensityLimit(lambda w: 2.0 + np.cos(3 * w), np.linspace(0.0, np.pi, 500))
    assert implied_power(density).bound == pytest.approx(2.0, rel=1e-2)
    assert implied_power(density).bound >= 2.0


COLOURED = """
plant: {B: [0, %g], F: [1, 0.0]}
noise: {C: [1, 0.0], variance: 1.0}
experiment:
  samples: 400
  prior: {parameters: [b1, c1, f1], information: [[%g, 0, 0], [0, 100, 40], [0, 40, %g]]}
accuracy: {model_error: {relative: 0.1}, standard_deviation: {c1: %g}}
spectrum: {type: fir, order: 2}
"""


def asked(gain, deviation):
    """The question with its input in another unit; the prior correlates c1 and f1."""
    text = COLOURED % (gain, 50.0 / gain**2, 50.0, deviation)
    return build_convex(parse_spec(text)).asked.question


@pytest.mark.parametrize("gain", [1e-6, 1.0, 1e6])
def test_an_accuracy_that_no_input_power_reaches_is_refused_in_any_units(gain):
    """Where b1 and f1 are known, var c1 = 1 / (100 + N): the ratio that stays is 1 / (sqrt(500) 0.03)."""
    question = asked(gain, 0.03)
    complaints = refused(least_white_power, question.experiment, question.requirements, kind=InfeasibleError)
    assert f"{1.0 / np.sqrt(500.0) / 0.03:.6g} times" in complaints[0].message
    within, other = asked(gain, 0.06), asked(1.0, 0.06)
    power = least_white_power(other.experiment, other.requirements)
    assert power > 0.0
    found = least_white_power(within.experiment, within.requirements)
    assert gain**2 * found == pytest.approx(power, rel=1e-9)
