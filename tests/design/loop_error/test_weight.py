"""The weight Z: general formula against (19), against its definition, and the transpose in Z^{T/2}."""

import numpy as np
import pytest

from inputdesign_cli.design.loop_error import ModelReference
from inputdesign_cli.design.loop_error.closed_form import best_spectrum, error_of, power_of, weight
from inputdesign_cli.design.loop_error.laws import propagation, sensitivity
from inputdesign_cli.plant import TransferMatrix
from tests.support.loop_error import (
    GAINS,
    adjoint,
    column,
    jacobian,
    kronecker,
    random_complex,
    random_hermitian,
)

W = np.linspace(0.05, 3.0, 40)


def random_case(n, seed=0):
    rng = np.random.default_rng(seed)
    G = random_complex(rng, W.size, n, n)
    law = ModelReference(
        TransferMatrix.build(
            [[[0.0, *(0.3 * rng.standard_normal(2))] for _ in range(n)] for _ in range(n)],
            [[[1.0, -0.6]] * n] * n,
        )
    )
    return law, G, random_hermitian(rng, W.size, n), random_hermitian(rng, W.size, n)


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("seed", range(5))
def test_the_weight_agrees_with_formula_19_and_with_the_general_formula(n, seed):
    law, G, entering, noise = random_case(n, seed)
    S = sensitivity(law.complementary(W))
    CS = law.controller(G, W) @ S
    power = np.trace(S @ noise @ adjoint(S), axis1=1, axis2=2).real
    by_19 = power[:, None, None] * np.conj(CS @ entering @ adjoint(CS))
    scale = np.abs(by_19).max(axis=(1, 2), keepdims=True)
    by_13 = weight(kronecker(np.swapaxes(S, 1, 2), S @ G) @ jacobian(law, G, W), entering, noise)
    np.testing.assert_allclose(by_13 / scale, by_19 / scale, atol=1e-12)
    finite = weight(propagation(law, G, W), entering, noise)
    np.testing.assert_allclose(finite / scale, by_19 / scale, atol=1e-12)
    assert np.abs(by_19.imag / scale).max() > 0.05  # so that a lost transpose would show


@pytest.mark.parametrize("n", [1, 2, 3])
def test_z_is_what_the_covariance_of_the_estimate_costs(n):
    """tr(Z Phi^-T) against E|vec(S G dC S R)|^2 with cov(vec dG) = Phi^-T (x) Phi_v, written out."""
    law, G, entering, noise = random_case(n, 11)
    Phi = random_hermitian(np.random.default_rng(5), W.size, n)
    Z = weight(propagation(law, G, W), entering, noise)
    S = sensitivity(law.complementary(W))
    J = jacobian(law, G, W)
    for k in range(0, W.size, 7):
        R = np.linalg.cholesky(entering[k])
        sent = np.kron((S[k] @ R).T, S[k] @ G[k]) @ J[k]
        covariance = np.kron(np.linalg.inv(Phi[k]).T, noise[k])
        expected = np.trace(sent @ covariance @ adjoint(sent)).real
        np.testing.assert_allclose(np.trace(Z[k] @ np.linalg.inv(Phi[k]).T).real, expected, rtol=1e-10)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_the_best_spectrum_is_z_to_the_half_transposed_and_no_other_is_better(n):
    rng = np.random.default_rng(n)
    Z = random_hermitian(rng, W.size, n)
    A = np.swapaxes(Z, 1, 2)
    Phi = best_spectrum(A, np.broadcast_to(np.eye(n, dtype=complex), A.shape))
    np.testing.assert_allclose(Phi, np.swapaxes(power_of(Z, 0.5), 1, 2), atol=1e-10)
    least = error_of(A, Phi) + np.trace(Phi, axis1=1, axis2=2).real
    for _ in range(20):
        other = Phi + 0.1 * random_hermitian(rng, W.size, n)
        assert np.all(error_of(A, other) + np.trace(other, axis1=1, axis2=2).real > least)


def test_the_best_spectrum_solves_its_stationarity_condition():
    rng = np.random.default_rng(2)
    A, M = random_hermitian(rng, 30, 3), random_hermitian(rng, 30, 3)
    Phi = best_spectrum(A, M)
    np.testing.assert_allclose(Phi @ M @ Phi, A, atol=1e-10)


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


def test_the_printed_matrix_is_the_elementwise_root():
    K = np.linalg.inv(GAINS)
    gram = K @ K.T
    printed = np.array([[50.86022, 50.81780], [50.81780, 50.78046]])
    np.testing.assert_allclose(np.sqrt(gram), printed, atol=6e-6)
    root = power_of(gram[None].astype(complex), 0.5)[0].real
    np.testing.assert_allclose(root, [[36.24406924, 35.68094398], [35.68094398, 36.13206075]], rtol=1e-8)
    np.testing.assert_allclose(np.linalg.eigvalsh(root), [0.50707707, 71.86905293], rtol=1e-7)
