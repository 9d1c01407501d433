"""The best spectrum under several power limits, by its dual.

Minimise the mean over frequency of tr(A Phi^-1) subject to mean tr(M_i Phi) <= c_i. For multipliers
lambda >= 0 and M = sum lambda_i M_i the inner minimum is closed_form.best_spectrum, and the dual
2 mean tr (M^1/2 A M^1/2)^1/2 - lambda^T c is concave and smooth in as many unknowns as there are limits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.loop_error.closed_form import adjoint, eigen, error_of, power_of

_MAX_STEPS = 200
_SETTLED = 1e-13
# A multiplier may fall by this factor in one step: limits that do not bind fade out geometrically.
_LEAST_SHARE = 0.02
_SUFFICIENT, _SHORTEST, _ROUNDING = 1e-4, 1e-10, 1e-12  # Armijo's constant, least step length, rounding


@dataclass(frozen=True)
class LimitedDesign:
    """Holds a spectrum within its limits, and the proof of its gap.

    Attributes:
        spectrum: Phi (K, n, n) at the given frequencies.
        value: mean tr(A Phi^-1), recomputed from the spectrum.
        lower_bound: the dual function at `multipliers`, a bound for all spectra within the limits.
        powers: mean tr(M_i Phi) (p,), each at most its limit.
    """

    spectrum: ComplexArray
    value: float
    lower_bound: float
    multipliers: Array
    powers: Array
    steps: int

    @property
    def gap(self) -> float:
        """Return the relative gap (value - lower_bound) / value."""
        return (self.value - self.lower_bound) / self.value if self.value > 0 else 0.0


def design_within(A: ComplexArray, metrics: ComplexArray, limits: Array, weights: Array) -> LimitedDesign:
    """Solve the problem above by Newton's method on the multipliers.

    Args:
        A: Z^T (K, n, n), Hermitian and nonnegative.
        metrics: M_i (p, K, n, n), whose sum is positive definite at every frequency.
        limits: c (p,), positive.
        weights: (K,) weights of the mean over frequency.
    """
    scale = float(np.trace(A, axis1=1, axis2=2).real @ weights)
    # In units of the limits every multiplier is of order one and the limits are one.
    dual = _Dual(A / scale, metrics / limits[:, None, None, None], weights)
    even = np.ones(limits.size)
    best = point = dual.at(even * dual.at(even).length)
    step = 1
    while best.gap > _SETTLED and step < _MAX_STEPS and (higher := dual.ascended(point)) is not None:
        point, step = higher, step + 1
        best = min(best, point, key=lambda one: one.gap)
    Phi, multipliers = best.spectrum / best.powers.max(), best.share * best.length
    return LimitedDesign(
        spectrum=Phi,
        value=scale * float(error_of(dual.A, Phi) @ weights),
        lower_bound=scale * dual.at(multipliers).value,
        multipliers=scale * multipliers / limits,
        powers=best.powers / best.powers.max() * limits,
        steps=step,
    )


@dataclass(frozen=True)
class _Point:
    """Holds the dual function, its derivatives and the spectrum it suggests, at multipliers `share` (p,).

    In this direction the dual is greatest at `length` times them; `gap` is the relative gap there.
    """

    share: Array
    spectrum: ComplexArray
    powers: Array
    value: float
    hessian: Array
    gap: float
    length: float


@dataclass(frozen=True)
class _Dual:
    A: ComplexArray
    metrics: ComplexArray
    weights: Array

    def at(self, share: Array) -> _Point:
        weights, p, total = self.weights, share.size, float(share.sum())
        M = np.einsum("p,pkab->kab", share, self.metrics)
        outer, inner = power_of(M, 0.5), power_of(M, -0.5)
        squared, vectors = eigen(outer @ self.A @ outer)
        root = np.sqrt(squared)
        frame = inner @ vectors
        # In the eigenbasis of the root: U_ab = -y_a y_b / (y_a + y_b) D_ab for a change D of M.
        turned = adjoint(frame) @ self.metrics @ frame
        powers = np.einsum("pkaa,ka,k->p", turned, root, weights).real
        sums, products = root[:, :, None] + root[:, None, :], root[:, :, None] * root[:, None, :]
        coupling = np.divide(products, sums, out=np.zeros_like(sums), where=sums > 0)
        scaled = turned * (coupling * weights[:, None, None])
        half = float(root.sum(axis=1) @ weights)
        # tr(A Phi^-1) = tr(M Phi) here, and shrinking Phi into its limits raises it by as much.
        primal, bound = half * float(powers.max()), half**2 / total
        return _Point(
            share,
            (frame * root[:, None, :]) @ adjoint(frame),
            powers,
            2 * half - total,
            -(scaled.reshape(p, -1) @ np.conj(turned.reshape(p, -1)).T).real,
            (primal - bound) / max(primal, 1e-300),
            (half / total) ** 2,
        )

    def ascended(self, point: _Point) -> _Point | None:
        """Return the point after a damped step of Newton's method, or None once the dual rises no more."""
        share, gradient = point.share, point.powers - 1.0
        free = ~((share < 1e-8 * share.max()) & (gradient < 0))
        size = share[free]
        scaled = -point.hessian[np.ix_(free, free)] * np.outer(size, size)
        damping = 1e-13 * np.trace(scaled)
        direction = -share
        direction[free] = size * np.linalg.solve(scaled + damping * np.eye(size.size), gradient[free] * size)
        length = 1.0
        while length > _SHORTEST:
            trial = np.maximum(share + length * direction, _LEAST_SHARE * share)
            if np.array_equal(trial, share):
                return None
            there = self.at(trial)
            gain = float(gradient @ (trial - share))
            if there.value >= point.value + _SUFFICIENT * gain:
                return there
            # The dual hides a gain below its rounding; the gap still shows it.
            if abs(gain) <= _ROUNDING * abs(point.value) and there.gap < point.gap:
                return there
            length *= 0.5
        return None
