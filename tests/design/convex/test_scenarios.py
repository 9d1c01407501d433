"""Designs for several plants against plain programs, with their certificates and the bounds on their risk."""

import dataclasses
from math import comb

import cvxpy as cp
import numpy as np
import pytest
import scipy.optimize

from inputdesign_cli.accuracy import Criterion
from inputdesign_cli.design.convex.demands import Alternative, Demands, Question
from inputdesign_cli.design.convex.designs import solve_design
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.scenario_theory import risk_after, risk_before, samples_for, unlikely
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.spectrum import LinesBasis
from tests.support.convex_designs import alternatives, around, asked, check, random_spectra, relative
from tests.support.plants import stated


def question(experiment, others=(), *, goal="cost", order=8, fraction=0.1, **more):
    return asked(experiment, goal, relative(fraction), order, others=others, **more)


@pytest.mark.first(4)
@pytest.mark.parametrize(
    ("goal", "paid"),
    [
        *(("cost", "mean"), ("cost", "worst"), ("capped", "nominal"), ("capped", "mean")),
        *(("factor", "worst"), ("samples", "mean"), ("cost", "nominal"), ("capped", "worst")),
        *(("factor", "nominal"), ("factor", "mean"), ("samples", "nominal"), ("samples", "worst")),
    ],
)
def test_copies_of_the_nominal_plant_change_nothing(first_order, goal, paid):
    """The cost includes the output power, which each plant has of its own."""
    experiment = dataclasses.replace(first_order, samples=1) if goal == "samples" else first_order
    limits, goal = [] if goal == "cost" else [PowerLimit("output", 1.0)], goal.replace("capped", "cost")
    stated = question(experiment, cost={"input": 1.0, "output": 1.0}, goal=goal, limits=limits)
    once = solve_design(stated, tolerance=1e-8)
    same = Alternative(stated.experiment, stated.requirements)
    again = solve_design(dataclasses.replace(stated, others=[same] * 2, paid=paid), tolerance=1e-8)
    assert again.result.objective == pytest.approx(once.result.objective, rel=1e-6)
    assert again.any_spectrum.objective == pytest.approx(once.any_spectrum.objective, rel=1e-5)
    assert again.white_power == pytest.approx(once.white_power, rel=1e-9)


@pytest.mark.first(1)
@pytest.mark.filterwarnings("ignore:Solution may be inaccurate")
@pytest.mark.parametrize("paid", ["mean", "worst"])
def test_the_design_agrees_with_a_plain_program(first_order, paid):
    """One matrix inequality for each plant and frequency, a Gram matrix for positivity."""
    order, others = 6, alternatives(first_order, around(first_order, 3, 0.03, seed=2), 0.1)
    stated = question(first_order, others, order=order, cost={"input": 1.0, "output": 1.0}, paid=paid)
    design = solve_design(stated, tolerance=1e-8)
    check(design)
    unit, problem = design.result.objective, design.problem
    c = cp.Variable(order + 1)
    gram = cp.Variable((order + 1, order + 1), PSD=True)
    constraints = [cp.sum(cp.diag(gram, lag)) == c[lag] for lag in range(order + 1)]
    prices = [
        sum(problem.power(kind, None, s).vector for kind in ("input", "output"))
        for s in range(len(problem.scenarios))
    ]
    cost = (
        np.mean(prices, axis=0) @ c if paid == "mean" else cp.max(cp.hstack([price @ c for price in prices]))
    )
    grid = np.union1d(np.geomspace(0.01, np.pi, 20), design.result.active_frequencies)
    for s, (scenario, told) in enumerate(zip(problem.scenarios, design.result.informations, strict=True)):
        K = np.linalg.inv(np.linalg.cholesky(told))
        maps = K @ problem.information_maps[:, s] @ K.T
        M = K @ problem.baselines[s] @ K.T + sum(unit * c[i] * maps[i] for i in range(order + 1))
        for w in grid:
            slack = M - K @ scenario.requirements[0].cut(float(w)).matrix @ K.T
            constraints.append(0.5 * (slack + slack.T) >> 0)
    plain = cp.Problem(cp.Minimize(cost), constraints).solve(solver=cp.CLARABEL)
    assert plain == pytest.approx(1.0, rel=1e-5)


