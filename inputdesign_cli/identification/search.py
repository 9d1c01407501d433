"""Gauss-Newton with Levenberg's damping on many prediction-error problems at once.

Each run has its own damping and leaves the batch when it has settled. Steps that would make the predictor
(C, F) or the noise model (D) unstable are mirrored into the unit circle. Ljung (1999), Section 10.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.identification.predictor import moments
from inputdesign_cli.identification.stability import is_stable, reflected
from inputdesign_cli.identification.structure import Structure
from inputdesign_cli.plant.polynomial import Array

# Settled: the next step, squared and in standard deviations of the estimate, is this small. It is still
# taken; the steps shrink at least tenfold where the model fits, so that what is left is far smaller.
_SETTLED = 1e-10
_MOST_STEPS = 150
_FIRST_DAMPING = 1e-3
_LEAST_DAMPING = 1e-8
_MOST_DAMPING = 1e8
_TRUSTED = 0.25
# Rounding of a sum of squares: a cost that rises by less has not risen.
_ROUNDING = 1e-12
_RIDGE = 1e-14


@dataclass(frozen=True)
class Minimum:
    """Where the search ended: theta (runs, k), cost (runs,), psi^T psi (runs, k, k) there."""

    theta: Array
    cost: Array
    hessian: NDArray[np.float64]
    converged: NDArray[np.bool_]
    steps: NDArray[np.int64]


def minimise(structure: Structure, start: Array, u: Array, y: Array) -> Minimum:
    """Minimise the sum of squared prediction errors from `start` (runs, k); u, y (samples, runs)."""
    theta = stabilised(structure, start)
    runs = theta.shape[0]
    cost, hessian, slope = _evaluate(structure, theta, u, y)
    damping = np.full(runs, _FIRST_DAMPING)
    converged, steps = np.zeros(runs, dtype=bool), np.zeros(runs, dtype=np.int64)
    active = np.flatnonzero(np.isfinite(cost))
    u_active, y_active = u[:, active], y[:, active]
    for _ in range(_MOST_STEPS):
        newton, gain = _step(hessian[active], slope[active], np.zeros(active.size))
        settled = gain * (u.shape[0] / np.maximum(cost[active], 1e-300)) < _SETTLED
        settled |= cost[active] <= 0.0
        converged[active[settled]] = True
        theta[active[settled]] = stabilised(structure, theta[active[settled]] + newton[settled])
        lost = ~settled & (damping[active] > _MOST_DAMPING)
        going = ~(settled | lost)
        if not np.all(going):
            active, newton = active[going], newton[going]
            u_active, y_active = u_active[:, going], y_active[:, going]
        if not active.size:
            break
        damped = damping[active] > _LEAST_DAMPING
        move, gain = newton.copy(), gain[going]
        if np.any(damped):
            some = active[damped]
            move[damped], gain[damped] = _step(hessian[some], slope[some], damping[some])
        trial = stabilised(structure, theta[active] + move)
        trial_cost, trial_hessian, trial_slope = _evaluate(structure, trial, u_active, y_active)
        steps[active] += 1
        better = trial_cost <= cost[active] * (1.0 + _ROUNDING)
        chosen = active[better]
        # Where the quadratic model promised much more than it kept, it is trusted less.
        kept = (cost[active] - trial_cost)[better] >= _TRUSTED * gain[better]
        theta[chosen], cost[chosen] = trial[better], trial_cost[better]
        hessian[chosen], slope[chosen] = trial_hessian[better], trial_slope[better]
        damping[chosen] *= np.where(kept, 0.1, 4.0)
        damping[chosen] = np.maximum(damping[chosen], np.where(kept, 0.0, _FIRST_DAMPING))
        worse = active[~better]
        damping[worse] = 10.0 * np.maximum(damping[worse], 1e-4)
    return Minimum(theta, cost, hessian, converged, steps)


def stabilised(structure: Structure, theta: Array) -> Array:
    """theta (runs, k) with the roots of C, D and F mirrored into the unit circle where they are outside."""
    theta = theta.copy()
    for letter in "cdf":
        columns = structure.columns[letter]
        if columns.stop == columns.start:
            continue
        monic = np.concatenate([np.ones((theta.shape[0], 1)), theta[:, columns]], axis=1)
        for run in np.flatnonzero(~is_stable(monic)):
            theta[run, columns] = reflected(monic[run])[1:]
    return theta


def _evaluate(
    structure: Structure, theta: Array, u: Array, y: Array
) -> tuple[Array, NDArray[np.float64], Array]:
    """Cost (runs,), psi^T psi (runs, k, k) and psi^T epsilon (runs, k); an overflow costs infinity."""
    with np.errstate(over="ignore", invalid="ignore"):
        cost, hessian, slope = moments(structure, theta, u, y)
    finite = np.isfinite(cost) & np.isfinite(hessian).all(axis=(1, 2)) & np.isfinite(slope).all(axis=1)
    if not np.all(finite):
        cost, hessian[~finite], slope[~finite] = np.where(finite, cost, np.inf), np.eye(structure.size), 0.0
    return cost, hessian, slope


def _step(hessian: NDArray[np.float64], slope: Array, damping: Array) -> tuple[Array, Array]:
    """(H + damping diag H)^-1 g (runs, k) in scaled coordinates, and the gain that it promises (runs,)."""
    k = slope.shape[1]
    scale = np.sqrt(np.maximum(np.einsum("rii->ri", hessian), 1e-300))
    scaled = hessian / (scale[:, :, None] * scale[:, None, :])
    scaled = scaled + (damping + _RIDGE)[:, None, None] * np.eye(k)
    step = np.linalg.solve(scaled, (slope / scale)[:, :, None])[:, :, 0] / scale
    return step, np.abs(np.einsum("ri,ri->r", step, slope))
