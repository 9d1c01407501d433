"""Spectra with a factor of few columns by the bilinear hill-climb of [mohan-spectral], Figure 3.

Phi = 1/2 W H H^T W^T with H (n, c): M is quadratic in H. The source fixes one argument of the bilinear
form M(X, Y) and climbs in the other, which can lower the criterion (E). Since M(X - Y, X - Y) >= 0,
M(X) >= 2 M(X, Y) - M(Y): to maximise the criterion of the right-hand side, which is affine in X, never
lowers it. The result is a lower bound on the optimum over all spectra. It depends on the start, so that
several are tried.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Criterion
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError, seconds_left

_MAX_STEPS = 100
_SETTLED = 1e-7
_STRETCH = (8.0, 3.0, 1.0)


@dataclass(frozen=True)
class QuadraticDesign:
    """The problem for a factor: M_lm = baseline_lm + tr(A_lm H H^*), tr(P H H^*) <= cap for each limit.

    `maps` (k, k, n, n) holds the A_lm and `limits` pairs (P, cap), Hermitian where H may be complex.
    """

    maps: NDArray
    baseline: Array
    limits: tuple[tuple[NDArray, float], ...]
    criterion: Criterion

    @property
    def real(self) -> QuadraticDesign:
        """Return the problem for the real and imaginary parts of H, one above the other."""
        if not np.iscomplexobj(self.maps):
            return self
        limits = tuple((_embedded(P), cap) for P, cap in self.limits)
        return replace(self, maps=_embedded(self.maps), limits=limits)

    def information(self, H: Array) -> Array:
        """Return M for a real factor H (n, c), as (k, k)."""
        return self.baseline + np.einsum("lmab,ac,bc->lm", self.maps, H, H, optimize=True)

    def value(self, information: Array) -> float:
        """Return the criterion of M (k, k), larger is better; minus infinity where M is singular, T aside."""
        level = self.criterion.level(information)
        return self.criterion.value(level) if level > 0.0 else -np.inf

    def feasible(self, H: Array) -> Array:
        """Scale H until one limit binds."""
        used = max(float(np.sum(H * (P @ H))) / cap for P, cap in self.limits)
        return H / np.sqrt(used)


@dataclass(frozen=True)
class HillClimb:
    """Holds the best factor H (n, c) found, its criterion, and the history of each start."""

    factor: NDArray
    value: float
    histories: tuple[tuple[float, ...], ...]


def hill_climb(
    design: QuadraticDesign,
    columns: int,
    *,
    starts: int,
    rng: np.random.Generator,
    guesses: Sequence[NDArray] = (),
) -> HillClimb:
    """Climb from random factors and from `guesses` (n, q), cut to their leading `columns`.

    Raises:
        ValueError: no start has any information.
    """
    real, half = design.real, len(design.maps[0, 0])
    climber = _Step(real, columns)
    n = real.maps.shape[-1]
    begin = [_leading(guess, columns, stacked=n > half) for guess in guesses]
    begin += [rng.normal(size=(n, columns)) for _ in range(starts)]
    best: tuple[float, Array] | None = None
    histories = []
    for start in begin:
        H, history = _climb(real, climber, real.feasible(start))
        histories.append(tuple(history))
        if best is None or history[-1] > best[0]:
            best = history[-1], H
    if best is None:
        raise ValueError("a climb needs a start")
    value, H = best
    factor = H[:half] + 1j * H[half:] if n > half else H
    return HillClimb(factor, value, tuple(histories))


def _climb(design: QuadraticDesign, step: _Step, H: Array) -> tuple[Array, list[float]]:
    history = [design.value(design.information(H))]
    for _ in range(_MAX_STEPS):
        try:
            found = step.best(H)
        except OutOfTimeError:  # the best so far is an answer
            found = None
        if found is None:
            break
        candidates = [design.feasible(found)] + [design.feasible(found + a * (found - H)) for a in _STRETCH]
        values = [design.value(design.information(c)) for c in candidates]
        top = int(np.argmax(values))
        if values[top] <= history[-1]:
            break
        H = candidates[top]
        history.append(values[top])
        if np.isfinite(history[-2]) and history[-1] - history[-2] <= _SETTLED * abs(history[-1]):
            break
    return H, history


class _Step:
    """Maximises phi(2 M(X, Y) - M(Y)) over X within the limits: compiled once, solved for every Y."""

    def __init__(self, design: QuadraticDesign, columns: int) -> None:
        import cvxpy as cp

        self.design = design
        k, n = design.baseline.shape[0], design.maps.shape[-1]
        self._upper = np.triu_indices(k)
        entries = self._upper[0].size
        self._x: Any = cp.Variable(n * columns)
        self._slope: Any = cp.Parameter((entries, n * columns))
        self._offset: Any = cp.Parameter(entries)
        M = cp.Variable((k, k), symmetric=True)
        upper = cp.hstack([M[i, j] for i, j in zip(*self._upper, strict=True)])
        constraints = [upper == self._slope @ self._x + self._offset]
        for P, cap in design.limits:
            root = np.kron(scipy.linalg.sqrtm(P / cap).real, np.eye(columns))
            constraints.append(cp.norm(root @ self._x) <= 1.0)
        letter, scale = design.criterion.letter, design.criterion.scaling
        inverse = np.linalg.inv(scale)
        unit = inverse @ inverse.T
        unit = unit / np.linalg.norm(unit, 2)
        objective: Any
        if letter == "D":
            objective = cp.log_det(M)
        elif letter == "A":
            objective = -cp.matrix_frac(np.linalg.cholesky(unit), M)
        elif letter == "E":
            objective = cp.Variable()
            constraints.append(M - objective * unit >> 0)
        else:
            gain = scale.T @ scale
            objective = cp.trace(gain / np.linalg.norm(gain, 2) @ M)
        self._problem: Any = cp.Problem(cp.Maximize(objective), constraints)

    def best(self, Y: Array) -> Array | None:
        """Return the next factor (n, c), or None when the solver fails."""
        import cvxpy as cp

        design = self.design
        slope = 2.0 * np.einsum("lmab,bc->lmac", design.maps, Y, optimize=True)
        self._slope.value = slope[self._upper].reshape(self._upper[0].size, -1)
        quadratic = design.information(Y) - design.baseline
        self._offset.value = (design.baseline - quadratic)[self._upper]
        try:
            with warnings.catch_warnings():
                # An inaccurate step does no harm: only the criterion that it attains counts.
                warnings.simplefilter("ignore")
                self._problem.solve(solver=cp.CLARABEL, time_limit=seconds_left())
        except cp.SolverError:
            return None
        found = self._x.value
        return None if found is None or not np.all(np.isfinite(found)) else found.reshape(Y.shape)


def _embedded(A: NDArray) -> Array:
    """Return Hermitian (.., n, n) as real symmetric (.., 2 n, 2 n) with the same quadratic form."""
    top = np.concatenate([A.real, -A.imag], axis=-1)
    bottom = np.concatenate([A.imag, A.real], axis=-1)
    return np.concatenate([top, bottom], axis=-2)


def _leading(guess: NDArray, columns: int, *, stacked: bool) -> Array:
    """Return the best approximation of guess guess^* by a factor of `columns` columns, in real numbers."""
    u, s, _ = np.linalg.svd(guess, full_matrices=False)
    H = (u * s)[:, :columns]
    if H.shape[1] < columns:
        H = np.pad(H, ((0, 0), (0, columns - H.shape[1])))
    return np.concatenate([H.real, H.imag]) if stacked else H.real
