"""Predicted errors and ellipses for records that are longer or shorter than the design counts."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.bound import bound_curves
from inputdesign_cli.questions.common.ellipses import Pairs, experiment_ellipses


def curves_of_length(
    units: Units,
    experiment: Experiment,
    information: Array,
    white: Array | None,
    errors: Sequence[OnModelError],
    samples: int,
    *,
    stated: bool,
    ellipses: Pairs | None,
) -> dict[str, Curves]:
    """`bound` and `ellipses` of records of `samples` samples with the same spectrum, as far as they exist.

    Args:
        information, white: (k, k) for `experiment.samples`, see `experiment_ellipses`.
        stated: whether a requirement states r_adm.
    """
    found: dict[str, Curves] = {}
    longer = experiment.of_length(information, samples)
    flat = None if white is None else experiment.of_length(white, samples)
    with suppress(np.linalg.LinAlgError):  # a parameter that the design does not excite
        found["bound"] = bound_curves(units, errors, longer, stated=stated)[1]
    drawn = experiment_ellipses(experiment, longer, flat, ellipses)
    return found if drawn is None else found | {"ellipses": drawn}
