"""The shipped heater and column against plain programs: closed-form sampling, complex steps, cvxpy."""

import numpy as np
import pytest

from inputdesign_cli import analyse, load_spec

COLUMN = {
    (0, 0): (12.8, 16.7, 1.0),
    (0, 1): (-18.9, 21.0, 3.0),
    (1, 0): (6.6, 10.9, 7.0),
    (1, 1): (-19.4, 14.4, 3.0),
}


def held(theta, w, h):
    """Real and imaginary part of K e^(-Ls)/(T s + 1) behind a hold, analytic in K, T and L."""
    K, T, L = theta
    d = int(np.floor(np.real(L) / h))
    rest = h - (L - d * h)
    a, early = np.exp(-h / T), 1.0 - np.exp(-rest / T)
    b = {d + 1: K * early, d + 2: K * (1.0 - a - early)}
    above = [sum(c * f(lag * w) for lag, c in b.items()) for f in (np.cos, lambda x: -np.sin(x))]
    below = 1.0 - a * np.cos(w), a * np.sin(w)
    size = below[0] ** 2 + below[1] ** 2
    real = (above[0] * below[0] + above[1] * below[1]) / size
    return real, (above[1] * below[0] - above[0] * below[1]) / size


def gradient(theta, w, h):
    """dG / d(K, T, L) (n, 3), by complex steps."""
    columns = []
    for k in range(3):
        moved = np.array(theta, dtype=complex)
        moved[k] += 1e-30j
        real, imaginary = held(moved, w, h)
        columns.append((real.imag + 1j * imaginary.imag) / 1e-30)
    return np.stack(columns, axis=1)


@pytest.mark.slow
def test_white_noise_tells_of_the_column_what_sums_over_frequencies_tell():
    """M over a fine grid of the circle; each entry has its own parameters, each output its own noise."""
    w = 2.0 * np.pi * (np.arange(2**14) + 0.5) / 2**14
    overrides = ["spectrum={given: {type: white, power: 1.0}}"]
    found = analyse(load_spec("specs/wood_berry.yaml", overrides)).result["information"]["standard_deviation"]
    for (i, j), theta in COLUMN.items():
        F = gradient(theta, w, 1.0)
        M = 500 / 0.01 * 0.5 * np.einsum("nk,nl->kl", F, F.conj()).real / w.size
        expected = np.sqrt(np.diag(np.linalg.inv(M)))
        names = [f"{name}[{i + 1},{j + 1}]" for name in ("gain", "time_constant", "dead_time")]
        np.testing.assert_allclose([found[name] for name in names], expected, rtol=1e-8)
