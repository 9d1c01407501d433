"""Look for minima of the likelihood far apart, which may leave a design's data undecided, beforehand.

The local covariance knows of one minimum. A dead time that few frequencies excite has others, whole periods
away. A record of the design is simulated on the nominal plant and estimated with the search of `identify`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import ModelError, OnModelError, Requirement, model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import Counted, OutOfTimeError, seconds_left, tell, what_ended
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.rivals import Apart, beyond, foreseen_entries, foreseen_rivals, not_foreseen
from inputdesign_cli.identification import Earlier, Estimate
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.monte_carlo.study import searched_run
from inputdesign_cli.outcome.design import Foreseen as Entry
from inputdesign_cli.outcome.simulation import Searched
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.knowledge import Knowledge

_SEED = 0
# Seconds of a search for each sample, channel, channel and parameter, measured; the longest that is begun.
_SECONDS, _LONGEST = 1.2e-4, 20.0
# What a simulated search may end with; then nothing can be said.
_ENDS = (IdesignError, ArithmeticError, ValueError, RuntimeWarning)


@dataclass(frozen=True)
class Foresight:
    """Predicts an experiment's data from the nominal plant and prior, both in raw parameters.

    `entries` are errors that have r_u where none is bounded, and `earlier` counts along where data are
    assessed. `knowledge` of the parameters rules rivals out.
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
        reason = self._not_now(len(record))
        if reason:
            return None, [not_foreseen(reason)]
        try:
            estimate, _ = self._searched(record, np.random.default_rng(_SEED))
            found = self._beyond(record, estimate, requirements)
        except _ENDS:
            return None, []
        entry = Entry(foreseen_entries(self.units, estimate, found))
        return entry, list(foreseen_rivals(self.units, estimate, found, self.advice))

    def tried(self, record: Array, requirements: Sequence[Requirement], runs: int) -> Searched | None:
        """Return how many of `runs` simulations end elsewhere and how many leave rivals; None if unknown."""
        elsewhere, rivals = 0, 0
        for done, rng in enumerate(np.random.default_rng(_SEED).spawn(runs)):
            tell(Counted("records searched from several starts", done, runs))
            try:
                estimate, at_home = self._searched(record, rng)
                found = self._beyond(record, estimate, requirements)
            except _ENDS:
                return None
            better = any(one.rival.excess < 0.0 for one in found)
            elsewhere += better and not at_home
            rivals += bool(found)
        return Searched(runs, elsewhere, rivals)

    def _searched(self, record: Array, rng: np.random.Generator) -> tuple[Estimate, bool]:
        return searched_run(self.nominal, record, self.units.step, rng, self.earlier)

    def _beyond(self, record: Array, estimate: Estimate, requirements: Sequence[Requirement]) -> list[Apart]:
        if self.knowledge is not None:
            known = tuple(one for one in estimate.search.rivals if self.knowledge.admits(one.theta))
            estimate = estimate.with_rivals(known)
        model, errors = self.nominal.model.at(estimate.theta), model_errors(requirements)
        if errors:
            return beyond(model, estimate, errors)
        plant = FiniteRecord(self.nominal, len(record), self.units.step)
        unstated: Sequence[OnModelError] = self.entries
        return beyond(model, estimate, unstated, plant.information(record))

    def _not_now(self, samples: int) -> str:
        """Return the reason to search for no rivals; empty if the search is to be done."""
        if not self.looks:
            return "solver.any_spectrum: false (or --fast)"
        nominal = self.nominal
        seconds = _SECONDS * samples * nominal.inputs * nominal.model.outputs * len(nominal.model.names)
        if seconds > _LONGEST:
            return "the record is long"
        try:
            return f"{what_ended()} left no time" if seconds > seconds_left() else ""
        except OutOfTimeError:
            return f"{what_ended()} left no time"
