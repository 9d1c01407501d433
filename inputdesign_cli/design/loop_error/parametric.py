"""The exact finite-order covariance in place of the asymptotic one: least tr(W P) over every spectrum.

[rojas-asymptotic] takes the covariance that holds as the model order grows; here it is that of the model
structure, [ljung-1999] Section 9.4.

To first order in the error of the parameters, y - y0 = sum_l dtheta_l X_l (r - v) with
X_l = S G dC_l S = -S dG_l G^-1 T + dT_l, where dT_l is how the loop that the law aims at errs with the model.
Hence E||y - y0||^2 = tr(W P), W_lm = mean tr(X_l (Phi_r + Phi_v) X_m^*). The covariance P is the inverse of
an information matrix that is affine in the input spectrum.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.compute.time_limit import OutOfTimeError, seconds_left
from inputdesign_cli.design.loop_error.closed_form import power_of
from inputdesign_cli.design.loop_error.weight import adjoint
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.plant.frequencies import local_maxima

_MAX_ROUNDS = 25
_START = 24
# Rounds without halving the gap after which the program over the lines is as exact as it gets.
_PATIENCE = 3
_MOST_NEW = 8
# A line with less than this share of the power is dropped; lines closer than _CLOSE of the band are one.
_FADED = 1e-6
_CLOSE = 1e-7


@dataclass(frozen=True)
class ParametricCriterion:
    """tr(W (M0 + M(Phi))^-1) for one sample; W and M0 (k, k) real and symmetric.

    `sources(w)` gives X (K, k, n, m) = Phi_v^-1/2 dG_l, so that
    M_lm(Phi) = mean Re tr(X_l Phi X_m^*).
    """

    W: Array
    noise_information: Array
    sources: Callable[[Array], ComplexArray]

    def information(self, w: Array, Phi: ComplexArray, weights: Array) -> Array:
        """M (k, k) of the spectrum Phi (K, n, n) at `w`, for a mean with `weights` (K,)."""
        X = self.sources(w)
        excited = X @ Phi[:, None]
        return self.noise_information + np.einsum("klab,kmab,k->lm", excited, np.conj(X), weights).real

    def value(self, information: Array) -> float:
        """tr(W M^-1)."""
        return float(np.trace(np.linalg.solve(information, self.W)))

    def worth(self, information: Array, w: Array) -> ComplexArray:
        """Psi (K, m, m): an input Phi more lowers the value by mean tr(Psi Phi) to first order."""
        inverse = np.linalg.inv(information)
        X = self.sources(w)
        return np.einsum("lm,kmab,klac->kbc", inverse @ self.W @ inverse, np.conj(X), X)


@dataclass(frozen=True)
class LineDesign:
    """Sinusoids: `spectrum` (J, n, n) are power matrices, whose sum's real part is the covariance of u."""

    frequencies: Array
    spectrum: ComplexArray
    value: float
    lower_bound: float
    information: Array
    powers: Array
    rounds: int

    @property
    def gap(self) -> float:
        """(value - lower_bound) / value."""
        return (self.value - self.lower_bound) / self.value


def least_error(
    criterion: ParametricCriterion,
    metrics: Callable[[Array], ComplexArray],
    limits: Array,
    grid: Array,
    *,
    tolerance: float,
) -> LineDesign:
    """Exchange over frequencies: a small program over the lines at hand, then the lines it lacks.

    Args:
        metrics: w (K,) -> M_i (p, K, n, n); the limits are mean tr(M_i Phi) <= limits (p,).
        grid: frequencies on which maxima are looked for before they are polished.
        tolerance: relative gap at which to stop.

    The bound holds for every spectrum: with Y = M^-1 W M^-1 the value of any Phi' is at least
    2 tr(W M^-1) - tr(Y M0) - max mean tr(Psi Phi'), and the maximum is at most s lambda^T c when
    Psi <= s sum lambda_i M_i at every frequency.

    Raises:
        OutOfTimeError: not even the first lines were computed in time.
    """
    lines = grid[np.unique(np.linspace(0, grid.size - 1, _START).round().astype(int))]
    best: LineDesign | None = None
    bound = -np.inf
    M: Array | None = None
    least_gap, stalled = np.inf, 0
    for step in range(1, _MAX_ROUNDS + 1):
        try:
            Phi, multipliers = _restricted(criterion, lines, metrics(lines), limits, M)
        except OutOfTimeError:
            if best is None:
                raise
            break
        powers = np.einsum("pkab,kba->p", metrics(lines), Phi).real
        Phi = Phi / np.max(powers / limits)
        powers = powers / np.max(powers / limits)
        M = criterion.information(lines, Phi, np.ones(lines.size))
        value = criterion.value(M)

        def ratio(w: Array, M: Array = M, multipliers: Array = multipliers) -> Array:
            inner = power_of(np.einsum("p,pkab->kab", multipliers, metrics(w)), -0.5)
            return np.asarray(np.linalg.eigvalsh(inner @ criterion.worth(M, w) @ adjoint(inner))[:, -1])

        values = ratio(grid)
        peaks, heights = local_maxima(ratio, grid, values)
        worst = float(max(heights.max(initial=0.0), values.max()))
        Y = np.linalg.solve(M, np.linalg.solve(M, criterion.W).T)
        attained = 2 * value - float(np.sum(Y * criterion.noise_information))
        bound = max(bound, attained - worst * float(multipliers @ limits))
        if best is None or value < best.value:
            best = LineDesign(lines, Phi, value, bound, M, powers, step)
        gap = best.value - bound
        stalled = stalled + 1 if gap > 0.5 * least_gap else 0
        least_gap = min(gap, least_gap)
        if gap <= tolerance * best.value or stalled == _PATIENCE:
            break
        power = np.trace(Phi, axis1=1, axis2=2).real
        kept = lines[power > _FADED * power.sum()]
        highest = np.argsort(heights)[: -_MOST_NEW - 1 : -1]
        lines = _apart(kept, np.sort(peaks[highest]), span=grid[-1])
    assert best is not None
    power = np.trace(best.spectrum, axis1=1, axis2=2).real
    kept = power > 1e-9 * power.sum()
    Phi = best.spectrum[kept] * power.sum() / power[kept].sum()
    return LineDesign(
        best.frequencies[kept], Phi, best.value, bound, best.information, best.powers, best.rounds
    )


