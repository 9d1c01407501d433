"""Optima against the literature, textbook programs, scaling laws; certificates against random spectra."""

import dataclasses

import numpy as np
import pytest

from inputdesign_cli.accuracy import Absolute, Criterion
from inputdesign_cli.design.convex.coordinates import white_power, whitened_problem
from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.design.convex.designs import solve_design
from inputdesign_cli.design.convex.exchange import exchange
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.textbook import solve_on_grid
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import ContinuousModel, PolynomialModel
from inputdesign_cli.spectrum import PolynomialBasis
from tests.support.convex_designs import (
    DENSE,
    OnGrid,
    alternatives,
    around,
    asked,
    check,
    optimum,
    random_spectra,
    relative,
    solve,
)
from tests.support.plants import arrays, two_by_two
from tests.support.random_plants import random_case


def design(experiment, order):
    return solve(experiment, "cost", relative(), order)


QUICK = [1, 4, 6, 9]


@pytest.mark.first(4)
@pytest.mark.parametrize("seed", [*QUICK, *sorted({*range(240)} - {*QUICK})])
def test_designs_for_random_plants_meet_requirements_with_a_closed_gap(seed):
    case = random_case(seed)
    found = solve(case.experiment(), "cost", [case.requirement], case.order, cost=case.cost)
    check(found, 1e-5)


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


def test_a_grid_of_1000_points_underestimates_the_cost_of_a_resonant_plant(flexible):
    """The grid program agrees if its grid holds the active frequencies; 1000 other points are too few."""
    factories = relative(0.25, 3.55, (1e-3, np.pi))
    solution = solve(flexible, "cost", factories, 10, cost={"input": 1.0, "output": 1.0})
    active = solution.result.active_frequencies
    assert len(active) >= 3
    start = solution.white_power * solution.problem.basis.even
    grid = np.union1d(active, np.geomspace(1e-3, np.pi, 20))
    answer = solve_on_grid(solution.problem, solution.problem.requirements, grid, start)
    assert answer.cost == pytest.approx(solution.result.objective, rel=1e-5)
    plain = OnGrid(solution.problem.requirements[0], np.geomspace(1e-3, np.pi, 1000), most=5)
    coarse = exchange(dataclasses.replace(solution.problem, requirements=(plain,)), start, tolerance=1e-7)
    assert coarse.objective == pytest.approx(361.3817, abs=6e-4)  # by an independent solution
    assert solution.result.objective > 1.02 * coarse.objective


@pytest.mark.parametrize("plants", [0, 12])
def test_certificate_holds_for_random_spectra(first_order, plants):
    """price(x) >= sum_s tr(Y_s (M_s(x) - M0_s)) on the cone, so that no admissible x costs less."""
    others = alternatives(first_order, around(first_order, plants, 0.05, seed=1), 0.1)
    solution = solve(first_order, "cost", relative(0.1), others=others)
    problem, certificate = solution.problem, solution.result.certificate
    weights = certificate.weights
    assert np.sum(np.any(weights, axis=(1, 2))) >= (2 if plants else 1)
    assert np.linalg.eigvalsh(weights).min() >= -1e-12 * np.abs(weights).max()
    for x in random_spectra(np.random.default_rng(3), 8, 20 if plants else 200):
        excited = problem.informations(x) - problem.baselines
        assert problem.price.at(x) >= np.sum(weights * excited) * (1 - 1e-9)
        # scaled until it is admissible, it costs no less than the bound
        if problem.demands.worst_ratio(problem.informations(1e6 * x)).ratio <= 1:
            assert problem.price.at(1e6 * x) >= certificate.bound
    anything = solution.any_spectrum.certificate
    ratio = anything.value.density(DENSE) / anything.price.density(DENSE)
    assert ratio.max() == pytest.approx(1.0, abs=1e-6)
    if not plants:  # the ratio is one at the best sinusoid
        assert DENSE[ratio.argmax()] == pytest.approx(0.1553, abs=1e-3)
        assert solution.any_spectrum.objective == pytest.approx(0.001925467, rel=1e-6)


def least(experiment, order, fraction=0.01, alpha=2.45, price=1.0):
    return optimum(experiment, "cost", relative(fraction, alpha), order, cost={"input": price})


