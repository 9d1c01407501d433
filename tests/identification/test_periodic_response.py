"""The response by periods: exact without noise, with several inputs; its deviations are those of records."""

import numpy as np
import pytest

from inputdesign_cli.identification.periodic_response import Periods, excited_harmonics, periodic_response


def blocks(G, rng, periods, times):
    """Inputs (N, 2) in two blocks with opposite signs in the second input, and steady outputs (N, p)."""
    T, L = periods.period, len(G)
    k = np.arange(1, L + 1)
    phases = rng.uniform(0, 2 * np.pi, (2, L))
    u, y = [], []
    for sign in (1.0, -1.0):
        U = np.stack([np.exp(1j * phases[0]), sign * 2.0 * np.exp(1j * phases[1])], axis=1)
        turn = np.exp(2j * np.pi * np.outer(np.arange(T * times), k) / T)
        u.append(2 * (turn @ U).real)
        y.append(2 * (turn @ np.einsum("lpr,lr->lp", G, U)).real)
    return np.concatenate(u), np.concatenate(y), k


def test_two_inputs_are_told_apart_exactly():
    rng, periods = np.random.default_rng(0), Periods(32, blocks=2, skip=1)
    G = rng.standard_normal((10, 3, 2)) + 1j * rng.standard_normal((10, 3, 2))
    u, y, k = blocks(G, rng, periods, 3)
    assert excited_harmonics(u, periods).tolist() == k.tolist()
    found = periodic_response(u, y, periods, k)
    assert pytest.approx(G, abs=1e-12) == found.G
    assert found.deviation.max() < 1e-12
    assert found.freedom == 2


def test_inputs_in_phase_are_not_told_apart():
    periods = Periods(32, blocks=2)
    u = np.cos(2 * np.pi * 3 * np.arange(128) / 32)[:, None] * np.array([1.0, 2.0])
    assert periodic_response(u, u, periods, np.array([3])) is None


def test_the_deviations_are_those_of_many_records():
    rng, periods = np.random.default_rng(1), Periods(16, blocks=2, skip=0)
    G = rng.standard_normal((4, 1, 2)) + 1j * rng.standard_normal((4, 1, 2))
    u, y, k = blocks(G, rng, periods, 5)
    records = [periodic_response(u, y + 0.3 * rng.standard_normal(y.shape), periods, k) for _ in range(2000)]
    scatter = np.std([one.G for one in records], axis=0)
    said = np.sqrt(np.mean([one.deviation**2 for one in records], axis=0))
    assert said == pytest.approx(scatter, rel=0.06)
    # 2 sigma^2 / (N p) with p = 2 |U|^2 the power of a sinusoid of amplitude 2 |U|.
    assert scatter[:, 0, 0] == pytest.approx(np.full(4, 0.3 / np.sqrt(160)), rel=0.06)
    assert scatter[:, 0, 1] == pytest.approx(np.full(4, 0.15 / np.sqrt(160)), rel=0.06)
    noise = np.mean([one.noise for one in records], axis=0)
    assert noise == pytest.approx(np.full((4, 1), 0.09), rel=0.05)
