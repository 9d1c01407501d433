"""Control laws, power limits and the weight Z: definitions, certificates, plain programs."""

import numpy as np
import pytest

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.loop_error.closed_form import best_spectrum, error_of, power_of, weight
from inputdesign_cli.design.loop_error.laws import InternalModel, MinimumVariance, ModelReference
from inputdesign_cli.design.loop_error.limits import design_within
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.plant import Rational, TransferMatrix
from tests.support.loop_error import (
    adjoint,
    column,
    matrix_plant,
    random_complex,
    random_hermitian,
    random_plant,
)

W = np.array([0.1, 0.7, 1.9, 3.0])


def laws(n):
    rng = np.random.default_rng(n)
    plant = random_plant(rng, n)
    matrix = TransferMatrix.build(
        [[[0.0, 0.4 if i == j else 0.1 * (i - j)] for j in range(n)] for i in range(n)],
        [[[1.0, -0.5] if i == j else [1.0, -0.2] for j in range(n)] for i in range(n)],
    )
    scalar = TransferMatrix.diagonal(Rational.build([0.0, 0.3], [1.0, -0.7]), n)
    return {
        "model_reference": ModelReference(scalar),
        "model_reference, matrix": ModelReference(matrix),
        "internal_model": InternalModel.build(plant, Rational.build([0.5], [1.0, -0.5])),
        "minimum_variance": MinimumVariance(plant),
    }


CASES = [(n, name) for n in (1, 2, 3) for name in laws(1)]


def difference(function, G, step=1e-6):
    """d vec f / d vec G by central differences in complex directions; checks that f is analytic."""
    K, n, _ = G.shape
    columns = []
    for j in range(n):
        for i in range(n):
            E = np.zeros((n, n))
            E[i, j] = step
            along = (function(G + E) - function(G - E)) / (2 * step)
            across = (function(G + 1j * E) - function(G - 1j * E)) / (2j * step)
            np.testing.assert_allclose(along, across, rtol=1e-5, atol=1e-6 * np.abs(along).max())
            columns.append(np.swapaxes(along, 1, 2).reshape(K, -1))
    return np.stack(columns, axis=2)


def closed(G, C):
    """The complementary sensitivity of the plant G with a controller."""
    return np.linalg.solve(np.eye(G.shape[1]) + G @ C, G @ C)


@pytest.mark.parametrize(("n", "name"), CASES)
def test_the_controller_gives_the_complementary_sensitivity_of_its_law(n, name):
    law = laws(n)[name]
    G = random_complex(np.random.default_rng(9), W.size, n, n)
    np.testing.assert_allclose(closed(G, law.controller(G, W)), law.complementary(W), atol=1e-11)


def expected_error(moved, entering, covariance):
    """E|dT R|^2 where d vec T is `moved` d vec X of this covariance, and R R^* is entering."""
    sent = np.kron(np.linalg.cholesky(entering).T, np.eye(len(entering))) @ moved
    return np.trace(sent @ covariance @ adjoint(sent)).real


@pytest.mark.parametrize(("n", "name"), CASES)
def test_the_weight_z_converts_the_covariance_of_the_estimate_to_the_loop_error(n, name):
    """tr(Z Phi^-T) against the differences of the true loop, with cov(vec dG) = Phi^-T (x) Phi_v."""
    law, rng = laws(n)[name], np.random.default_rng(8)
    G = random_complex(rng, W.size, n, n) + 2 * np.eye(n)
    entering, noise, Phi = (random_hermitian(rng, W.size, n) for _ in range(3))
    Z = weight(law.complementary(W), G, entering, noise)
    moved = difference(lambda estimate: closed(G, law.controller(estimate, W)), G)
    for k in range(W.size):
        inverse = np.linalg.inv(Phi[k]).T
        expected = expected_error(moved[k], entering[k], np.kron(inverse, noise[k]))
        np.testing.assert_allclose(np.trace(Z[k] @ inverse).real, expected, rtol=1e-6)
    if n > 1:  # so that a lost transpose would show
        assert np.abs(Z.imag).max() > 0.01 * np.abs(Z).max()


@pytest.mark.parametrize("n", [1, 2])
def test_the_noise_part_is_the_loop_error_due_to_the_estimated_noise_model(n):
    """cov(vec dH) = Lambda^-T (x) Phi_v, by differences of the loop with E held fixed."""
    plant = random_plant(np.random.default_rng(3), n, delay=2)
    law = MinimumVariance(plant)
    w = np.pi * (np.arange(64) + 0.5) / 64
    G, H, E = plant.plant_at(w), plant.noise_at(w), law.unavoidable(w)

    def loop(noise):
        return closed(G, np.linalg.inv(G) @ (noise @ np.linalg.inv(E) - np.eye(n)))

    problem = LoopErrorProblem(plant, law, (PowerLimit("input", 1.0),), np.arange(1.0, n + 1.0))
    moved, entering, Phi_v = difference(loop, H), problem.entering(w), plant.disturbance_at(w)
    inverse = np.linalg.inv(plant.covariance).T
    each = [expected_error(moved[k], entering[k], np.kron(inverse, Phi_v[k])) for k in range(w.size)]
    assert problem.model_of_noise_part() == pytest.approx(np.mean(each), rel=1e-5)