def _restricted(
    criterion: ParametricCriterion, lines: Array, metrics: ComplexArray, limits: Array, near: Array | None
) -> tuple[ComplexArray, Array]:
    """The best power matrices at given lines and the multipliers of the limits, by a semidefinite program.

    `near` (k, k) is an information matrix near the answer: in its coordinates the program is well scaled.
    """
    import cvxpy as cp

    n, k = metrics.shape[-1], criterion.W.shape[0]
    # White input at the limits sets the scale: then every block of the program is of order one.
    power = float(np.min(limits / np.einsum("pkaa->p", metrics).real * lines.size))
    white = np.full((lines.size, 1, 1), power / lines.size) * np.eye(n, dtype=complex)
    typical = criterion.information(lines, white, np.ones(lines.size)) if near is None else near
    scale = np.linalg.cholesky(typical)
    whiten = np.linalg.inv(scale)
    W = whiten @ criterion.W @ whiten.T
    values, vectors = np.linalg.eigh(0.5 * (W + W.T) / np.trace(W))
    held = values > 1e-14
    V = vectors[:, held] * np.sqrt(values[held])
    basis = _hermitian_basis(n)
    X = np.einsum("lm,kmab->klab", whiten, criterion.sources(lines)) * np.sqrt(power)
    shares = np.einsum("klab,tbc,kmac->ktlm", X, basis, np.conj(X)).real.reshape(-1, k * k)
    costs = np.einsum("pkab,tba->pkt", metrics, basis).real.reshape(limits.size, -1)
    costs *= power / limits[:, None]
    x = cp.Variable((lines.size, n * n))
    M = whiten @ criterion.noise_information @ whiten.T + cp.reshape(
        shares.T @ cp.reshape(x, (lines.size * n * n,), order="C"), (k, k), order="C"
    )
    Q = cp.Variable((V.shape[1], V.shape[1]), symmetric=True)
    budget = costs @ cp.reshape(x, (lines.size * n * n,), order="C") <= np.ones(limits.size)
    constraints = [cp.bmat([[Q, V.T], [V, M]]) >> 0, budget]
    for j in range(lines.size):
        real = cp.reshape(x[j] @ basis.real.reshape(n * n, -1), (n, n), order="C")
        imaginary = cp.reshape(x[j] @ basis.imag.reshape(n * n, -1), (n, n), order="C")
        constraints.append(cp.bmat([[real, -imaginary], [imaginary, real]]) >> 0)
    program = cp.Problem(cp.Minimize(cp.trace(Q)), constraints)
    with warnings.catch_warnings():
        # Whether the answer is accurate is judged by the bound, which we compute ourselves.
        warnings.simplefilter("ignore")
        try:
            program.solve(
                solver=cp.CLARABEL,
                tol_gap_abs=1e-10,
                tol_gap_rel=1e-10,
                tol_feas=1e-10,
                time_limit=seconds_left(),
            )
        except cp.SolverError as error:
            raise _failed(str(error)) from error
    seconds_left()
    if x.value is None:
        raise _failed(str(program.status))
    # To the power one: without the rounding below zero.
    Phi = power_of(np.einsum("kt,tab->kab", x.value, basis) * power, 1.0)
    multipliers = np.maximum(np.asarray(budget.dual_value, dtype=float), 0) * float(np.trace(W)) / limits
    return Phi, multipliers


def _failed(why: str) -> InaccurateError:
    return InaccurateError.because(
        "solver-failed",
        f"the program over the lines of the spectrum was not solved: {why}",
        hint="write covariance: asymptotic, or look for parameters that are nearly indistinguishable",
        key="accuracy.closed_loop_error.covariance",
    )


def _apart(kept: Array, new: Array, *, span: float) -> Array:
    """The frequencies kept and those new ones that are not next to another."""
    lines = list(kept)
    for w in new:
        if not lines or np.min(np.abs(np.array(lines) - w)) > _CLOSE * span:
            lines.append(w)
    return np.sort(np.array(lines))


def _hermitian_basis(n: int) -> ComplexArray:
    """(n^2, n, n): an orthonormal basis of the Hermitian matrices over the reals."""
    elements = []
    for i in range(n):
        for j in range(i, n):
            unit = np.zeros((n, n), dtype=complex)
            unit[i, j] = 1.0
            if i == j:
                elements.append(unit)
            else:
                elements.append((unit + unit.T) / np.sqrt(2))
                elements.append(1j * (unit - unit.T) / np.sqrt(2))
    return np.array(elements)
