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
from inputdesign_cli.compute.time_limit import OutOfTimeError, seconds_left, what_ended
from inputdesign_cli.compute.watching import Counted, tell
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
        nominal = self.nominal
        seconds = _SECONDS * len(record) * nominal.inputs * nominal.model.outputs * len(nominal.model.names)
        if not self.looks:
            reason = "solver.any_spectrum: false (or --fast)"
        elif seconds > _LONGEST:
            reason = "the record is long"
        else:
            try:
                late = seconds > seconds_left()
            except OutOfTimeError:
                late = True
            reason = f"{what_ended()} left no time" if late else ""
        if reason:
            return None, [not_foreseen(reason)]
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
            tell(Counted("records searched from several starts", done, runs))
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
