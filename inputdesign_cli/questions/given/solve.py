"""A given excitation and its accuracy. Nothing is optimised."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from inputdesign_cli.accuracy import Criterion, Requirement, worst, worst_ratio
from inputdesign_cli.accuracy.calibration import with_alpha
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError, seconds_left
from inputdesign_cli.design.convex.demands import Alternative, RequirementFactory
from inputdesign_cli.design.convex.limits import PowerLimit, Weight, weighted_sum
from inputdesign_cli.errors import IdesignError, bad_spec
from inputdesign_cli.findings.designed_records import too_long
from inputdesign_cli.findings.designs import given_level, limits_not_kept, met_within_table
from inputdesign_cli.information import POWER_KINDS, Experiment, FiniteRecord, PowerKind
from inputdesign_cli.monte_carlo.excitations import Excitation, InPhase, spectral_information
from inputdesign_cli.outcome import Baseline, Objective, Outcome, Powers, Spectrum, White
from inputdesign_cli.outcome.design import white_labels
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.bound_curves import Informed, spectrum_curves
from inputdesign_cli.questions.common.confidence import Confidence, SimulatedEstimates
from inputdesign_cli.questions.common.delivery import Delivered, adding, results_of
from inputdesign_cli.questions.common.record import as_long, given_record, least_period, ratio_at, redrawn
from inputdesign_cli.questions.common.robust import MET, Kept, Plants
from inputdesign_cli.questions.common.signal_outcome import signal_of
from inputdesign_cli.questions.common.task import SpectrumTask
from inputdesign_cli.questions.least_cost.outcome import accuracy_of, information_of
from inputdesign_cli.questions.least_cost.robust_outcome import (
    RobustResult,
    fresh_plants,
    plants_kept,
    worst_plant,
)
from inputdesign_cli.signal.selection import Record
from inputdesign_cli.spectrum import LinesBasis, TabulatedSpectrum

_TOO_FAINT = 1e-12
_ROUNDING = 1e-9
# The error of linear interpolation is a quarter of the error with every second row, doubled to be safe. A
# ratio above one by no more than the second number may be due to it.
_TABLE_SHARE, _TABLE_ERROR = 0.5, 1e-4


@dataclass(frozen=True)
class GivenExcitation:
    """Holds an excitation by kind, for the `experiment` of the spec: its spectrum, or a record.

    A `spectrum` is a basis with its coefficients; recorded `samples` (n, r) are a `step` apart. Sinusoids
    `in_phase` over several inputs have power matrices of rank one, in every period.
    """

    kind: str
    experiment: Experiment
    spectrum: tuple[TabulatedSpectrum | LinesBasis, Array] | None = None
    in_phase: InPhase | None = None
    samples: Array | None = None
    step: float = 1.0

    @classmethod
    def even(cls, experiment: Experiment, power: float) -> GivenExcitation:
        """Return white excitation of this total power, flat over the band and equal in all channels."""
        share = np.full(experiment.inputs, power / experiment.inputs)
        return cls("white", experiment, (TabulatedSpectrum.white(share, experiment.band), np.ones(1)))

    def information(self, experiment: Experiment) -> Array:
        """Return M (k, k) in the coordinates of an experiment."""
        if self.spectrum is not None:
            return spectral_information(*self.spectrum, experiment)
        assert self.samples is not None
        return FiniteRecord(experiment, len(self.samples), self.step).information(self.samples)

    @cached_property
    def power(self) -> dict[PowerKind, list[float]]:
        """Return the mean squares by kind and channel."""
        experiment, model = self.experiment, self.experiment.model

        def of(kind: PowerKind) -> list[float]:
            if self.spectrum is None:
                assert self.samples is not None
                plant = FiniteRecord(experiment, len(self.samples), self.step)
                return list(plant.mean_squares(kind, self.samples).tolist())
            basis, x = self.spectrum
            channels = range(model.outputs if kind == "output" else model.inputs)
            each = (partial(experiment.power_density, kind, channel=channel) for channel in channels)
            return [float(x @ basis.integrals(density, experiment.singularities)) for density in each]

        return {kind: of(kind) for kind in POWER_KINDS}

    @property
    def scale(self) -> float:
        """Return the power of the white excitation that coordinates are whitened by."""
        return max(sum(self.power["excitation"]), 1e-300)

    def at(self, plant: Alternative, samples: int) -> Kept:
        """Return the largest error ratio at a plant: infinite if its parameters are undetermined."""
        seconds_left()
        own = plant.experiment.with_samples(samples)
        try:
            coordinates = own.whitened(self.scale)
            there = plant.at(coordinates)
            return _kept((*there.requirements, *there.side), self.information(coordinates))
        except OutOfTimeError:
            raise
        except (np.linalg.LinAlgError, IdesignError):
            return Kept(np.inf, tuple(make(own) for make in (*plant.requirements, *plant.side)))

    def described(self, units: Units) -> Spectrum:
        """Return the entry of the outcome for this excitation."""
        details: dict[str, object] = {"given": self.kind}
        if self.spectrum is not None and isinstance(self.spectrum[0], LinesBasis):
            frequencies, powers = self.spectrum[0].lines(self.spectrum[1])
            shown = powers[:, 0, 0].real if units.inputs == 1 else powers
            details |= {"frequencies": frequencies / units.frequency, "powers": shown}
        elif self.kind == "white":
            details["power"] = self.power["excitation"]
            if units.inputs == 1:
                details["coefficients"] = self.power["excitation"]
        return Spectrum("given", details)


@dataclass(frozen=True, kw_only=True)
class GivenTask(SpectrumTask):
    """Analyses an excitation: requirements are checked, a criterion is computed.

    The `plants` are others than the nominal one.
    """

    experiment: Experiment
    excitation: GivenExcitation
    requirements: Sequence[RequirementFactory]
    criterion: Callable[[Experiment], Criterion] | None
    cost: dict[PowerKind, Weight]
    confidence: Confidence
    limits: Sequence[PowerLimit]
    plants: Plants | None

    def delivered(self) -> Delivered:
        """Return r_u, information, predicted standard deviations and powers of the excitation."""
        started = time.perf_counter()
        excitation = self.excitation
        experiment = self.experiment.whitened(excitation.scale)
        if excitation.samples is not None:
            experiment = experiment.with_samples(len(excitation.samples))
        information = excitation.information(experiment)
        eigenvalues, vectors = np.linalg.eigh(information)
        if eigenvalues[0] <= _TOO_FAINT * eigenvalues[-1]:
            lacking = experiment.unexcited(vectors[:, 0])
            message = f"this excitation has no information on {lacking}: infinite variance"
            hint = "each sinusoid determines at most two parameters: add frequencies, or drop parameters"
            raise bad_spec("not-exciting", message, hint=hint, key="spectrum.given")
        requirements = [make(experiment) for make in self.requirements]
        simulated = self._simulated(experiment)
        confidence = self.confidence.of(requirements, information, simulated)
        requirements = with_alpha(requirements, confidence.alpha)
        results, informed = self._report(experiment, information, requirements, confidence)
        record, signal = self._record(experiment, worst_ratio(requirements)), None
        if record is None:
            found = too_long(self.record.length(experiment.samples), self.record.longest)
        else:
            signal, found = signal_of(self.record, experiment, record, requirements), []
        if excitation.samples is not None:
            found += given_level(excitation.samples, self.record.operating_points)
        power, stated = Powers.of(excitation.power), (self.limits, self.record.most_samples)
        found += limits_not_kept(*stated, experiment.samples, power, signal, self.record.bounds)
        if record is None or signal is None:
            results = adding(results, results.outcome, found)
        else:
            results = self.applied(results, experiment, record, signal, requirements, found)
        seconds = {"analysis": time.perf_counter() - started}
        asked, alpha = (experiment, requirements), confidence.alpha
        return self.to_be_tried(results, seconds, record, self._renewed, alpha, informed, *asked)

    def _report(
        self,
        experiment: Experiment,
        information: Array,
        requirements: Sequence[Requirement],
        confidence: Confidence,
    ) -> tuple[Results, Informed]:
        """Return the accuracy that the excitation gives, beside white excitation at the same cost."""
        units, excitation = self.header.units, self.excitation
        cost = weighted_sum(self.cost, excitation.power)
        level = cost / weighted_sum(self.cost, GivenExcitation.even(self.experiment, 1.0).power)
        white, objective = White(cost=cost, excitation_power=level), None
        if self.criterion is not None:
            criterion = self.criterion(experiment)
            objective = Objective(criterion.letter, criterion.value(criterion.level(information)))
        errors, stated = self.errors(experiment, requirements)
        kind = None if objective is None else objective.kind
        informed = Informed(
            units,
            errors,
            information,
            stated,
            white=GivenExcitation.even(self.experiment, level).information(experiment),
            white_labels=white_labels(kind, white, experiment.samples),
            label="given",
        )
        beyond, of_table = self._beyond(experiment, requirements, information)
        met = beyond <= max(_ROUNDING, of_table)
        error, listed = accuracy_of(units, confidence, requirements, information, np.zeros(0))
        outcome = Outcome(
            title=self.header.title,
            status="given" if not requirements else "met" if met else "missed",
            objective=objective,
            cost=cost,
            samples=experiment.samples,
            power=Powers.of(excitation.power),
            model_error=error,
            requirements=listed,
            information=information_of(experiment, information),
            spectrum=excitation.described(units),
            baseline=Baseline(white),
        )
        if met and of_table:
            outcome = outcome.saying([met_within_table(of_table)])
        tables, curves = informed.curves(experiment, self.ellipses)
        if excitation.spectrum is not None:
            flat = level if units.inputs == 1 else None
            drawn = spectrum_curves(units, *excitation.spectrum, experiment.band, white=flat)
            tables["spectrum"], curves["spectrum"] = drawn[0], replace(drawn[1], label="given")
        if self.plants is not None:
            found = self._at_plants(experiment, self.plants, _kept(requirements, information))
            status = "missed" if found.entry.missed else outcome.status
            outcome = replace(outcome, robust=found.entry, status=status).saying(found.findings)
            tables |= found.tables
        return results_of(self.header, outcome, tables, curves), informed

    def _at_plants(self, experiment: Experiment, plants: Plants, nominal: Kept) -> RobustResult:
        """Return the accuracy at the plants of `uncertainty`, the worst left out as far as allowed.

        At the plant of the spec the accuracy is `nominal`. It raises `SpecError` (`not-exciting`).
        """
        batch, at = plants.batch, partial(self.excitation.at, samples=experiment.samples)
        tried = [at(plant) for plant in batch.plants]
        rising = np.argsort([one.share for one in tried], kind="stable").tolist()
        kept = sorted(rising[: len(rising) - plants.discard])
        at_each = [nominal, *(tried[place] for place in kept)]
        looked_at = list(at_each)
        if plants.region is not None:
            starts = [experiment.model.theta, *(batch.thetas[place] for place in reversed(rising))]
            worst_found, _ = worst_plant(plants.region, at, starts)
            plants, looked_at = replace(plants, searched=worst_found), [*looked_at, worst_found.kept]
        thetas = [experiment.model.theta, *batch.thetas[kept]]
        thetas += [] if plants.searched is None else [plants.searched.theta]
        shares = np.array([one.share for one in looked_at])
        for place in np.flatnonzero(~np.isfinite(shares))[:1]:
            where = ", ".join(
                f"{name} = {x:.4g}" for name, x in zip(plants.names, thetas[place], strict=True)
            )
            message = f"the given excitation does not determine all parameters at the scenario {where}"
            hint = "excite more frequencies, or state the uncertainty more tightly"
            raise bad_spec("not-exciting", message, hint=hint, key="uncertainty")
        binding = [int(np.argmax([one.share for one in at_each]))]
        found = plants_kept(self.header.units, plants, kept, at_each, binding)
        fresh, fewer = fresh_plants(plants, lambda drawn, _: [at(plant) for plant in drawn])
        missed = sum(one.share > MET for one in looked_at)
        entry = replace(found.entry, missed=missed, fresh=fresh)
        return replace(found, entry=entry, findings=(*found.findings, *fewer))

    def _beyond(
        self, experiment: Experiment, requirements: Sequence[Requirement], information: Array
    ) -> tuple[float, float]:
        """Return the excess of the largest ratio over one, and its interpolation error if that decides."""

        def largest(M: Array) -> float:
            return max((worst(r.violations(M)).ratio for r in requirements), default=0.0)

        ratio, (basis, x) = largest(information), self.excitation.spectrum or (None, np.ones(1))
        decides = _ROUNDING < ratio - 1.0 <= _TABLE_ERROR
        if not decides or not isinstance(basis, TabulatedSpectrum):
            return ratio - 1.0, 0.0
        raised = largest(spectral_information(basis.raised(_TABLE_SHARE), x, experiment))
        return ratio - 1.0, min(ratio - raised, _TABLE_ERROR)

    def _record(self, experiment: Experiment, ratio: Callable[[Array], float]) -> Record | None:
        """Return the signal as given, or a record of the given spectrum; None if too short."""
        excitation, request = self.excitation, self.record
        if excitation.spectrum is None:
            assert excitation.samples is not None
            return Record(excitation.samples, "given", ratio(excitation.information(experiment)))
        if excitation.in_phase is None or not request.feasible(experiment.samples, least_period(1)):
            return given_record(request, experiment, *excitation.spectrum, ratio)
        samples, rng = request.length(experiment.samples), np.random.default_rng(request.settings.seed)
        record = excitation.in_phase.draw(1, samples, rng)[0]
        plant = FiniteRecord(experiment, samples, request.step)
        return Record(record, "multisine", ratio_at(plant, ratio, record))

    def _simulated(self, experiment: Experiment) -> SimulatedEstimates | None:
        """Return estimates of such experiments, for an exact confidence."""
        simulator = self.confidence.simulator
        if simulator is None:
            return None
        if self.excitation.samples is not None:
            return simulator.of_record(self.excitation.samples)
        samples = as_long(self.record, experiment)
        renewed = None if samples is None else self._renewed(samples)
        return None if samples is None or renewed is None else simulator.of(renewed, samples)

    def _renewed(self, samples: int) -> Excitation | None:
        """Return the source of new records of the spectrum; None for a record that was given."""
        given = self.excitation
        if given.spectrum is None or given.in_phase is not None:
            return given.in_phase
        return redrawn(self.record, *given.spectrum, samples)


def _kept(requirements: Sequence[Requirement], information: Array) -> Kept:
    """Return the largest ratio of an error to what is admitted, and where it is."""
    found = worst([one for requirement in requirements for one in requirement.violations(information)])
    return Kept(found.ratio, tuple(requirements), found.frequency)
