"""Multisines of one or more inputs have the spectrum that was asked for."""

import numpy as np
import pytest

from inputdesign_cli.compute.time_limit import OutOfTimeError, time_limit
from inputdesign_cli.signal.lines import Lines, grid_lines, merged, orthogonal_columns
from inputdesign_cli.signal.multisine import multisine_record
from inputdesign_cli.signal.spectral_factor import autocorrelation
from inputdesign_cli.spectrum import FirBasis


def hermitian_density(number, r, rng):
    X = rng.normal(size=(number, r, r)) + 1j * rng.normal(size=(number, r, r))
    return X @ X.conj().swapaxes(1, 2)


@pytest.mark.parametrize("r", [1, 2, 3, 4])
def test_orthogonal_periods_have_exactly_the_spectrum(r):
    rng = np.random.default_rng(0)
    period = 64
    phi = hermitian_density(period // 2 + 1, r, rng)
    record = multisine_record(grid_lines(phi, period, 1.0), r * period, rng, "orthogonal")
    blocks = np.fft.rfft(record.reshape(r, period, r), axis=1) / np.sqrt(period)
    mean = np.einsum("bni,bnj->nij", blocks, blocks.conj()) / r
    inside = slice(1, period // 2)
    np.testing.assert_allclose(mean[inside], phi[inside], atol=1e-10 * np.abs(phi).max())
    ends = np.trace(mean[[0, -1]], axis1=1, axis2=2).real
    if r != 3:  # signs are orthogonal there, so that the ends are exact too
        np.testing.assert_allclose(ends, np.trace(phi[[0, -1]], axis1=1, axis2=2).real, rtol=1e-9)


def test_random_phases_meet_the_spectrum_on_average_with_one_vector_a_line():
    rng = np.random.default_rng(1)
    period, draws = 16, 4000
    phi = hermitian_density(period // 2 + 1, 2, rng)
    lines = grid_lines(phi, period, 1.0)
    records = np.array([multisine_record(lines, period, rng, "random") for _ in range(draws)])
    X = np.fft.rfft(records, axis=1) / np.sqrt(period)
    outer = np.einsum("dni,dnj->dnij", X, X.conj())
    assert np.linalg.matrix_rank(outer[0, 3], tol=1e-9) == 1
    inside = slice(1, period // 2)
    deviation = outer.mean(axis=0)[inside] - phi[inside]
    error = outer.std(axis=0)[inside] / np.sqrt(draws)
    assert np.all(np.abs(deviation) < 5 * error + 1e-9)


def test_lines_anywhere_have_their_powers():
    powers = np.array([[[2.0, 0.5j], [-0.5j, 1.0]]], dtype=complex)
    lines = Lines(np.array([0.3]), powers)
    rng = np.random.default_rng(2)
    record = multisine_record(lines, 2 * 20000, rng, "orthogonal")
    np.testing.assert_allclose(record.T @ record / len(record), powers[0].real, atol=2e-3)


def test_lines_that_a_record_cannot_tell_apart_become_one():
    powers = np.array([np.eye(2), 2 * np.eye(2), 3 * np.eye(2)], dtype=complex)
    found = merged(Lines(np.array([1.0, 1e-9, 2e-7]), powers), 100)
    assert found.frequencies[1] == 1.0
    assert found.frequencies[0] == 0.0
    np.testing.assert_allclose(found.powers, [5 * np.eye(2), np.eye(2)])
    record = multisine_record(found, 200, np.random.default_rng(0), "orthogonal")
    assert np.mean(record**2) == pytest.approx(6.0, rel=0.05)


def test_columns_are_orthogonal_and_of_modulus_one():
    for order in range(1, 7):
        Q = orthogonal_columns(order)
        np.testing.assert_allclose(Q.conj().T @ Q, order * np.eye(order), atol=1e-12)
        np.testing.assert_allclose(np.abs(Q), 1.0)


@pytest.mark.parametrize("samples", [64, 65])
def test_the_lines_of_a_moving_average_have_exactly_its_power(samples):
    c = autocorrelation(np.array([1.0, -0.6, 0.2]))
    w = 2 * np.pi * np.arange(samples // 2 + 1) / samples
    lines = grid_lines(FirBasis(1, 2).density(c, w), samples, 1.0)
    assert lines.mean_squares == pytest.approx([c[0]], rel=1e-12)
    x = multisine_record(lines, samples, np.random.default_rng(2), "orthogonal")[:, 0]
    spectrum = np.abs(np.fft.rfft(x) / samples) ** 2
    spectrum[1 : (samples + 1) // 2] *= 2
    np.testing.assert_allclose(spectrum, lines.totals, atol=1e-14)


def test_a_record_of_lines_anywhere_is_their_sum_however_long():
    rng = np.random.default_rng(5)
    frequencies, samples = np.sort(rng.uniform(0.01, 3.0, 700)), 3001
    lines = Lines(frequencies, np.full((700, 1, 1), 0.5 + 0j))
    angles = rng.uniform(0.0, 2.0 * np.pi, 700)
    found = multisine_record(lines, samples, rng, "orthogonal", angles=angles)
    at = [0, 1428, 1429, 3000]
    expected = [sum(np.cos(w * t + a) for w, a in zip(frequencies, angles, strict=True)) for t in at]
    np.testing.assert_allclose(found[at, 0], expected, atol=1e-9)


def test_the_time_limit_ends_a_record_that_is_being_made():
    rng = np.random.default_rng(5)
    lines = Lines(rng.uniform(0.01, 3.0, 20), np.full((20, 1, 1), 0.5 + 0j))
    with time_limit(0.0), pytest.raises(OutOfTimeError):
        multisine_record(lines, 100, rng, "orthogonal")