LAG = "plant: {parameters: {theta: 1}, continuous: {numerator: [theta], denominator: [1, theta]}}\n"


def test_the_robust_input_for_a_time_constant_between_a_tenth_and_ten_has_four_lines():
    """The worst relative variance 1 / (theta^2 M) at unit power is 12.69, computed by hand."""

    model = stated(LAG + "noise: {variance: 1}\n")

    def at(theta):
        experiment = Experiment(model.at([theta]), 1, (1e-3, 100.0))
        return Alternative(experiment, [lambda e: Criterion("A", e.model.theta[:, None] * factor(e))])

    def factor(e):
        return np.eye(1) if e.factor is None else e.factor

    nominal = at(1.0)
    design = solve_design(
        Question(
            nominal.experiment,
            LinesBasis.anywhere(1e-3, 100.0, 1),
            "factor",
            nominal.requirements,
            limits=[PowerLimit("input", 1.0)],
            others=[at(theta) for theta in np.geomspace(0.1, 10.0, 61)],
        ),
        tolerance=1e-6,
    )
    assert design.result.objective == pytest.approx(12.69, abs=0.05)
    assert design.result.certificate.bound == pytest.approx(design.result.objective, rel=1e-5)
    w, power = design.result.basis.lines(design.result.x)
    power = power[:, 0, 0].real
    places = [0.130, 0.558, 1.79, 7.70]
    near = np.argmin(np.abs(np.log(w[:, None] / places)), axis=1)
    for number, place in enumerate(places):
        mine = near == number
        assert np.exp(np.average(np.log(w[mine]), weights=power[mine])) == pytest.approx(place, rel=0.02)
    # One sinusoid: 1 / (theta^2 M) = (w^2 + theta^2)^2 / (theta w)^2, worst at both ends when it is best.
    assert max((1.0 + theta**2) ** 2 / theta**2 for theta in (0.1, 10.0)) == pytest.approx(102.0, abs=0.05)


def test_the_certificate_of_the_worst_cost_holds_for_random_spectra():
    """max_s cost_s >= a mean of the costs >= sum_s tr(Y_s (M_s - M0_s)), the mean over several plants."""
    nominal = Experiment(PolynomialModel.single([0, 1], F=[1, -1.6, 0.94]), 500)
    others = alternatives(nominal, [np.array([1.0, -1.6 + d, 0.94]) for d in (-0.1, 0.1)], 0.1)
    stated = question(nominal, others, order=8, cost={"output": 1.0}, paid="worst")
    design = solve_design(stated, tolerance=1e-7, any_spectrum_tolerance=None)
    certificate, problem = design.result.certificate, design.problem
    assert certificate.bound == pytest.approx(design.result.objective, rel=1e-7)
    assert np.sum(certificate.costs > 1e-3) >= 2
    assert certificate.costs.sum() == pytest.approx(1.0, abs=1e-12)
    paid = [problem.power("output", None, s).at(design.result.x) for s in range(3)]
    assert max(paid) == pytest.approx(design.result.objective, rel=1e-12)
    assert np.all(np.array(paid)[certificate.costs > 1e-3] > (1 - 1e-5) * max(paid))
    stated = dataclasses.replace(stated, paid="mean")
    other = solve_design(stated, tolerance=1e-7, any_spectrum_tolerance=None).result
    powers = np.array([problem.power("output", None, s).at(other.x) for s in range(3)])
    assert powers.mean() <= np.mean(paid) * (1 + 1e-7)
    assert powers.max() >= max(paid) * (1 - 1e-7)
    for x in random_spectra(np.random.default_rng(3), 8, 100):
        worth = np.sum(certificate.weights * (problem.informations(x) - problem.baselines))
        assert max(cost.at(x) for cost in problem.costs) >= worth * (1 - 1e-9)


def test_remembered_ratios_are_kept_only_for_the_same_plants_and_requirements(first_order):
    """A problem with another plant, or with other requirements, starts without remembered ratios."""
    problem = solve_design(question(first_order), tolerance=1e-6).problem
    assert problem.on(LinesBasis.anywhere(0.0, np.pi, 1)).demands is problem.demands
    elsewhere = dataclasses.replace(problem, experiment=problem.experiment.whitened(1.0))
    assert elsewhere.scenarios[0].experiment is elsewhere.experiment
    assert problem.with_requirements(lambda _: ()).scenarios[0].requirements == ()


