"""Knowledge of the parameters besides the data decides which of several minima may be that of the plant.

A signal that repeats shows a dead time only up to whole periods, and other minima explain a record nearly as
well. Who says that it is 25 s within 30 % has said that it is not ten minutes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification import Estimate, Rival

# People are surer than they should be: parameters count as possible to this many times the stated distance.
_ROOM = 3.0
# Of its own deviations, by which an estimate may be off.
_OFF = 3.0


@dataclass(frozen=True)
class Knowledge:
    """Holds the region centre + columns z, (k,) and (k, m): z in the unit ball, with `box` in [-1, 1]^m.

    Of directions without a column nothing is known.
    """

    centre: Array
    columns: Array
    box: bool

    def coordinates(self, theta: Array) -> Array:
        """Return the coordinates z (m,) of parameters (k,)."""
        return np.asarray(np.linalg.lstsq(self.columns, theta - self.centre, rcond=None)[0], dtype=float)

    def admits(self, theta: Array) -> bool:
        """Return whether parameters (k,) are possible."""
        z = self.coordinates(theta)
        size = np.max(np.abs(z), initial=0.0) if self.box else np.linalg.norm(z)
        return bool(size <= _ROOM)


@dataclass(frozen=True)
class Foreseen:
    """Holds the plants that a design was made for: a region of the parameters `of_plant` (indices)."""

    region: Knowledge
    of_plant: NDArray[np.int64]

    def admits(self, theta: Array, covariance: Array) -> bool:
        """Return whether an estimate (k,) with its covariance (k, k) is one of these plants."""
        of_plant, centre = self.of_plant, self.region.centre
        away = (theta[: centre.size] - centre)[of_plant]
        own = _OFF**2 * covariance[np.ix_(of_plant, of_plant)]
        wide = self.region.columns[of_plant]
        if self.region.box:
            return bool(np.all(np.abs(away) <= np.abs(wide).sum(axis=1) + np.sqrt(np.diag(own))))
        return bool(away @ np.linalg.solve(wide @ wide.T + own, away) <= 1.0)


def that_agrees(
    knowledge: Knowledge | None, estimate: Estimate, near: Callable[[Array], Estimate]
) -> tuple[Estimate, tuple[Rival, ...]]:
    """Return the likeliest minimum that agrees with the knowledge, and the minima that do not."""
    minima = (Rival(estimate.theta, 0.0), *estimate.search.rivals)
    admitted = [one for one in minima if knowledge is None or knowledge.admits(one.theta)]
    if not admitted or len(admitted) == len(minima):
        return estimate, ()
    home = admitted[0]
    known = {id(one) for one in admitted}
    others = [
        (id(one) in known, Rival(one.theta, one.excess - home.excess)) for one in minima if one is not home
    ]
    found = estimate if home is minima[0] else near(home.theta)
    rivals, ruled_out = (tuple(one for agrees, one in others if agrees is kept) for kept in (True, False))
    return found.with_rivals(rivals), ruled_out
