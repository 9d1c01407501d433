"""Estimates of experiments that are simulated on the nominal plant: records of finite length scatter more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.accuracy import ModelError
from inputdesign_cli.accuracy.calibration import Calibration, Coverage, largest_error
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.excitations import Excitation, Reapplied, Recorded
from inputdesign_cli.monte_carlo.study import Study, tried_on_truth

# Streams that no `simulation.seed` of a spec begins.
_TO_CORRECT, _TO_CHECK = 2**60, 2**60 + 1
# Samples of all runs: asymptotic theory holds for long records, and many of them take minutes.
_MOST = 20_000_000
# Runs that share one record, and its least length: in long records their differences hardly count.
_EACH, _LONG = 20, 100


@dataclass(frozen=True)
class SimulatedEstimates:
    """Estimates from `runs` records of an excitation on the nominal plant.

    Attributes:
        nominal: in raw parameters, as long as the records.
        step: time between samples in the unit of the experiment's frequencies.
        sets: of `runs` runs each that correct alpha; others check it.
    """

    nominal: Experiment
    excitation: Excitation
    runs: int
    step: float
    sets: int = 1

    def corrected(
        self, calibration: Calibration, errors: Sequence[ModelError], information: Array
    ) -> Calibration:
        """The calibration for records this short; information (k, k) in the coordinates of the errors.

        Raises:
            InaccurateError: `confidence-not-settled`: more runs are without an estimate than may leave r_adm.
            OutOfTimeError: see `seconds_left`.
        """
        streams = [_TO_CORRECT, *range(_TO_CHECK + 1, _TO_CHECK + self.sets)]
        estimates = np.concatenate([self._estimates(stream) for stream in streams])
        found = calibration.corrected(errors, information, estimates)
        if not np.isfinite(found.excess):
            raise InaccurateError.because(
                "confidence-not-settled",
                f"of {self.runs} simulated experiments more than {100 * (1 - found.probability):.3g} % give "
                "no estimate: no alpha keeps the confidence that is asked for",
                hint="take more samples, or write runs: 0 beside exact, for asymptotic theory alone",
                key="accuracy.model_error.confidence",
            )
        return found

    def checked(self, coverage: Coverage, errors: Sequence[ModelError], within: float) -> Coverage:
        """The coverage with what fresh runs say of r_adm times `within`."""
        largest = largest_error(errors, self._estimates(_TO_CHECK))
        return replace(coverage, runs=self.runs, kept=int(np.sum(largest <= within)))

    def _estimates(self, seed: int) -> Array:
        """(runs, k): NaN where the search did not settle."""
        seconds_left()
        study = Study(self.nominal, self.nominal, self.runs, seed, self.step)
        each = _EACH if self.nominal.samples >= _LONG else 1
        trials = tried_on_truth(study, Reapplied(self.excitation, each)).trials
        return np.where(trials.converged[:, None], trials.theta, np.nan)


@dataclass(frozen=True)
class Simulator:
    """Makes such estimates; see `SimulatedEstimates` for the attributes, `nominal` of any length."""

    nominal: Experiment
    runs: int
    step: float

    def of(self, excitation: Excitation, samples: int) -> SimulatedEstimates | None:
        """Return estimates from records of this length; None if long records make asymptotic theory good."""
        if samples * self.runs > _MOST:
            return None
        return SimulatedEstimates(replace(self.nominal, samples=samples), excitation, self.runs, self.step)

    def of_record(self, record: Array) -> SimulatedEstimates | None:
        """Return the estimates from one record (samples, r)."""
        return self.of(Recorded("design", record, self.step), len(record))
