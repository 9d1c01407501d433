"""Compute the information matrix of a record whose initial state and level are unknown."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.estimate import information_of
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.record_problem import evaluate
from inputdesign_cli.identification.records import Records
from inputdesign_cli.plant import Model

# Numbers that unknown starts may take up: inputs of long dead times are taken for known beyond.
_MOST = 2e7


def information_begun_anywhere(model: Model, u: Array, y: Array, step: float) -> Array:
    """(k, k): sum over the samples of psi Lambda^-1 psi^T, less what unknown starts may explain.

    Args:
        u, y: (N, r), (N, p), signals without noise; the excitation of both is all that is counted.
        step: time between samples of a plant in continuous time.
    """
    kind = estimator(model, step).kind
    weights = np.asarray(np.linalg.inv(model.covariance), dtype=float)
    records = Records((kind.record(u, y),), weights=weights)
    late = records.lateness(model.theta)
    columns = late * u.shape[1] * y.shape[1]
    free = records.begun_freely(late if columns * y.size <= _MOST else 0)
    return information_of(free, evaluate(free, model.theta), model.covariance)
