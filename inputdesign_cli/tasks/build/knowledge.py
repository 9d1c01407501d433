"""`uncertainty` -> what is known of the parameters before any data."""

from __future__ import annotations

from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.parameter_draws import drawing, reach
from inputdesign_cli.tasks.build.system import build_experiment
from inputdesign_cli.tasks.knowledge import Knowledge

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
