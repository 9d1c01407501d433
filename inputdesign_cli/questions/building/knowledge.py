"""`uncertainty` -> what is known of the parameters before any data, and the plants of a design."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.building.parameter_draws import drawing, reach, second_moments
from inputdesign_cli.questions.building.system import build_experiment
from inputdesign_cli.questions.common.knowledge import Foreseen, Knowledge
from inputdesign_cli.specification import Spec

# Of the ellipsoid of a covariance: what is possible, and what the design was made for.
_POSSIBLE, _DESIGNED = 0.999, 0.998
# An `estimate` block farther from the plant, in standard deviations, is about another one.
_AWAY = 3.0


def build_knowledge(spec: Spec) -> Knowledge | None:
    """Return the parameters that plants are drawn from; None where nothing is said, or plants are listed.

    Raises:
        SpecError, DataError: as `drawing`.
    """
    stated = spec.uncertainty
    if stated is not None and not isinstance(stated.scenarios, tuple):
        drawing(spec, stated, build_experiment(spec))  # says what does not fit
    return _region(spec, _POSSIBLE)


def build_foreseen(spec: Spec, nominal: Model) -> Foreseen | None:
    """Return the plants that the design was made for; None without a stated region."""
    region = _region(spec, _DESIGNED)
    return None if region is None else Foreseen(region, np.flatnonzero(nominal.in_plant))


def _region(spec: Spec, confidence: float) -> Knowledge | None:
    stated = spec.uncertainty
    if stated is None or isinstance(stated.scenarios, tuple):
        return None
    _, centre, columns, box = reach(spec, stated, build_experiment(spec), confidence)
    return Knowledge(centre, columns, box)


def build_nominal_covariance(spec: Spec, nominal: Model) -> Array:
    """Return the covariance (k, k) of the parameters of the spec's own plant; zero where it states none.

    It is that of `uncertainty`, or else of the `estimate` block that identify wrote.
    """
    covariance = np.zeros((nominal.theta.size, nominal.theta.size))
    if spec.uncertainty is not None:
        moments = second_moments(spec, spec.uncertainty, build_experiment(spec))
        covariance[: len(moments), : len(moments)] = moments
    elif spec.estimate is not None:
        names = list(nominal.names)
        rows = [row for row, name in enumerate(spec.estimate.parameters) if name in names]
        own = [names.index(list(spec.estimate.parameters)[row]) for row in rows]
        stated = np.array(spec.estimate.covariance, dtype=float)[np.ix_(rows, rows)]
        away = np.array(list(spec.estimate.parameters.values()))[rows] - nominal.theta[own]
        if np.all(np.abs(away) <= _AWAY * np.sqrt(np.diag(stated))):
            covariance[np.ix_(own, own)] = stated
    return covariance
