"""Toeplitz moments: closed forms, reference values, independent searches, and bounds that are bounds."""

from functools import cache

import numpy as np
import pytest
import scipy.linalg

from inputdesign_cli.design.regression.branch import BranchAndBound
from inputdesign_cli.design.regression.lift import box_limits
from inputdesign_cli.design.regression.model import Regression
from inputdesign_cli.design.regression.structured import OutOfReachError, design_toeplitz
from inputdesign_cli.design.regression.toeplitz import ToeplitzProblem
from tests.support.regression import autocorrelations, general_search, mse, one_estimated_by_cvxpy

FOUR = ([0.94, 0.166], [2.245, 1.096], 0.5)


def regression(L1, L2, alpha, variance=1.0):
    return Regression(np.array(L1, dtype=float), np.array(L2, dtype=float), alpha, variance)


def design(r, **goal):
    return design_toeplitz(r, rng=np.random.default_rng(0), **goal)


@cache
def of_four(**goal):
    """The design of FOUR; no test may change it."""
    return design(regression(*FOUR), **goal)


def gap(found, value):
    return (value - found.bound) / value


@pytest.mark.parametrize(
    ("first", "second", "alpha", "variance", "target"),
    [
        *((1, 1, alpha, 1, 1) for alpha in (0.1, 1, 10)),
        *((1, 2, alpha, 1, 1) for alpha in (0.1, 0.5, 0.9, 0.99)),
        *((*taps, 0.4, 0.7, 1.5) for taps in ((1.0, 0.3), (0.5, -2.0), (-1.0, 1.0))),
        (1, 2, 0.0, 1, 0.5),  # only the variance counts; the least biased of the optima is taken
    ],
)
def test_designs_of_two_taps_have_their_closed_form(first, second, alpha, variance, target):
    """Examples 3 and 4, Figure 2, and others."""
    found = design(regression([first], [second], alpha, variance), target=target)
    slack = target - alpha**2 * max(abs(second) - abs(first), 0.0) ** 2
    assert found.energy == pytest.approx(2.0 * variance * first**2 / slack, rel=1e-8)
    assert 0.0 <= gap(found, found.energy) <= 1.1e-6
    if first == second or alpha != 0.4:
        np.testing.assert_allclose(found.R, np.full((2, 2), 0.5 * found.energy), rtol=1e-8)


@pytest.mark.first(1)
@pytest.mark.parametrize("alpha", [1.0, 1.2, 3.0])
def test_example_4_is_infeasible_from_alpha_one(alpha):
    with pytest.raises(OutOfReachError) as error:
        design(regression([1], [2], alpha), target=1.0)
    assert error.value.bias == pytest.approx(1.0, rel=1e-8)
    assert error.value.proved >= 1e6
    assert not error.value.assumed


REFERENCE = [
    (FOUR, {"target": 1.0}, 9.562917),
    (FOUR, {"energy": 8.0}, 1.072300),
    (([1], [1.2, 0.5], 0.5), {"target": 1.0}, 3.079436),
    (([1], [1.2, 0.5], 0.5), {"energy": 6.0}, 0.525796),
]


@pytest.mark.parametrize(("case", "goal", "value"), REFERENCE)
def test_designs_have_their_reference_values(case, goal, value):
    found = of_four(**goal) if case is FOUR else design(regression(*case), **goal)
    reached = found.energy if "target" in goal else found.split.total
    assert reached == pytest.approx(value, rel=1e-6)
    assert 0.0 <= gap(found, reached) <= 1.1e-6
    assert "assumed_smallest_eigenvalue" not in found.counts
    assert mse(found.R + 1e-13 * np.eye(len(found.R)), *map(np.array, case[:2]), case[2]) == pytest.approx(
        found.split.total, rel=1e-9
    )


@pytest.mark.first(3)
@pytest.mark.parametrize("seed", range(6))
def test_designs_for_one_estimated_parameter_agree_with_cvxpy(seed):
    rng = np.random.default_rng(seed)
    L1, L2 = rng.uniform(0.5, 2.0), rng.standard_normal(int(rng.integers(1, 5)))
    alpha, energy = rng.uniform(0.2, 1.5), rng.uniform(1.0, 20.0)
    found = design(regression([L1], L2, alpha), energy=energy)
    assert found.split.total == pytest.approx(one_estimated_by_cvxpy(L1, L2, alpha, energy=energy), rel=1e-6)
    assert 0.0 <= gap(found, found.split.total) <= 1.1e-6


