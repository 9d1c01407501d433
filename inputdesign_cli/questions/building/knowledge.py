"""`uncertainty` -> what is known of the parameters before any data."""

from __future__ import annotations

from inputdesign_cli.questions.building.parameter_draws import drawing, reach
from inputdesign_cli.questions.building.system import build_experiment
from inputdesign_cli.questions.common.knowledge import Knowledge
from inputdesign_cli.specification import Spec

# Of the ellipsoid of a covariance.
_CONFIDENCE = 0.999


def build_knowledge(spec: Spec) -> Knowledge | None:
    """The parameters that plants are drawn from; None where nothing is said, or plants are listed.

    Raises:
        SpecError, DataError: as `drawing`.
    """
    stated = spec.uncertainty
    if stated is None or isinstance(stated.scenarios, tuple):
        return None
    experiment = build_experiment(spec)
    drawing(spec, stated, experiment)  # says what does not fit
    _, centre, columns, box = reach(spec, stated, experiment, _CONFIDENCE)
    return Knowledge(centre, columns, box)
