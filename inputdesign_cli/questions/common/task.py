"""Steps of a designed and of a given spectrum: a record with its assumptions, and its trial."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from inputdesign_cli.accuracy import OnModelError, Requirement, model_errors, worst_ratio
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.designed_records import level_rounded, noise_moves_input, start_matters
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.monte_carlo.excitations import Excitation
from inputdesign_cli.outcome import Signal
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.questions.common.bound_curves import Informed, Pairs
from inputdesign_cli.questions.common.delivery import Delivered, adding
from inputdesign_cli.questions.common.foresight import Foresight
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.questions.common.signal_outcome import with_record
from inputdesign_cli.questions.common.simulation import Simulation, simulate
from inputdesign_cli.signal.selection import Record

# A relative growth of errors by an unknown start is not mentioned below this.
_MATTERS = 0.2
# An upper bound below this makes the growth itself unnecessary. A start is forgotten when it decays to e^-8.
_SURELY, _FORGOTTEN = 0.19, 8.0
_LONG = 10_000  # samples that show the deviation of the input of a loop by noise


@dataclass(frozen=True, kw_only=True)
class SpectrumTask(ABC):
    """Asks about the spectrum of an experiment, with its record and its trial.

    Without a requirement on model errors, r_u is for `simulation.entries`. `ellipses` of None are chosen.
    """

    header: Header
    record: RecordRequest
    ellipses: Pairs | None
    simulation: Simulation
    foresight: Foresight | None

    @abstractmethod
    def delivered(self) -> Delivered:
        """Return the answer, with what a trial takes from it."""

    def solve(self) -> Results:
        """Return the answer with its signal and its curves."""
        return self.delivered().results

    def simulate(self, executor: Executor | None = None) -> Results:
        """Return the answer with many simulated experiments on the true system; see `common.simulation`."""
        delivered = self.delivered()
        if delivered.record is None:
            seconds_left()  # raises where time was the reason
        return simulate(self.simulation, delivered, executor)

    def errors(self, experiment: Experiment, asked: Sequence[Requirement]) -> tuple[list[OnModelError], bool]:
        """Return the model errors asked about, or r_u of all entries of G, and whether any is asked about."""
        stated = model_errors(asked)
        every = self.simulation.entries
        return stated or [replace(error, experiment=experiment) for error in every], bool(stated)

    def applied(
        self,
        results: Results,
        experiment: Experiment,
        record: Record,
        signal: Signal,
        requirements: Sequence[Requirement],
        findings: Iterable[Finding],
    ) -> Results:
        """Return the results with a record, the effect of an unknown start, and the rival minima.

        A designed spectrum has no start, while a record may owe information to its start from rest.
        """
        samples, quantisers = record.samples, self.record.bounds.quantisers
        found = [*findings, *level_rounded(quantisers, float(np.abs(samples).max()))]
        peaks = signal.input_peak if "amplitude.input" in (signal.of_limits or {}) else None
        if experiment.loop is not None and peaks is not None:
            within = min(len(samples), _LONG)
            found += noise_moves_input(
                experiment.loop.input_deviation(experiment.noise_colouring, within), peaks
            )
        if np.isfinite(record.worst_ratio):
            growth = growth_by_start(experiment, samples, self.record.step, requirements)
            if growth > 1.0 + _MATTERS:
                known = growth if np.isfinite(growth) else None
                signal = replace(signal, details={**signal.details, "begun_anywhere": known})
                found.append(start_matters(growth))
        results = with_record(results, self.record, experiment, record, signal)
        outcome = results.outcome
        if self.foresight is not None:
            foreseen, rivals = self.foresight.foreseen(samples, requirements)
            outcome, found = replace(outcome, foreseen=foreseen), [*found, *rivals]
        return adding(results, outcome, found)

    def to_be_tried(
        self,
        results: Results,
        seconds: dict[str, float],
        record: Record | None,
        renewed: Callable[[int], Excitation | None],
        alpha: float,
        informed: Informed,
        experiment: Experiment,
        requirements: Sequence[Requirement],
        *,
        flat: bool = True,
    ) -> Delivered:
        """Return the answer with its times and its record for a trial; the curves show its information."""
        results = replace(results, outcome=replace(results.outcome, timing_s=seconds))
        if record is None:
            return Delivered(results, None, None, alpha)
        of_length = partial(informed.of_length, experiment, self.ellipses, flat=flat)
        search = (
            None if self.foresight is None else partial(self.foresight.tried, record.samples, requirements)
        )
        return Delivered(results, record.samples, renewed(len(record.samples)), alpha, of_length, search)


def growth_by_start(
    experiment: Experiment, record: Array, step: float, requirements: Sequence[Requirement]
) -> float:
    """Return the factor on the errors if the start of a record (n, r) and its levels are unknown.

    For long records it is an upper bound: it counts only the samples after the plant has forgotten its
    start, about their means.
    """
    plant, error = FiniteRecord(experiment, len(record), step), worst_ratio(requirements)
    poles = np.concatenate([experiment.singularities, experiment.model.singularities])
    damping = max(float(np.min(poles.imag, initial=1.0 / step)), 1e-9)
    begins = int(np.ceil((_FORGOTTEN / damping + experiment.memory) / step))
    try:
        at_rest = error(plant.information(record))
        if at_rest <= 0.0:
            return 1.0
        if 2 * begins < len(record):
            psi = plant.gradient(record)[begins:]
            psi = psi - psi.mean(axis=0)
            bound = error(plant.known + np.tensordot(psi, psi, axes=([0, 2], [0, 2]))) / at_rest
            if bound <= 1.0 + _SURELY:
                return bound
        from inputdesign_cli.identification import information_of_data

        u, y = plant.signals("input", record), plant.signals("output", record)
        anywhere = information_of_data(experiment.model, u, y, step, free=True)
        return error(plant.known + experiment.whiten_matrix(anywhere)) / at_rest
    except np.linalg.LinAlgError:
        return np.inf