def test_richer_spectra_cost_less(first_order):
    costs = [least(first_order, order) for order in (1, 3, 10, 30)]
    assert costs == sorted(costs, reverse=True)
    white = design(first_order, 0)
    assert white.result.objective >= costs[0]
    assert costs[-1] >= white.any_spectrum.certificate.bound


def test_the_cost_scales_with_variance_samples_fraction_alpha_and_price(first_order):
    """Box-Jenkins without noise information on G: cost goes as variance / N and as (alpha / fraction)^2."""
    base = least(first_order, 6)
    louder = dataclasses.replace(first_order.model, covariance=np.array([[4.0]]))
    for found, times in (
        (least(Experiment(louder, 500), 6), 4),
        (least(Experiment(first_order.model, 1000), 6), 1 / 2),
        (least(first_order, 6, fraction=0.02), 1 / 4),
        (least(first_order, 6, alpha=4.9), 4),
        (least(first_order, 6, price=3.0), 3),
    ):
        assert found == pytest.approx(times * base, rel=1e-6)


@pytest.mark.slow
def test_a_plant_with_sixteen_parameters_is_designed_to_a_closed_gap():
    """An output-error plant of order 8, for which a face that shrank too much once made the method cycle."""
    rng = np.random.default_rng([1, 8])
    roots = rng.uniform(0.5, 0.9, 4) * np.exp(1j * rng.uniform(0.2, 2.9, 4))
    F = np.poly(np.concatenate([roots, roots.conj()])).real
    B = np.concatenate([[0.0], rng.normal(size=8)])
    z = np.exp(-1j * np.linspace(0.0, np.pi, 8001))
    B = B / np.abs(np.polyval(B[::-1], z) / np.polyval(F[::-1], z)).max()
    experiment = Experiment(PolynomialModel.single(B, F=F, variance=0.01), 1000)
    question = asked(experiment, "cost", relative(alpha=2.0, admissible=Absolute(0.1)), 40)
    design = solve_design(question, tolerance=1e-6, any_spectrum_tolerance=1e-3)
    assert design.result.gap <= 1e-6
    assert design.any_spectrum.gap <= 1e-3
    assert design.problem.demands.worst_ratio(design.result.informations).ratio <= 1.0 + 1e-9
    # The design over every spectrum is a relaxation: its bound is at most the cost.
    assert design.any_spectrum.certificate.bound <= design.result.objective


def random_plant(rng):
    """A 2 x 2 plant of second-order entries with natural frequencies within half a decade of 1 rad/s."""
    size = (2, 2)
    numerator = [[[rng.uniform(0.5, 5.0)] for _ in range(2)] for _ in range(2)]
    denominator = np.empty((*size, 3))
    for index in np.ndindex(*size):
        frequency, damping = 10 ** rng.uniform(-0.5, 0.5), rng.uniform(0.1, 1.0)
        denominator[index] = [frequency**2, 2 * damping * frequency, 1.0]
    return ContinuousModel.monic(arrays(numerator), arrays(denominator.tolist()), np.eye(2))


def case(seed):
    """The plant of the paper, or a random one: model, band, order, criterion, and whether S is complex."""
    if seed is None:
        return two_by_two(), (0.0, 2.0), 40, "E", False
    rng = np.random.default_rng(seed)
    low = float(rng.choice([0.0, 0.1, 0.5]))
    band, order = (low, low + float(rng.choice([0.5, 2.0, 6.0]))), int(rng.integers(4, 31))
    return random_plant(rng), band, order, "DAET"[seed % 4], seed % 3 == 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [None, *range(12)])
def test_criteria_of_two_inputs_have_a_closed_gap_and_a_positive_spectrum(seed):
    model, band, order, criterion, hermitian = case(seed)
    question = Question(
        Experiment(model, 1, band),
        PolynomialBasis(2, order, band, hermitian),
        "factor",
        [lambda experiment: Criterion(criterion, experiment.factor)],
        limits=[PowerLimit("input", 1000.0), PowerLimit("output", 1000.0)],
    )
    power = white_power(question)
    problem = whitened_problem(question, np.full(2, power / 2))
    found = exchange(problem, power * problem.basis.even, tolerance=1e-7)
    assert found.gap <= (1e-6 if seed is None else 1e-5)
    eigenvalues = np.linalg.eigvalsh(problem.basis.density(found.x, np.linspace(*band, 400)))
    assert eigenvalues.min() >= -1e-9 * eigenvalues.max()