@pytest.mark.parametrize("above", [0.3, 1.0, -np.inf])
def test_remembered_ratios_hide_no_violation(first_order, above):
    """Violations for a sequence of stronger and weaker spectra are compared with each scenario alone."""
    others = alternatives(first_order, around(first_order, 12, 0.05, seed=1), 0.1)
    problem = solve_design(question(first_order, others), tolerance=1e-4).problem
    demands, rng = Demands(problem.scenarios), np.random.default_rng(2)
    start = problem.basis.even
    scales = (0.05, 0.1, 0.101, 0.2, 0.5, 0.1, 0.02, 0.0201)
    for scale, one in zip(scales, random_spectra(rng, 8, len(scales)), strict=True):
        informations = problem.informations(scale * (start + 0.02 * one))
        found = demands.violations(informations, above=above)
        alone = [
            (number, violation)
            for number, (one, told) in enumerate(zip(problem.scenarios, informations, strict=True))
            for violation in one.requirements[0].violations(told, above=above)
        ]
        assert sorted((n, v.ratio, v.frequency) for n, v in found) == sorted(
            (n, v.ratio, v.frequency) for n, v in alone
        )
        few = demands.violations(informations, above=above, few=2)
        worst = [max((v.ratio for n, v in alone if n == number), default=0.0) for number, _ in few]
        assert bool(few) == bool(alone)
        if few:
            assert max(worst) == max(v.ratio for _, v in alone)


@pytest.mark.parametrize(("unknowns", "needed"), [(11, 476), (21, 752)])
def test_the_number_of_scenarios_before_the_design(unknowns, needed):
    """The binomial sum of Campi and Garatti (2008), Theorem 1, with eps = 0.05 and confidence 0.999."""
    assert samples_for(0.05, 1e-3, unknowns) == needed

    def tail(number):
        return sum(comb(number, i) * 0.05**i * 0.95 ** (number - i) for i in range(unknowns))

    assert tail(needed) <= 1e-3 < tail(needed - 1)
    assert unlikely(0.05, needed, unknowns) == pytest.approx(tail(needed), rel=1e-9)
    assert risk_before(needed, 1e-3, unknowns) == pytest.approx(0.05, abs=2e-4)


@pytest.mark.parametrize(("support", "risk"), [(1, 0.0576), (3, 0.0786), (5, 0.0968)])
def test_the_risk_once_the_support_is_known(support, risk):
    """The risk of 200 scenarios is the root of the polynomial of Campi and Garatti (2018), Theorem 2."""
    found = risk_after(200, 1e-3, support)
    assert found == pytest.approx(risk, abs=5e-5)
    t = 1.0 - found
    left = 1e-3 / 201 * sum(comb(m, support) * t ** (m - support) for m in range(support, 201))
    assert left == pytest.approx(comb(200, support) * t ** (200 - support), rel=1e-6)


def test_too_few_scenarios_have_a_risk_of_one_and_the_risk_grows_with_the_support():
    assert risk_before(5, 1e-3, 7) == risk_after(3, 1e-3, 3) == 1.0
    risks = [risk_after(100, 1e-3, k) for k in range(8)]
    assert risks == sorted(risks)


@pytest.mark.slow
def test_random_programs_keep_the_risk():
    """min c x subject to a x >= 1 for a on the unit circle's upper right: the violation is known exactly."""
    rng = np.random.default_rng(1)
    beta, number, broken = 0.05, 60, 0
    for _ in range(300):
        angles = rng.uniform(0.0, 0.5 * np.pi, number)
        rows = np.column_stack([np.cos(angles), np.sin(angles)])
        x = scipy.optimize.linprog([1.0, 1.0], A_ub=-rows, b_ub=-np.ones(number)).x
        support = int(np.sum(np.abs(rows @ x - 1.0) < 1e-9))
        phi = np.linspace(0.0, 0.5 * np.pi, 4001)
        violated = np.mean(np.cos(phi) * x[0] + np.sin(phi) * x[1] < 1.0)
        broken += violated > risk_after(number, beta, support)
    assert broken <= 300 * beta
