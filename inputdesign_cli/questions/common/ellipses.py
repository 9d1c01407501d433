"""Predicted confidence ellipses of pairs of parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome.curves import Ellipse, EllipseCurves

_PAIRS = 6


Pairs = Sequence[tuple[str, str]]


def experiment_ellipses(
    experiment: Experiment, information: Array, white: Array | None, pairs: Pairs | None
) -> EllipseCurves | None:
    """The chosen `pairs`, by default those most correlated where there are several channels.

    Args:
        information, white: (k, k) in the coordinates of `experiment`, by the design and by flat excitation.

    Returns:
        None when there is no pair to show, or some parameter has no finite variance.
    """
    single = experiment.model.outputs == experiment.model.inputs == 1
    if experiment.size < 2 or (pairs is None and single):
        return None
    try:
        covariance = experiment.raw_covariance(information)
        flat = None if white is None else experiment.raw_covariance(white)
    except np.linalg.LinAlgError:  # a parameter that this excitation does not show
        return None
    names, theta = experiment.model.names, experiment.model.theta
    if pairs is None:
        scale = np.sqrt(np.diag(covariance))
        correlation = np.triu(np.abs(covariance / np.outer(scale, scale)), 1)
        order = np.argsort(-correlation, axis=None)[: min(_PAIRS, len(names) * (len(names) - 1) // 2)]
        index = [tuple(int(i) for i in np.unravel_index(at, correlation.shape)) for at in order]
    else:
        index = [(names.index(a), names.index(b)) for a, b in pairs]
    found = []
    for i, j in index:
        chosen = np.ix_([i, j], [i, j])
        found.append(
            Ellipse(
                (names[i], names[j]),
                theta[[i, j]],
                covariance[chosen],
                None if flat is None else flat[chosen],
            )
        )
    return EllipseCurves(tuple(found))