@pytest.mark.parametrize("n", [1, 2])
def test_minimum_variance_leaves_the_unavoidable_part_of_the_noise(n):
    for delay in (1, 2, 3):
        plant = random_plant(np.random.default_rng(delay), n, delay=delay)
        law = MinimumVariance(plant)
        w = 2 * np.pi * np.arange(256) / 256
        output = (np.eye(n) - law.complementary(w)) @ plant.noise_at(w)
        taps = np.fft.ifft(output, axis=0)
        H = np.fft.ifft(plant.noise_at(w), axis=0)
        np.testing.assert_allclose(taps[:delay], H[:delay], atol=1e-10)
        np.testing.assert_allclose(taps[delay:], 0, atol=1e-10)


def test_internal_model_control_keeps_unstable_zeros_and_the_delay_in_the_loop():
    plant = matrix_plant(B=[[[0, 0, 1.0, -2.0]]], A=[[1, -0.5]], covariance=[[1.0]])
    law = InternalModel.build(plant, Rational.build([0.4], [1.0, -0.6]))
    w = np.linspace(0, np.pi, 50)
    f = 0.4 / np.abs(1 - 0.6 * np.exp(-1j * w))
    np.testing.assert_allclose(np.abs(law.complementary(w)[:, 0, 0]), f, rtol=1e-12)
    assert law.whole.delay == 2
    at_zero = np.polynomial.polynomial.polyval(1 / 2.0, law.whole.numerator[0, 0])
    assert abs(at_zero) < 1e-12
    # A stable filter inverse: G^-1 T has no pole outside.
    np.testing.assert_allclose(law.complementary(np.zeros(1))[0, 0, 0], 1.0, rtol=1e-12)


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


@pytest.mark.first(3)
@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_the_gap_closes_and_the_certificate_holds(n, seed):
    A, metrics, limits, weights = case(n, 48, seed)
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


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", range(2))
def test_the_optimum_agrees_with_the_grid_program(seed):
    A, metrics, limits, weights = case(2, 12, seed)
    design = design_within(A, metrics, limits, weights)
    assert design.value == pytest.approx(grid_program(A, metrics, limits, weights), rel=2e-6)


def test_one_limit_on_the_total_power_has_the_closed_form_solution():
    A, _, _, weights = case(3, 64, 3)
    even = np.broadcast_to(np.eye(3, dtype=complex), (1, 64, 3, 3))
    design = design_within(A, even, np.array([2.5]), weights)
    root = power_of(A, 0.5)
    total = np.trace(root, axis1=1, axis2=2).real @ weights
    np.testing.assert_allclose(design.spectrum, root * 2.5 / total, rtol=1e-10, atol=1e-12)
    assert design.value == pytest.approx(total**2 / 2.5, rel=1e-12)


def test_the_column_with_a_limit_on_every_channel_is_designed_to_a_closed_gap():
    limits = tuple(
        PowerLimit(kind, bound, channel=channel)
        for kind, bounds in (("input", (1.2, 0.6)), ("output", (1e-3, 1e-3)))
        for channel, bound in enumerate(bounds)
    )
    problem = column(limits=limits)
    design, rule, change = problem.asymptotic()
    assert abs(design.gap) < 1e-10
    assert change < 1e-10
    again = problem.spectrum_at(rule.nodes, design.multipliers)
    ratio = np.trace(design.spectrum, axis1=1, axis2=2).real / np.trace(again, axis1=1, axis2=2).real
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_the_best_spectrum_is_z_to_the_half_transposed_and_no_other_is_better(n):
    rng = np.random.default_rng(n)
    Z = random_hermitian(rng, 40, n)
    A = np.swapaxes(Z, 1, 2)
    Phi = best_spectrum(A, np.broadcast_to(np.eye(n, dtype=complex), A.shape))
    np.testing.assert_allclose(Phi, np.swapaxes(power_of(Z, 0.5), 1, 2), atol=1e-10)
    least = error_of(A, Phi) + np.trace(Phi, axis1=1, axis2=2).real
    for _ in range(20):
        other = Phi + 0.1 * random_hermitian(rng, 40, n)
        assert np.all(error_of(A, other) + np.trace(other, axis1=1, axis2=2).real > least)
    M = random_hermitian(rng, 40, n)
    priced = best_spectrum(A, M)
    np.testing.assert_allclose(priced @ M @ priced, A, atol=1e-10)


def test_the_spectrum_of_the_column_is_the_matrix_root_times_s2():
    problem = column()
    w = np.array([0.01, 0.02667, 1.0, np.pi])
    z = np.exp(1j * w)
    a = np.exp(-2 / 75)
    S2 = np.abs(z - 1) / np.abs(z - a) ** 2
    design, *_ = problem.asymptotic()
    Phi = problem.spectrum_at(w, design.multipliers)
    matrix = np.array([[0.30574176, 0.30099144], [0.30099144, 0.30479690]])
    np.testing.assert_allclose(Phi.real / 2, S2[:, None, None] * matrix, rtol=1e-6)
    np.testing.assert_allclose(S2[[1, 3]], [19.2562, 0.513421], rtol=1e-5)


@pytest.mark.parametrize("w", [0.0, 0.3, 2.0])
def test_the_power_of_moves_is_that_of_differences(w):
    """A sinusoid of power one moves from sample to sample with power |1 - exp(-jw)|^2 = 2 - 2 cos w."""
    found = column(limits=(PowerLimit("moves", 1.0, channel=1),)).metrics(w)
    np.testing.assert_allclose(found[0, 0], np.diag([0.0, 2.0 - 2.0 * np.cos(w)]), atol=1e-12)
