"""What a user writes in forty lines: plain cvxpy with Clarabel in whitened coordinates.

An exchange on 8001 frequencies that adds every local maximum, without a bound. Its gradients and integrals
are its own.
"""

from __future__ import annotations

import time
import warnings

import cvxpy as cp
import numpy as np

GRID = np.linspace(0.0, np.pi, 8001)


def naive(B: np.ndarray, F: np.ndarray, m: int, *, admissible: float, samples: int) -> tuple[float, float]:
    """The FIR optimum of order m on 8001 frequencies, and its processor time.

    Args:
        B, F: of the plant, which is an output-error one in noise of standard deviation 0.1.
        admissible: what |G - G0| is held below, at alpha = 2.
    """
    number, order = 1 << 14, len(F) - 1
    # Gradients of the prediction on a fine grid, and from it the M_i by the rectangle rule.
    w = 2 * np.pi * np.arange(number) / number
    lags, sigma = np.arange(m + 1), 0.1

    def gradient(at: np.ndarray) -> np.ndarray:
        z = np.exp(-1j * np.outer(at, np.arange(1, order + 1)))
        below = 1.0 + z @ F[1:]
        return np.concatenate([z / below[:, None], -z * ((z @ B[1:]) / below**2)[:, None]], axis=1)

    dG = gradient(w)
    products = (dG[:, :, None] * dG[:, None, :].conj()).real
    maps = samples / sigma**2 * np.fft.fft(products, axis=0).real[lags] / number
    maps[1:] *= 2.0
    white = np.linalg.inv(np.linalg.cholesky(maps[0]))
    maps = white @ maps @ white.T
    on_grid = gradient(GRID) @ white.T * (2.0 / admissible)
    rows = np.stack([on_grid.real, on_grid.imag], axis=1)
    power = float(np.linalg.norm(rows, 2, axis=(1, 2)).max() ** 2)
    table = np.cos(np.outer(GRID, lags)) * np.where(lags > 0, 2.0, 1.0)
    started = time.process_time()
    cuts, positive = list(range(0, 8001, 800)), list(range(0, 8001, 50))
    for _ in range(100):
        c = cp.Variable(m + 1)
        information = sum(c[i] * maps[i] for i in range(m + 1))
        conditions = [table[positive] @ c >= 0]
        conditions += [information - rows[i].T @ rows[i] / power >> 0 for i in cuts]
        program = cp.Problem(cp.Minimize(c[0]), conditions)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            program.solve(solver=cp.CLARABEL)
        M = np.tensordot(c.value, maps, axes=1)
        ratio = np.linalg.norm(rows @ np.linalg.inv(np.linalg.cholesky(M)).T, 2, axis=(1, 2)) ** 2 / power
        phi = table @ c.value
        peaks = [i for i in maxima(ratio) if ratio[i] > 1.0 + 1e-6]
        dips = [i for i in maxima(-phi) if phi[i] < -1e-6 * c.value[0]]
        if not peaks and not dips:
            break
        cuts, positive = sorted({*cuts, *peaks}), sorted({*positive, *dips})
    return power * float(c.value[0]), time.process_time() - started


def maxima(values: np.ndarray) -> np.ndarray:
    """Indices of the local maxima, ends included."""
    beside = np.concatenate([[-np.inf], values, [-np.inf]])
    return np.flatnonzero((values >= beside[:-2]) & (values >= beside[2:]))
