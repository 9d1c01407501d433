"""Solve the finite programs of the exchange by a primal-dual interior-point method on dense blocks.

A program minimises q^T v subject to S_b(v) in its cone for every block b, with a multiplier Z_b each. The
directions come from [helmberg-1996], with the corrector of [mehrotra-1992]. Many matrix inequalities contain
the same M(v). Their part of the linear system is summed over them, as a matrix of the entries of M, and only
then mapped to the unknowns. A further inequality therefore costs next to nothing. A general solver maps each
of them to all unknowns. Smooth concave functions of M (determinant, inverse trace) enter with their
curvature, not by matrix inequalities of twice the order.

Its answer is a suggestion like any solver's: the bound is evaluated from the multipliers by `certificate`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.design.convex.cones import Cone

_MOST_ITERATIONS = 100
_NEAREST, _FURTHEST = 0.9, 0.09  # a step goes 0.9 to 0.99 of the way to the boundary of the cones
_REGULAR = 1e-16
_REFINEMENTS = 2
# Iterations without a smaller error after which the method ends, far from the optimum and near it.
_PATIENCE, _PATIENCE_NEAR = 8, 2
_ROUNDING = 1e-5  # the error below which rounding may prevent progress


@dataclass(frozen=True)
class Seen:
    """The blocks that depend on one information matrix, through a = `offset` (e,) + `gains` (e, n) v."""

    cones: Sequence[Cone]
    offset: Array
    gains: Array


@dataclass(frozen=True)
class Reached:
    """Holds the best iterate v (n,), multipliers of each block, its largest error, and iterations taken."""

    v: Array
    multipliers: list[list[Array]]
    error: float
    iterations: int


def follow_path(
    q: Array, start: Array, direct: Sequence[Cone], through: Sequence[Seen], *, tolerance: float
) -> Reached:
    """Solve to a tolerance on gap and residuals, relative to an objective of order one.

    Args:
        q: (n,) the cost.
        start: (n,) unknowns inside of their cones.
        direct: blocks of v.
        through: blocks of an a that is linear in v; their multipliers follow the ones of `direct`.

    Raises:
        InaccurateError: `out-of-time`.
    """
    cones = [*direct, *(cone for seen in through for cone in seen.cones)]
    degree, unit = sum(cone.degree for cone in cones), 1.0 + float(np.abs(q).max())
    v, best, kept = start, Reached(start, [], np.inf, 0), 0
    for iteration in range(_MOST_ITERATIONS):
        seconds_left()
        try:
            missed = max([_look(direct, v), *(_look(s.cones, s.offset + s.gains @ v) for s in through)])
            weight = sum((c.pull() for c in direct), np.zeros(v.size))
            for seen in through:
                weight = weight + seen.gains.T @ sum(c.pull() for c in seen.cones)
            gap = sum(cone.gap for cone in cones)
            error = max(gap / (1.0 + abs(float(q @ v))), missed, float(np.abs(q - weight).max()) / unit)
            if error < best.error:
                kept = iteration
                best = Reached(v, [c.multipliers() for c in cones], error, iteration)
            patience = _PATIENCE if best.error > _ROUNDING else _PATIENCE_NEAR
            if error <= tolerance or iteration - kept > patience or not np.isfinite(error):
                break
            up, down = _step(q, v, direct, through, gap, degree)
        except (np.linalg.LinAlgError, FloatingPointError):  # beyond what double precision holds
            break
        v = v + up[0] * up[1]
        for cone in cones:
            cone.move(up[0], down)
    return best


def _look(cones: Sequence[Cone], at: Array) -> float:
    return max((cone.look(at) for cone in cones), default=0.0)


def _step(
    q: Array, v: Array, direct: Sequence[Cone], through: Sequence[Seen], gap: float, degree: int
) -> tuple[tuple[float, Array], float]:
    """Compute predictor and corrector: (length, direction) of the unknowns and the multipliers' length."""
    cones = [*direct, *(cone for seen in through for cone in seen.cones)]
    matrix = np.zeros((v.size, v.size))
    for seen in through:
        entries = np.zeros((seen.offset.size, seen.offset.size))
        for cone in seen.cones:
            cone.add_to(entries)
        matrix += seen.gains.T @ (entries @ seen.gains)
    for cone in direct:
        cone.add_to(matrix)
    solve = _factored(matrix)

    def towards(target: float, *, corrected: bool) -> Array:
        pushed = sum((c.push(target, corrected=corrected) for c in direct), np.zeros(v.size))
        for seen in through:
            pushed = pushed + seen.gains.T @ sum(c.push(target, corrected=corrected) for c in seen.cones)
        step = solve(pushed - q)
        for cone in direct:
            cone.turn(step)
        for seen in through:
            for cone in seen.cones:
                cone.turn(seen.gains @ step)
        return step

    towards(0.0, corrected=False)
    up, down = _lengths(cones, 1.0)
    after = sum(cone.gap_after(up, down) for cone in cones)
    power = max(1.0, 3.0 * min(up, down) ** 2)
    sigma = min(1.0, max(after / gap, 0.0) ** power)
    step = towards(sigma * gap / degree, corrected=True)
    up, down = _lengths(cones, _NEAREST + _FURTHEST * min(up, down))
    if any(cone.curved for cone in cones):
        up = down = min(up, down)  # with curvature, primal and dual steps need the same length
    return (up, step), down


def _lengths(cones: Sequence[Cone], share: float) -> tuple[float, float]:
    reached = [cone.lengths() for cone in cones]
    up, down = min(u for u, _ in reached), min(d for _, d in reached)
    return min(1.0, share * up), min(1.0, share * down)


def _factored(matrix: Array) -> Callable[[Array], Array]:
    """Return a solver with this positive definite matrix, with iterative refinement of rounding."""
    diagonal = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    unit = matrix / diagonal / diagonal[:, None]
    lifted = unit + _REGULAR * len(matrix) * np.eye(len(matrix))
    factor = scipy.linalg.cho_factor(lifted, check_finite=False)

    def solve(right: Array) -> Array:
        right = right / diagonal
        found = scipy.linalg.cho_solve(factor, right, check_finite=False)
        for _ in range(_REFINEMENTS):
            found = found + scipy.linalg.cho_solve(factor, right - unit @ found, check_finite=False)
        return found / diagonal

    return solve
