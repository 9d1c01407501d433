"""Whether an estimate is one of the plants that `uncertainty` states, for which the design was made."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.building.parameter_draws import reach
from inputdesign_cli.questions.building.system import build_experiment
from inputdesign_cli.specification import Spec

# The ellipsoid of a stated covariance, and the deviations by which an estimate may be off.
_CONFIDENCE, _OFF = 0.998, 3.0

Foreseen = Callable[[Array, Array], bool]


def build_foreseen(spec: Spec, nominal: Model) -> Foreseen | None:
    """Tells of parameters (k,) and their covariance (k, k); None without a stated region.

    A parameter of G that is not drawn must be that of the spec, as far as the estimate tells.
    """
    stated = spec.uncertainty
    if stated is None or isinstance(stated.scenarios, tuple):
        return None
    of_plant = np.flatnonzero(nominal.in_plant)

    def foreseen(theta: Array, covariance: Array) -> bool:
        _, centre, columns, box = reach(spec, stated, build_experiment(spec), _CONFIDENCE)
        away = (theta[: centre.size] - centre)[of_plant]
        own = _OFF**2 * covariance[np.ix_(of_plant, of_plant)]
        wide = columns[of_plant]
        if box:
            return bool(np.all(np.abs(away) <= np.abs(wide).sum(axis=1) + np.sqrt(np.diag(own))))
        return bool(away @ np.linalg.solve(wide @ wide.T + own, away) <= 1.0)

    return foreseen
