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
_SUFFICIENT = 1e-4


@dataclass(frozen=True)
class LimitedDesign:
    """Holds a spectrum within its limits, and the proof of its gap.

    Attributes:
        spectrum: Phi (K, n, n) at the given frequencies.
        value: mean tr(A Phi^-1), recomputed from the spectrum.
        lower_bound: the dual function at `multipliers`; no spectrum within the limits gets below.
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
        weights: (K,) of the mean over frequency.
    """
    scale = float(np.trace(A, axis1=1, axis2=2).real @ weights)
    A = A / scale
    # In units of the limits every multiplier is of order one and the limits are one.
    relative = metrics / limits[:, None, None, None]
    p = limits.size
    share = np.ones(p)
    share *= _best_length(A, relative, share, weights)
    best: tuple[float, Array, float, Array] | None = None
    for step in range(1, _MAX_STEPS + 1):
        point = _Point.at(A, relative, share, weights)
        if best is None or point.gap < best[2]:
            best = (point.bound, share, point.gap, point.powers)
        if best[2] <= _SETTLED or step == _MAX_STEPS:
            break
        direction = _ascent(point, share)
        length = 1.0
        while length > 1e-10:
            trial = np.maximum(share + length * direction, _LEAST_SHARE * share)
            gain = float(point.gradient @ (trial - share))
            if _dual(A, relative, trial, weights) >= point.dual + _SUFFICIENT * gain:
                break
            length *= 0.5
        else:
            break
        if np.array_equal(trial, share):
            break
        share = trial
    assert best is not None
    share = best[1]
    Phi = _Point.at(A, relative, share, weights).spectrum
    powers = np.einsum("pkab,kba,k->p", relative, Phi, weights).real
    Phi = Phi / powers.max()
    multipliers = share * _best_length(A, relative, share, weights)
    return LimitedDesign(
        spectrum=Phi,
        value=scale * float(error_of(A, Phi) @ weights),
        lower_bound=scale * _dual(A, relative, multipliers, weights),
        multipliers=scale * multipliers / limits,
        powers=powers / powers.max() * limits,
        steps=step,
    )


@dataclass(frozen=True)
class _Point:
    """Holds the dual function, its derivatives and the primal it suggests, at one set of multipliers."""

    spectrum: ComplexArray
    powers: Array
    dual: float
    gradient: Array
    hessian: Array
    gap: float
    bound: float

    @classmethod
    def at(cls, A: ComplexArray, metrics: ComplexArray, share: Array, weights: Array) -> _Point:
        M = np.einsum("p,pkab->kab", share, metrics)
        outer, inner = power_of(M, 0.5), power_of(M, -0.5)
        squared, vectors = eigen(outer @ A @ outer)
        root = np.sqrt(squared)
        frame = inner @ vectors
        spectrum = (frame * root[:, None, :]) @ adjoint(frame)
        # In the eigenbasis of the root: U_ab = -y_a y_b / (y_a + y_b) D_ab for a change D of M.
        turned = adjoint(frame) @ metrics @ frame
        powers = np.einsum("pkaa,ka,k->p", turned, root, weights).real
        total = root[:, :, None] + root[:, None, :]
        coupling = np.where(total > 0, root[:, :, None] * root[:, None, :] / np.where(total > 0, total, 1), 0)
        scaled = turned * (coupling * weights[:, None, None])
        p = share.size
        hessian = -(scaled.reshape(p, -1) @ np.conj(turned.reshape(p, -1)).T).real
        half = float(root.sum(axis=1) @ weights)
        dual = 2 * half - float(share.sum())
        bound = half**2 / float(share.sum())
        # tr(A Phi^-1) = tr(M Phi) here, and shrinking Phi into its limits raises it by as much.
        primal = half * float(powers.max())
        return cls(
            spectrum, powers, dual, powers - 1.0, hessian, (primal - bound) / max(primal, 1e-300), bound
        )


def _ascent(point: _Point, share: Array) -> Array:
    """Return Newton's direction in the free variables, damped where the dual is nearly flat."""
    fading = (share < 1e-8 * share.max()) & (point.gradient < 0)
    free = ~fading
    curvature = -point.hessian[np.ix_(free, free)]
    size = share[free]
    scaled = curvature * np.outer(size, size)
    damping = 1e-13 * np.trace(scaled)
    step = np.linalg.solve(scaled + damping * np.eye(size.size), point.gradient[free] * size)
    direction = -share.copy()
    direction[free] = size * step
    return direction


def _dual(A: ComplexArray, metrics: ComplexArray, share: Array, weights: Array) -> float:
    M = np.einsum("p,pkab->kab", share, metrics)
    outer = power_of(M, 0.5)
    roots = np.sqrt(eigen(outer @ A @ outer)[0])
    return float(2 * (roots.sum(axis=1) @ weights) - share.sum())


def _best_length(A: ComplexArray, metrics: ComplexArray, share: Array, weights: Array) -> float:
    """Return t that maximises the dual along t * share: 2 sqrt(t) a - t b is greatest at (a/b)^2."""
    total = float(share.sum())
    half = 0.5 * (_dual(A, metrics, share, weights) + total)
    return (half / total) ** 2
