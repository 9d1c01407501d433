"""Gauss-Newton with Levenberg's damping on many prediction-error problems at once.

Each run has its own damping and leaves the batch when it has settled. Steps that would make the predictor
unstable are mirrored back by the problem. The search is that of [ljung-1999], Section 10.2, the damping
that of [levenberg-1944].
"""

from __future__ import annotations

from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array

# Settled: the next step, squared and in standard deviations of the estimate, is this small. It is still
# taken; the steps shrink at least tenfold where the model fits, so that the remaining error is far smaller.
SETTLED = 1e-10
MOST_STEPS = 150
_FIRST_DAMPING = 1e-3
_LEAST_DAMPING = 1e-8
_MOST_DAMPING = 1e8
_TRUSTED = 0.25  # the damping falls if a step gains this share of the promised decrease
# Rounding of a sum of squares: a cost that rises by less has not risen.
_ROUNDING = 1e-12
_RIDGE = 1e-14
# Checked every _WATCHED steps: a run is stuck if it lowered -2 log likelihood by less than _STUCK, and less
# than _SHARE of the decrease that its next step promises. A promise below _NEGLIGIBLE is rounding.
_WATCHED = 10
_STUCK, _SHARE = 0.05, 0.01
_NEGLIGIBLE = 1e-6


class Problem(Protocol):
    """Many runs of one nonlinear least-squares problem."""

    @property
    def errors(self) -> int:
        """Return the number of prediction errors of a run."""

    def at(self, theta: Array) -> tuple[Array, Array, Array]:
        """Return cost (runs,), half its first-order Hessian (runs, k, k), minus half its gradient (runs, k).

        A cost that overflows is infinite.
        """

    def stabilised(self, theta: Array) -> Array:
        """Return a copy of theta (runs, k), changed where its predictor would be unstable."""

    def kept(self, runs: NDArray[np.bool_]) -> Self:
        """Return the same problem with some of its runs only."""


class Minimum(NamedTuple):
    """The end of the search: theta (runs, k), cost (runs,), and the Hessian of `Problem.at` there."""

    theta: Array
    cost: Array
    hessian: Array
    converged: NDArray[np.bool_]
    steps: NDArray[np.int64]

    def and_of(self, other: Minimum, runs: NDArray[np.bool_] | slice = slice(None)) -> Minimum:
        """Return these runs, followed by some `runs` of another minimum."""
        return Minimum(*(np.concatenate([mine, its[runs]]) for mine, its in zip(self, other, strict=True)))


def minimise(
    problem: Problem, start: Array, *, most: int = MOST_STEPS, idle: float = 0.0, settled_at: float = SETTLED
) -> Minimum:
    """Minimise the cost of every run from `start` (runs, k), in `most` steps at most.

    Args:
        settled_at: the square of the last step, in standard deviations of the estimate.
        idle: the decrease of -2 log likelihood in ten steps below which a run has settled. It has settled as
            well if no step, however short, decreases the cost. If `idle` is zero, this run is given up.
    """
    theta = problem.stabilised(start)
    runs = theta.shape[0]
    cost, hessian, slope = problem.at(theta)
    damping = np.full(runs, _FIRST_DAMPING)
    converged, steps = np.zeros(runs, dtype=bool), np.zeros(runs, dtype=np.int64)
    finite = np.isfinite(cost)
    active, earlier = np.flatnonzero(finite), cost.copy()
    going_on = problem if np.all(finite) else problem.kept(finite)
    for number in range(most + 1):
        newton, gain = _step(hessian[active], slope[active], np.zeros(active.size))
        least = np.maximum(cost[active], 1e-300)
        promised = gain * (problem.errors / least)
        stuck = damping[active] > _MOST_DAMPING
        if number and number % _WATCHED == 0:
            took = problem.errors * np.log(np.maximum(earlier[active], 1e-300) / least)
            stuck |= took <= idle if idle else (took < _STUCK) & (took < _SHARE * promised)
            earlier = cost.copy()
        # Rounding hides a decrease that is nearly zero.
        settled = (promised < settled_at) | (cost[active] <= 0.0) | (stuck & (promised < _NEGLIGIBLE))
        converged[active[settled]] = True
        theta[active[settled]] = problem.stabilised(theta[active[settled]] + newton[settled])
        lost = ~settled & stuck
        converged[active[lost]] = idle > 0.0
        going = ~(settled | lost)
        if not np.all(going):
            active, newton = active[going], newton[going]
            going_on = going_on.kept(going)
        if not active.size or number == most:
            break
        damped = damping[active] > _LEAST_DAMPING
        move, gain = newton.copy(), gain[going]
        if np.any(damped):
            some = active[damped]
            move[damped], gain[damped] = _step(hessian[some], slope[some], damping[some])
        trial = problem.stabilised(theta[active] + move)
        trial_cost, trial_hessian, trial_slope = going_on.at(trial)
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


def best_run(found: Minimum) -> int:
    """Return the run of least cost, of several starts of one record; a settled one if it is as good."""
    best = int(np.argmin(np.where(np.isfinite(found.cost), found.cost, np.inf)))
    settled = found.converged & (found.cost <= found.cost[best] * (1 + 1e-6))
    if np.any(settled):
        best = int(np.flatnonzero(settled)[np.argmin(found.cost[settled])])
    return best


def _step(hessian: Array, slope: Array, damping: Array) -> tuple[Array, Array]:
    """Return the step (H + damping diag H)^-1 g (runs, k), scaled, and the gain that it promises (runs,)."""
    k = slope.shape[1]
    scale = np.sqrt(np.maximum(np.einsum("rii->ri", hessian), 1e-300))
    scaled = hessian / (scale[:, :, None] * scale[:, None, :])
    scaled = scaled + (damping + _RIDGE)[:, None, None] * np.eye(k)
    step = np.linalg.solve(scaled, (slope / scale)[:, :, None])[:, :, 0] / scale
    return step, np.abs(np.einsum("ri,ri->r", step, slope))
