"""Spectral factors, scalar and matrix; lines, multisines and low-order filters of matrix spectra."""

import numpy as np
import pytest

from inputdesign_cli.signal.lines import Lines, grid_lines
from inputdesign_cli.signal.periodic import (
    dense_roots,
    even_multisine,
    harmonics,
    noise_drive,
    periodogram,
    shaped_noise,
)
from inputdesign_cli.signal.rational import rational_filter
from inputdesign_cli.signal.spectral_factor import (
    SpectralFactor,
    autocorrelation,
    matrix_factor,
    spectral_factor,
)
from inputdesign_cli.spectrum import FirBasis
from tests.support.loop_error import adjoint, column, random_hermitian

TAPS = np.array([[[2.0, 0.0], [0.5, 1.0]], [[0.6, 0.3], [-0.4, 0.2]]])


def moving_average(w):
    """psi psi^* of a minimum-phase matrix of order one."""
    psi = np.einsum("kl,lij->kij", np.exp(-1j * np.outer(w, [0, 1])), TAPS)
    return psi @ adjoint(psi)


def covariance(u):
    return u.T @ u / len(u)


@pytest.mark.parametrize("samples", [64, 65])
def test_powers_add_up_to_the_covariance(samples):
    lines = grid_lines(moving_average(harmonics(samples)), samples, 1.0)
    expected = sum(tap @ tap.T for tap in TAPS)
    np.testing.assert_allclose(lines.powers.sum(axis=0).real, expected, rtol=1e-12)


