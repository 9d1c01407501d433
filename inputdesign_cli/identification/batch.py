"""Many prediction-error estimates in one pass: the Monte Carlo study's own estimator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.identification.problem import PredictionErrors
from inputdesign_cli.identification.search import minimise
from inputdesign_cli.identification.structure import Structure
from inputdesign_cli.plant.polynomial import Array

# Many runs share the cost of a pass over time; with more than this the blocks no longer fit the cache.
_BATCH = 512


@dataclass(frozen=True)
class BatchEstimate:
    """Estimates of many runs.

    Attributes:
        theta: (runs, k).
        variance: (runs,) of the noise e, unbiased to first order.
        information: (runs, k, k) psi^T psi / variance; its inverse is the covariance of theta.
        converged: (runs,).
        steps: (runs,) of the search.
    """

    theta: Array
    variance: Array
    information: NDArray[np.float64]
    converged: NDArray[np.bool_]
    steps: NDArray[np.int64]

    @property
    def covariance(self) -> NDArray[np.float64]:
        """(runs, k, k)."""
        return np.asarray(np.linalg.inv(self.information), dtype=float)


def fit_batch(structure: Structure, u: ArrayLike, y: ArrayLike, *, start: ArrayLike) -> BatchEstimate:
    """Prediction-error estimates of many records.

    Args:
        u, y: (runs, samples); in closed loop the same (direct identification).
        start: (k,) for all runs, or (runs, k).
    """
    u, y = np.atleast_2d(np.asarray(u, dtype=float)), np.atleast_2d(np.asarray(y, dtype=float))
    runs, samples = y.shape
    begin = np.broadcast_to(np.asarray(start, dtype=float), (runs, structure.size))
    parts = [
        minimise(
            PredictionErrors.single(
                structure.row,
                [np.ascontiguousarray(u[first : first + _BATCH].T)],
                np.ascontiguousarray(y[first : first + _BATCH].T),
            ),
            begin[first : first + _BATCH],
        )
        for first in range(0, runs, _BATCH)
    ]
    cost = np.concatenate([p.cost for p in parts])
    variance = cost / max(samples - structure.size, 1)
    hessian = np.concatenate([p.hessian for p in parts])
    return BatchEstimate(
        theta=np.concatenate([p.theta for p in parts]),
        variance=variance,
        information=hessian / np.maximum(variance, 1e-300)[:, None, None],
        converged=np.concatenate([p.converged for p in parts]),
        steps=np.concatenate([p.steps for p in parts]),
    )
