"""Optima against the literature, textbook programs, scaling laws; certificates against random spectra."""

import dataclasses

import numpy as np
import pytest

from inputdesign_cli.accuracy import ModelError, Relative
from inputdesign_cli.design.convex.designs import solve_design
from inputdesign_cli.design.convex.exchange import exchange
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.design.convex.textbook import solve_on_grid
from inputdesign_cli.information import Experiment
from inputdesign_cli.spectrum import FirBasis
from tests.support.on_grid import OnGrid
from tests.support.random_plants import random_case

DENSE = np.unique(np.concatenate([np.linspace(0.0, np.pi, 50001), np.geomspace(1e-5, np.pi, 50001)]))


def least_cost(experiment, basis, cost, factories, *, tolerance):
    return solve_design(Question(experiment, basis, "cost", factories, cost=cost), tolerance=tolerance)


def relative(model, fraction, alpha, band=(0.0, np.pi)):
    admissible = Relative(model, fraction, (0, 0))
    return [lambda e: ModelError(experiment=e, band=band, entry=(0, 0), admissible=admissible, alpha=alpha)]


def design(experiment, order, fraction=0.01, alpha=2.45, cost=None):
    return least_cost(
        experiment,
        FirBasis(1, order),
        cost or {"input": 1.0},
        relative(experiment.model, fraction, alpha),
        tolerance=1e-7,
    )


def solve_case(seed):
    case = random_case(seed)
    return case, least_cost(
        case.experiment(), FirBasis(1, case.order), case.cost, [case.requirement], tolerance=1e-7
    )


def check(case, solution):
    """Everything that a design promises, recomputed on dense grids."""
    result, problem = solution.result, solution.problem
    if solution.white_power == 0.0:
        assert problem.demands.worst_ratio(problem.baselines).ratio <= 1.0
        return
    assert result.gap <= 1e-5, case.name
    assert result.certificate.bound <= result.objective * (1 + 1e-9)
    requirement = problem.requirements[0]
    w = DENSE[(case.band[0] <= DENSE) & (case.band[1] >= DENSE)]
    assert requirement.ratios(result.information, w).max() <= 1 + 1e-6, case.name
    phi = problem.basis.density(result.x, DENSE)
    assert phi.min() >= -1e-6 * phi.max(), case.name
    assert result.objective <= problem.price.at(solution.white_power * problem.basis.even) * (1 + 1e-9)
    assert solution.any_spectrum.certificate.bound <= result.objective * (1 + 1e-9)
    # The bound over every spectrum against the cost of a spectrum of sinusoids that meets the accuracy.
    anything = solution.any_spectrum
    assert anything.certificate.bound >= anything.objective * (1 - 1e-4), case.name
    assert requirement.ratios(anything.information, w).max() <= 1 + 1e-6, case.name


@pytest.mark.first(4)
@pytest.mark.parametrize("seed", [1, 4, 6, 9, 14, 19, 24, 30, 37, 43, 48, 57])
def test_random_plants(seed):
    check(*solve_case(seed))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(240))
def test_many_random_plants(seed):
    check(*solve_case(seed))


@pytest.mark.first(3)
@pytest.mark.parametrize("positivity", ["gram", "kyp"])
@pytest.mark.parametrize("order", [1, 4, 9])
def test_grid_program_agrees_where_the_grid_holds_the_active_frequencies(first_order, positivity, order):
    """The papers' own program, given the frequencies that bind, has the same optimum."""
    solution = design(first_order, order)
    active = solution.result.active_frequencies
    grid = np.union1d(np.linspace(0.01, np.pi, 25), active)
    start = solution.white_power * solution.problem.basis.even
    answer = solve_on_grid(
        solution.problem, solution.problem.requirements, grid, start, positivity=positivity
    )
    assert answer.cost == pytest.approx(solution.result.objective, rel=1e-5)
    assert answer.certificate.bound == pytest.approx(solution.result.objective, rel=1e-4)


def test_grid_program_agrees_with_several_active_frequencies(flexible):
    model = flexible.model
    factories = relative(model, 0.25, 3.55, (1e-3, np.pi))
    solution = least_cost(flexible, FirBasis(1, 10), {"input": 1.0, "output": 1.0}, factories, tolerance=1e-7)
    active = solution.result.active_frequencies
    assert len(active) >= 3
    start = solution.white_power * solution.problem.basis.even
    grid = np.union1d(active, np.geomspace(1e-3, np.pi, 20))
    answer = solve_on_grid(solution.problem, solution.problem.requirements, grid, start)
    assert answer.cost == pytest.approx(solution.result.objective, rel=1e-5)