@pytest.mark.parametrize(("samples", "periods"), [(128, 2), (126, 2), (128, 1), (96, 3)])
def test_a_multisine_has_its_spectrum(samples, periods):
    rng = np.random.default_rng(0)
    n = max(periods, 2)
    length = samples // periods
    lines = grid_lines(random_hermitian(rng, length // 2 + 1, n), length, 1.0)
    powers = lines.dense(length)
    # At 0 and pi a signal is real.
    powers[[0] if length % 2 else [0, -1]] = powers[[0] if length % 2 else [0, -1]].real
    u = even_multisine(lines, samples, rng, periods=periods)
    assert u.shape == (samples, n)
    blocks = [periodogram(block).powers for block in np.split(u, periods)]
    if periods == n:
        np.testing.assert_allclose(sum(blocks) / periods, powers, atol=1e-12)
        np.testing.assert_allclose(covariance(u), powers.sum(axis=0).real, atol=1e-12)
    for block in blocks:  # one period: every line has rank one
        values = np.linalg.eigvalsh(block)
        assert np.all(values[:, :-1] < 1e-12 * values[:, -1:].max())


def test_the_periodogram_of_a_record_gives_its_covariance():
    u = np.random.default_rng(1).standard_normal((51, 3))
    np.testing.assert_allclose(periodogram(u).powers.sum(axis=0).real, covariance(u), rtol=1e-12)


def test_periodic_noise_has_the_spectrum_on_average():
    rng = np.random.default_rng(2)
    lines = grid_lines(moving_average(harmonics(32)), 32, 1.0)
    u = shaped_noise(dense_roots(lines, 32), noise_drive(2, 32, 5000, rng), 32)
    assert u.shape == (5000, 32, 2)
    mean = np.mean([periodogram(record).powers for record in u], axis=0)
    np.testing.assert_allclose(mean, lines.powers, atol=6 * np.abs(lines.powers).max() / np.sqrt(5000))


def test_lines_move_to_the_nearest_of_the_record_and_keep_their_power():
    frequencies = np.array([0.0, 0.101, 0.103, np.pi])
    powers = random_hermitian(np.random.default_rng(3), 4, 2)
    dense = Lines(frequencies, powers).dense(1000)
    assert np.count_nonzero(np.abs(dense).sum(axis=(1, 2))) == 3
    np.testing.assert_allclose(dense.sum(axis=0).real, powers.sum(axis=0).real, rtol=1e-12)


def test_the_factor_of_a_moving_average_is_its_taps():
    factor = matrix_factor(moving_average, points=256, floor=1e-12)
    assert factor.residual < 1e-12
    assert factor.floor == 0.0
    # A factor is unique up to an orthogonal matrix on the right.
    turn = np.linalg.solve(TAPS[0], factor.taps[0])
    np.testing.assert_allclose(turn @ turn.T, np.eye(2), atol=1e-10)
    np.testing.assert_allclose(factor.taps[1], TAPS[1] @ turn, atol=1e-10)
    np.testing.assert_allclose(factor.taps[2:], 0, atol=1e-10)


def test_a_spectrum_that_touches_zero_is_lifted_by_a_reported_floor():
    problem = column()
    design, *_ = problem.asymptotic()
    factor = matrix_factor(lambda w: problem.spectrum_at(w, design.multipliers))
    assert factor.floor == pytest.approx(1e-4, rel=1e-6)
    assert factor.residual < 0.01
    assert (factor.taps**2).sum() == pytest.approx(2.0, rel=1e-3)
    u = factor.filtered(40_000, np.random.default_rng(0))
    np.testing.assert_allclose(np.trace(covariance(u)), 2.0, rtol=0.1)


def test_a_rational_filter_recovers_one_of_its_order():
    a, n = 0.7, 2
    B, C = np.array([[1.0, 0.2], [0.1, 0.8]]), np.array([[0.5, -0.3], [0.2, 0.9]])
    taps = np.array([np.eye(n)] + [C @ B * a**k for k in range(200)])
    filter_ = rational_filter(taps, 1)
    w = np.linspace(0, np.pi, 20)
    z = np.exp(1j * w)[:, None, None]
    np.testing.assert_allclose(filter_.at(w), np.eye(n) + C @ B / (z - a), atol=1e-9)
    np.testing.assert_allclose(filter_.power(), (taps**2).sum(axis=(0, 2)), rtol=1e-9)


@pytest.mark.first(1)
@pytest.mark.parametrize("order", [2, 4])
def test_low_order_filters_of_the_column_are_stable_and_nearly_as_good(order):
    problem = column()
    criterion = problem.parametric()
    design, rule, _ = problem.asymptotic()
    factor = matrix_factor(lambda w: problem.spectrum_at(w, design.multipliers))
    filter_ = rational_filter(factor.taps, order)
    assert filter_.order == 2 * order
    assert filter_.radius < 1
    filter_ = filter_.scaled(np.sqrt(2 / filter_.power().sum()))
    M = criterion.information(rule.nodes, filter_.spectrum(rule.nodes), rule.weights)
    assert criterion.value(M) < {2: 6.3e-6, 4: 5.3e-6}[order]
    u = filter_.filtered(100_000, np.random.default_rng(1))
    np.testing.assert_allclose((u**2).mean(axis=0), filter_.power(), rtol=0.1)


@pytest.mark.parametrize("order", [0, 1, 5, 40, 200])
def test_the_spectral_factor_has_the_spectrum_of_a_known_factor(order):
    """The known factor has random taps."""
    rng = np.random.default_rng(order)
    taps = rng.normal(size=order + 1) * 0.7 ** np.arange(order + 1)
    factor = spectral_factor(autocorrelation(taps))
    assert factor.residual < 1e-12
    w = np.linspace(0, np.pi, 257)
    response = np.abs(np.exp(-1j * np.outer(w, np.arange(order + 1))) @ factor.taps) ** 2
    wanted = FirBasis(1, order).density(autocorrelation(taps), w)
    np.testing.assert_allclose(response, wanted, rtol=1e-9, atol=1e-11 * wanted.max())


def test_a_spectral_factor_with_zeros_on_the_circle_has_a_small_residual():
    """(1 - q^-1)^2 touches zero at DC, of order four in Phi: the residual still vanishes."""
    factor = spectral_factor(autocorrelation(np.array([1.0, -2.0, 1.0])))
    assert factor.residual < 1e-10


def test_filtered_noise_has_the_autocovariances():
    taps = np.array([1.0, 0.8, 0.3])
    x = SpectralFactor(taps, 0.0).filtered(200_000, np.random.default_rng(1))
    for lag, expected in enumerate(autocorrelation(taps)):
        assert np.mean(x[: x.size - lag] * x[lag:]) == pytest.approx(expected, abs=0.03)
