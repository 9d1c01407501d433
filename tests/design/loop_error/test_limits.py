"""Several power limits: the dual's gap, the certificate, and a plain grid program by cvxpy."""

import numpy as np
import pytest

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.loop_error import design_within
from inputdesign_cli.design.loop_error.closed_form import error_of, power_of
from inputdesign_cli.design.loop_error.problem import metric
from tests.support.loop_error import adjoint, column, random_complex, random_hermitian


def case(n, K, seed):
    rng = np.random.default_rng(seed)
    A = random_hermitian(rng, K, n)
    G = random_complex(rng, K, n, n)
    units = [np.diag(row) for row in np.eye(n)]
    metrics = [np.broadcast_to(u.astype(complex), (K, n, n)) for u in units]
    metrics += [adjoint(G) @ u @ G for u in units]
    return A, np.array(metrics), rng.uniform(0.5, 5.0, 2 * n), np.full(K, 1 / K)


def grid_program(A, metrics, limits, weights):
    """The textbook program: a complex matrix inequality for each frequency, in cvxpy."""
    import cvxpy as cp

    K, n, _ = A.shape
    Phi = [cp.Variable((n, n), hermitian=True) for _ in range(K)]
    Q = [cp.Variable((n, n), hermitian=True) for _ in range(K)]
    root = power_of(A, 0.5)
    constraints = [cp.bmat([[Q[k], root[k]], [root[k], Phi[k]]]) >> 0 for k in range(K)]
    for M, limit in zip(metrics, limits, strict=True):
        constraints.append(cp.real(sum(weights[k] * cp.trace(M[k] @ Phi[k]) for k in range(K))) <= limit)
    value = cp.real(sum(weights[k] * cp.trace(Q[k]) for k in range(K)))
    return cp.Problem(cp.Minimize(value), constraints).solve(solver=cp.CLARABEL)


@pytest.mark.first(6)
@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_the_gap_closes_and_the_certificate_holds(n, seed):
    A, metrics, limits, weights = case(n, 96, seed)
    design = design_within(A, metrics, limits, weights)
    assert abs(design.gap) < 1e-10
    powers = np.einsum("pkab,kba,k->p", metrics, design.spectrum, weights).real
    assert np.all(powers <= limits * (1 + 1e-12))
    np.testing.assert_allclose(powers, design.powers, rtol=1e-10)
    np.testing.assert_allclose(error_of(A, design.spectrum) @ weights, design.value, rtol=1e-12)
    # The bound is the dual function written out, and it belongs to nonnegative multipliers.
    assert np.all(design.multipliers >= 0)
    M = np.einsum("p,pkab->kab", design.multipliers, metrics)
    root = power_of(A, 0.5)
    values = np.linalg.eigvalsh(root @ M @ root)
    dual = 2 * np.sqrt(np.maximum(values, 0)).sum(axis=1) @ weights - design.multipliers @ limits
    np.testing.assert_allclose(design.lower_bound, dual, rtol=1e-10)
    # Complementarity: only limits that bind have a price.
    slack = 1 - powers / limits
    assert np.max(design.multipliers * limits * slack) < 1e-9 * design.value


@pytest.mark.parametrize("seed", range(2))
def test_the_optimum_is_that_of_the_grid_program(seed):
    A, metrics, limits, weights = case(2, 12, seed)
    design = design_within(A, metrics, limits, weights)
    assert design.value == pytest.approx(grid_program(A, metrics, limits, weights), rel=2e-6)


def test_one_total_limit_is_the_closed_form():
    A, _, _, weights = case(3, 64, 3)
    design = design_within(
        A, np.broadcast_to(np.eye(3, dtype=complex), (1, 64, 3, 3)), np.array([2.5]), weights
    )
    root = power_of(A, 0.5)
    total = np.trace(root, axis1=1, axis2=2).real @ weights
    np.testing.assert_allclose(design.spectrum, root * 2.5 / total, rtol=1e-10, atol=1e-12)
    assert design.value == pytest.approx(total**2 / 2.5, rel=1e-12)


def test_the_value_falls_as_one_over_the_limits():
    A, metrics, limits, weights = case(2, 64, 5)
    once, twice = (design_within(A, metrics, f * limits, weights) for f in (1.0, 2.0))
    assert twice.value == pytest.approx(once.value / 2, rel=1e-10)


def test_a_limit_that_does_not_bind_has_no_price():
    A, metrics, limits, weights = case(2, 64, 6)
    limits[3] = 1e6
    design = design_within(A, metrics, limits, weights)
    without = design_within(A, metrics[:3], limits[:3], weights)
    assert design.value == pytest.approx(without.value, rel=1e-9)
    assert design.multipliers[3] * limits[3] < 1e-9 * design.value


def test_the_column_with_a_limit_for_each_input_and_output():
    limits = (
        PowerLimit("input", 1.2, channel=0),
        PowerLimit("input", 0.6, channel=1),
        PowerLimit("output", 1e-3, channel=0),
        PowerLimit("output", 1e-3, channel=1),
    )
    problem = column(limits=limits)
    design, rule, change = problem.asymptotic()
    assert abs(design.gap) < 1e-10
    assert change < 1e-10
    again = problem.spectrum_at(rule.nodes, design.multipliers)
    ratio = np.trace(design.spectrum, axis1=1, axis2=2).real / np.trace(again, axis1=1, axis2=2).real
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)


@pytest.mark.parametrize("w", [0.0, 0.3, 2.0])
def test_the_power_of_moves_is_that_of_differences(w):
    """A sinusoid of power one moves from sample to sample with power |1 - exp(-jw)|^2 = 2 - 2 cos w."""
    found = metric(PowerLimit("moves", 1.0, channel=1), w, np.ones((1, 2, 2), dtype=complex))
    np.testing.assert_allclose(found[0], np.diag([0.0, 2.0 - 2.0 * np.cos(w)]), atol=1e-12)
