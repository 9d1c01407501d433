"""Are several experiments of one system? The score test of parameters that differ ([engle-1984]).

At the joint estimate the scores g_i of the experiments add up to zero. One step from there, the estimate of
experiment i is H_i^-1 g_i away and that of all others -H_o^-1 g_i, with the variances H_i^-1 and H_o^-1: so
g_i^T (H_i^-1 + H_o^-1) g_i is chi-squared with as many degrees of freedom as both determine parameters.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.record_problem import Point

# Directions of which one side has less than this share of the information are the other's alone.
_OF_ONE_SIDE = 1e-6


def of_one_system(point: Point, noise: Array, experiments: Sequence[int]) -> tuple[float, ...]:
    """Return the probability that each experiment differs from the others as much, if all are of one system.

    Args:
        point: the joint estimate.
        noise: (p, p), the covariance of e.
        experiments: the samples of each; of a single one nothing is said.
    """
    if len(experiments) < 2:
        return ()
    root = np.linalg.cholesky(np.linalg.inv(noise)).T
    at = np.cumsum(experiments)[:-1]
    rows = [psi @ root.T for psi in np.split(point.psi, at, axis=1)]
    errors = [e @ root.T for e in np.split(point.errors, at)]
    # Of each by its own noise, which need not be that of the others.
    scale = [np.sqrt(max(float(np.mean(e**2)), 1e-300)) for e in errors]
    flat = [(psi / s).reshape(len(psi), -1) for psi, s in zip(rows, scale, strict=True)]
    scores = [psi @ (e / s).ravel() for psi, e, s in zip(flat, errors, scale, strict=True)]
    return tuple(_probability(flat, scores, i) for i in range(len(experiments)))


def _probability(flat: Sequence[Array], scores: Sequence[Array], chosen: int) -> float:
    """That of one experiment against all others, in coordinates where both together have unit information."""
    joint = np.concatenate(flat, axis=1)
    left, sizes, _ = np.linalg.svd(joint, full_matrices=False)
    kept = sizes > _OF_ONE_SIDE * sizes[0]
    turn = (left[:, kept] / sizes[kept]).T
    own = turn @ flat[chosen]
    shares, axes = np.linalg.eigh(own @ own.T)
    both = (shares > _OF_ONE_SIDE) & (shares < 1.0 - _OF_ONE_SIDE)
    if not np.any(both):
        return 1.0
    shares, axes = shares[both], axes[:, both]
    other = np.sum([score for i, score in enumerate(scores) if i != chosen], axis=0)
    mine, theirs = (axes.T @ (turn @ score) for score in (scores[chosen], other))
    apart = mine / shares - theirs / (1.0 - shares)
    statistic = float(np.sum(apart**2 / (1.0 / shares + 1.0 / (1.0 - shares))))
    return float(scipy.special.chdtrc(len(shares), statistic))