@pytest.mark.first(2)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(
    ("m", "n", "seed"),
    [
        *((2, 4 + seed % 2, seed) for seed in range(6)),
        *((3 + n // 8, n, seed) for n in (6, 7, 8) for seed in range(3)),
    ],
)
def test_several_estimated_parameters_are_proved(m, n, seed):
    """The gap closes for two parameters; for more, the bound holds and no search beats the design."""
    rng = np.random.default_rng(seed if m == 2 else [n, seed])
    weights = rng.standard_normal(n)
    case = (weights[:m], weights[m:], rng.uniform(0.2, 1.0))
    found = design(regression(*case), energy=rng.uniform(2.0, 20.0))
    assert 0.0 <= gap(found, found.split.total) <= (1e-4 if m == 2 else 1.0)
    searched = general_search(*case, rng, energy=found.energy, starts=5 if m == 2 else 20)
    assert found.split.total <= searched * (1 + 1e-8)


@pytest.mark.first(2)
@pytest.mark.parametrize(("m", "n"), [(1, 3), (2, 4), (2, 5), (3, 5)])
def test_no_shape_in_a_box_beats_its_bound(m, n):
    """The certificate itself: random shapes in random boxes, wide and narrow, never fall below the bound."""
    rng = np.random.default_rng([m, n])
    weights = rng.standard_normal(n)
    problem = ToeplitzProblem.of(regression(weights[:m], weights[m:], 0.7))
    lift = BranchAndBound(problem).lift
    for width in (2.0, 0.5, 0.1, 0.01):
        for kappa in (0.03, 1.0, 10.0):
            centre = autocorrelations(rng.uniform(-0.8, 0.8, n - 1))
            head = centre[1:m]
            box = np.array([np.maximum(head - width / 2, -1), np.minimum(head + width / 2, 1)])
            largest_v = 50.0
            found = lift.bound(box, kappa, box_limits(problem, box, largest_v))
            shapes = [problem.evaluate(centre)]
            for _ in range(100):
                rho = autocorrelations(rng.uniform(-1, 1, n - 1))
                rho = centre + rng.random() * (rho - centre)
                inside = np.all(rho[1:m] >= box[0]) and np.all(rho[1:m] <= box[1])
                if inside:
                    shapes.append(problem.evaluate(rho))
            values = [s.bias_squared + kappa * s.v for s in shapes if s is not None and s.v <= largest_v]
            assert found.bound <= min(values) * (1 + 1e-9)


def test_weights_stay_within_their_limit():
    rng = np.random.default_rng(4)
    for _ in range(200):
        m = int(rng.integers(1, 5))
        problem = ToeplitzProblem.of(regression(rng.standard_normal(m), rng.standard_normal(2), 1.0))
        rho = autocorrelations(rng.uniform(-0.95, 0.95, m + 1))
        shape = problem.evaluate(rho)
        shift, width = rng.uniform(-0.5, 0.5, m - 1), 10.0 ** rng.uniform(-4, 0)
        box = rho[1:m] + (shift + np.array([[-0.5], [0.5]])) * width
        allowed = box_limits(problem, box, 1.01 * shape.v)
        u = problem.weights(scipy.linalg.toeplitz(rho))
        w = np.linalg.lstsq(allowed.D, u, rcond=None)[0]
        assert w @ w <= allowed.limit * (1 + 1e-6)
        assert allowed.least_v <= shape.v * (1 + 1e-9)


def test_a_proof_that_ends_early_has_a_bound(monkeypatch):
    """With few boxes the bound is weaker, but it is one: v is at least the square of each entry of L1."""
    best = of_four(target=1.0)
    monkeypatch.setattr("inputdesign_cli.design.regression.branch._NODES", 3)
    found = design(regression(*FOUR), target=1.0)
    assert found.counts["nodes"] <= 4
    assert 0.5 * best.energy < found.bound < best.bound
    assert found.energy == pytest.approx(best.energy, rel=1e-6)


def test_all_units_scale_out():
    """Weights times 3, noise times 5: the error grows by 9 and 25 at equal energy over noise."""
    L1, L2, alpha = FOUR
    plain = of_four(energy=8.0)
    scaled = design(regression(3 * np.array(L1), 3 * np.array(L2), alpha, 25.0), energy=8.0 * 25.0)
    assert scaled.split.total == pytest.approx(9.0 * plain.split.total, rel=1e-8)


def test_the_alternation_keeps_the_first_autocorrelation_of_its_start():
    """For m = 2 it keeps rho_1 of white noise, and its gap shows that; for m = 1 it finds the optimum."""
    found = design(regression(*FOUR), energy=8.0, alternating=True)
    assert found.rho[1] == pytest.approx(0.0, abs=1e-9)
    best = 1.072300
    assert found.split.total > best * 1.01
    assert gap(found, found.split.total) == pytest.approx(1.0 - best / found.split.total, abs=1e-5)
    single = design(regression([1], [1.2, 0.5], 0.5), energy=6.0, alternating=True)
    assert single.split.total == pytest.approx(0.525796, rel=1e-6)


@pytest.mark.slow
def test_infeasible_targets_of_two_parameters_are_refused():
    with pytest.raises(OutOfReachError) as error:
        design(regression([1, -0.3], [1, 4], 1.0), target=1.0)
    assert error.value.proved >= 1e4
    # A target above the least bias is feasible.
    least = error.value.bias**2 * 1.09
    assert np.isfinite(design(regression([1, -0.3], [1, 4], 1.0), target=1.5 * least).energy)
