"""Look in advance for distant minima of the likelihood, which may leave the data of a design undecided.

The local covariance knows of one minimum. A dead time that few frequencies excite has others, whole periods
away. A record of the design is simulated on the nominal plant and estimated with the search of `identify`.
Knowledge besides the data rules minima out: a dead time known as 25 s within 30 % is not ten minutes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import ModelError, OnModelError, Requirement, model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import (
    Counted,
    OutOfTimeError,
    report_progress,
    seconds_left,
    what_ended,
)
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.rivals import Apart, beyond, foreseen_entries, foreseen_rivals, not_foreseen
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.monte_carlo.study import searched_run
from inputdesign_cli.outcome.design import Foreseen as Entry
from inputdesign_cli.outcome.simulation import Searched
from inputdesign_cli.outcome.units import Units

if TYPE_CHECKING:
    from inputdesign_cli.identification import Earlier, Estimate, Rival

_SEED = 0
# Measured seconds of a search per sample, input, output and parameter; the longest search that is begun.
_SECONDS, _LONGEST = 1.2e-4, 20.0
# Errors after which a simulated search says nothing.
_ENDS = (IdesignError, ArithmeticError, ValueError, RuntimeWarning)
# Stated knowledge is often too narrow: parameters are possible up to this multiple of the stated distance.
_ROOM = 3.0
# An estimate may be off by this many of its standard deviations.
_DEVIATIONS = 3.0


@dataclass(frozen=True)
class Knowledge:
    """Holds the region centre + columns z, (k,) and (k, m): z in the unit ball, with `box` in [-1, 1]^m.

    Nothing is known about directions without a column.
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

    def missed(self, theta: Array, covariance: Array) -> NDArray[np.int64] | None:
        """Return the parameters (indices) of an estimate (k,) for whose values the design was not made.

        They lie beyond their intervals by more than their own covariance (k, k) explains; for an ellipsoid
        all parameters of the plant are returned. None: the estimate is one of the plants.
        """
        of_plant, centre = self.of_plant, self.region.centre
        away = (theta[: centre.size] - centre)[of_plant]
        own = _DEVIATIONS**2 * covariance[np.ix_(of_plant, of_plant)]
        wide = self.region.columns[of_plant]
        if self.region.box:
            beyond = np.abs(away) > np.abs(wide).sum(axis=1) + np.sqrt(np.diag(own))
            return of_plant[beyond] if np.any(beyond) else None
        return None if away @ np.linalg.solve(wide @ wide.T + own, away) <= 1.0 else of_plant


def that_agrees(
    knowledge: Knowledge | None, estimate: Estimate, near: Callable[[Array], Estimate]
) -> tuple[Estimate, tuple[Rival, ...]]:
    """Return the likeliest minimum that agrees with the knowledge, and the minima that do not."""
    from inputdesign_cli.identification import Rival

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


@dataclass(frozen=True)
class Foresight:
    """Predicts an experiment's data from the nominal plant and prior, both in raw parameters.

    `entries` are the errors for r_u if none is bounded. `earlier` is combined with data that are assessed.
    `knowledge` of the parameters rules rivals out. Nothing is simulated unless it `looks`.
    """

    units: Units
    nominal: Experiment
    entries: Sequence[ModelError]
    earlier: Earlier | None
    advice: str
    knowledge: Knowledge | None = None
    looks: bool = True

    def foreseen(
        self, record: Array, requirements: Sequence[Requirement]
    ) -> tuple[Entry | None, list[Finding]]:
        """Return the rivals that fit a record (n, r) (None: not known), with findings on them."""
        nominal = self.nominal
        seconds = _SECONDS * len(record) * nominal.inputs * nominal.model.outputs * len(nominal.model.names)
        if not self.looks:
            return None, [not_foreseen("solver.any_spectrum: false (or --fast)")]
        if seconds > _LONGEST:
            return None, [not_foreseen("the record is long")]
        try:
            late = seconds > seconds_left()
        except OutOfTimeError:
            late = True
        if late:
            return None, [not_foreseen(f"{what_ended()} left no time")]
        try:
            estimate, _, found = self._searched(record, requirements, np.random.default_rng(_SEED))
        except _ENDS:
            return None, []
        entry = Entry(foreseen_entries(self.units, estimate, found))
        return entry, list(foreseen_rivals(self.units, estimate, found, self.advice))

    def tried(self, record: Array, requirements: Sequence[Requirement], runs: int) -> Searched | None:
        """Return how many of `runs` simulations end elsewhere and how many leave rivals; None if unknown."""
        elsewhere, rivals = 0, 0
        for done, rng in enumerate(np.random.default_rng(_SEED).spawn(runs)):
            report_progress(Counted("records searched from several starts", done, runs))
            try:
                _, at_home, found = self._searched(record, requirements, rng)
            except _ENDS:
                return None
            better = any(one.rival.excess < 0.0 for one in found)
            elsewhere += better and not at_home
            rivals += bool(found)
        return Searched(runs, elsewhere, rivals)

    def _searched(
        self, record: Array, requirements: Sequence[Requirement], rng: np.random.Generator
    ) -> tuple[Estimate, bool, list[Apart]]:
        """Return a simulated estimate, whether it is the nearest minimum, and the rivals that are apart."""
        estimate, at_home = searched_run(self.nominal, record, self.units.step, rng, self.earlier)
        possible = estimate
        if self.knowledge is not None:
            known = tuple(one for one in estimate.search.rivals if self.knowledge.admits(one.theta))
            possible = estimate.with_rivals(known)
        model, errors = self.nominal.model.at(estimate.theta), model_errors(requirements)
        if errors:
            return estimate, at_home, beyond(model, possible, errors)
        plant = FiniteRecord(self.nominal, len(record), self.units.step)
        unstated: Sequence[OnModelError] = self.entries
        return estimate, at_home, beyond(model, possible, unstated, plant.information(record))