def test_a_plain_grid_understates_the_cost_of_a_resonant_plant(flexible):
    """The 1000-point logarithmic grid gives 361.3817 at m = 10 (independent solution): too little."""
    model = flexible.model
    factories = relative(model, 0.25, 3.55, (1e-3, np.pi))
    solution = least_cost(flexible, FirBasis(1, 10), {"input": 1.0, "output": 1.0}, factories, tolerance=1e-7)
    requirement = solution.problem.requirements[0]
    grid = np.geomspace(1e-3, np.pi, 1000)

    problem = dataclasses.replace(solution.problem, requirements=(OnGrid(requirement, grid, most=5),))
    coarse = exchange(problem, solution.white_power * problem.basis.even, tolerance=1e-7)
    assert coarse.objective == pytest.approx(361.3817, abs=6e-4)
    assert solution.result.objective > 1.02 * coarse.objective


def test_certificate_holds_for_random_spectra(first_order):
    """price(x) >= tr(Y M(x)) for every nonnegative x, so the bound is one for every admissible x."""
    solution = design(first_order, 8)
    problem, Y = solution.problem, solution.result.certificate.weights[0]
    assert np.linalg.eigvalsh(Y)[0] >= -1e-12 * np.trace(Y)
    rng = np.random.default_rng(3)
    for _ in range(200):
        taps = rng.normal(size=9)
        x = np.correlate(taps, taps, mode="full")[8:]
        excited = problem.information(x) - problem.baseline_information
        assert problem.price.at(x) >= np.sum(Y * excited) * (1 - 1e-9)
        # scaled until it is admissible, it costs no less than the bound
        if problem.demands.worst_ratio(problem.informations(1e6 * x)).ratio <= 1:
            assert problem.price.at(1e6 * x) >= solution.result.certificate.bound


def test_equivalence_theorem(first_order):
    """Over every spectrum: the ratio is at most one everywhere, one at the sinusoid of the design."""
    solution = design(first_order, 2)
    anything = solution.any_spectrum
    value = solution.problem.value(anything.certificate.weights)
    ratio = value.density(DENSE) / solution.problem.price.density(DENSE)
    assert ratio.max() == pytest.approx(1.0, abs=1e-6)
    assert DENSE[ratio.argmax()] == pytest.approx(0.1553, abs=2e-4)
    assert anything.objective == pytest.approx(0.1925467, rel=1e-6)


def test_richer_spectra_cost_less(first_order):
    costs = [design(first_order, order).result.objective for order in (0, 1, 3, 10, 30)]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] >= design(first_order, 0).any_spectrum.certificate.bound


def test_scaling_laws(first_order):
    """Box-Jenkins without noise information on G: cost goes as variance / N and as (alpha / fraction)^2."""
    base = design(first_order, 6).result.objective
    louder = dataclasses.replace(first_order.model, covariance=np.array([[4.0]]))
    assert design(Experiment(louder, 500), 6).result.objective == pytest.approx(4 * base, rel=1e-6)
    assert design(Experiment(first_order.model, 1000), 6).result.objective == pytest.approx(
        base / 2, rel=1e-6
    )
    assert design(first_order, 6, fraction=0.02).result.objective == pytest.approx(base / 4, rel=1e-6)
    assert design(first_order, 6, alpha=4.9).result.objective == pytest.approx(4 * base, rel=1e-6)
    assert design(first_order, 6, cost={"input": 3.0}).result.objective == pytest.approx(3 * base, rel=1e-6)


def test_enough_prior_information_needs_no_excitation(first_order):
    known = dataclasses.replace(first_order, prior=1e9 * np.eye(3))
    solution = design(known, 5)
    assert solution.white_power == 0.0
    assert solution.result.objective == 0.0


def test_prior_information_makes_the_experiment_cheaper(first_order):
    once = design(first_order, 5)
    half = 0.5 * once.problem.experiment.to_raw(once.result.information)
    cheaper = design(dataclasses.replace(first_order, prior=half), 5)
    assert cheaper.result.objective == pytest.approx(0.5 * once.result.objective, rel=1e-2)
