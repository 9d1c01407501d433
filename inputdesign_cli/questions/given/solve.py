"""A given excitation and its accuracy. Nothing is optimised."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from inputdesign_cli.accuracy import Criterion, Requirement, worst
from inputdesign_cli.accuracy.calibration import Calibration, with_alpha
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cost import Weight, weighted_sum
from inputdesign_cli.design.convex.demands import RequirementFactory
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.findings.designed_records import too_long
from inputdesign_cli.findings.designs import StatedLimits, limits_not_kept, met_within_table
from inputdesign_cli.information import POWER_KINDS, Experiment, FiniteRecord, PowerKind
from inputdesign_cli.monte_carlo.excitations import Excitation, InPhase, Redrawn, spectral_information
from inputdesign_cli.outcome import Baseline, Objective, Outcome, Powers, Spectrum, White
from inputdesign_cli.outcome.design import white_labels
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.bound import Informed
from inputdesign_cli.questions.common.confidence import Confidence, SimulatedEstimates, Simulator
from inputdesign_cli.questions.common.delivery import Delivered, adding, results_of
from inputdesign_cli.questions.common.record import as_long, given_record, least_period, ratio_at, worst_ratio
from inputdesign_cli.questions.common.robust import Plants
from inputdesign_cli.questions.common.signal_outcome import signal_of
from inputdesign_cli.questions.common.spectrum import spectrum_curves
from inputdesign_cli.questions.common.task import SpectrumTask
from inputdesign_cli.questions.least_cost.outcome import accuracy_of, information_of
from inputdesign_cli.questions.least_cost.robust_outcome import AtPlants, given_robust, kept_of
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.lines import DesignedSpectrum
from inputdesign_cli.signal.selection import Record
from inputdesign_cli.spectrum import LinesBasis, TabulatedSpectrum

_TOO_FAINT = 1e-12
_ROUNDING = 1e-9
# The error of linear interpolation is a quarter of that with every second row, taken twice to be safe; what
# it leaves open of a ratio is at most so much.
_TABLE_SHARE, _TABLE_ERROR = 0.5, 1e-4


@dataclass(frozen=True)
class GivenExcitation:
    """Holds an excitation by kind, its powers by channel, and M (k, k) in an experiment's coordinates.

    A recorded signal has `samples` (n, r), the others a `basis` with coefficients `x`. Sinusoids `in_phase`
    over several inputs have power matrices of rank one, in every period.
    """

    kind: str
    power: dict[PowerKind, list[float]]
    information: Callable[[Experiment], Array]
    basis: TabulatedSpectrum | LinesBasis | None = None
    x: Array | None = None
    in_phase: InPhase | None = None
    samples: Array | None = None

    def drawn(self, step: float) -> DesignedSpectrum:
        """Return the spectrum for samples that are a step apart."""
        assert self.basis is not None
        assert self.x is not None
        return DesignedSpectrum.of(self.basis, self.x, inputs=len(self.power["excitation"]), step=step)

    @property
    def scale(self) -> float:
        """Return the power of the white excitation that coordinates are whitened by."""
        return max(sum(self.power["excitation"]), 1e-300)

    @classmethod
    def spectral(
        cls,
        kind: str,
        basis: TabulatedSpectrum | LinesBasis,
        x: Array,
        experiment: Experiment,
        *,
        in_phase: InPhase | None = None,
    ) -> GivenExcitation:
        """Return an excitation that is known by its spectrum."""

        def power(of: PowerKind, channel: int) -> float:
            unit = basis.integrals(
                lambda w: experiment.power_density(of, w, channel), experiment.singularities
            )
            return float(x @ unit)

        model = experiment.model
        found = {
            of: [power(of, i) for i in range(model.outputs if of == "output" else model.inputs)]
            for of in POWER_KINDS
        }
        information = partial(spectral_information, basis, x)
        return cls(kind, found, information, basis, x, in_phase)

    def described(self, units: Units) -> Spectrum:
        """Return the entry of the outcome for this excitation."""
        details: dict[str, object] = {"given": self.kind}
        if isinstance(self.basis, LinesBasis) and self.x is not None:
            frequencies, powers = self.basis.lines(self.x)
            shown = powers[:, 0, 0].real if units.inputs == 1 else powers
            details |= {"frequencies": frequencies / units.frequency, "powers": shown}
        elif self.kind == "white":
            details["power"] = self.power["excitation"]
            if units.inputs == 1:
                details["coefficients"] = self.power["excitation"]
        return Spectrum("given", details)

    @classmethod
    def even(cls, experiment: Experiment, power: float) -> GivenExcitation:
        """Return white excitation of this total power, flat over the band and even over channels."""
        share = np.full(experiment.inputs, power / experiment.inputs)
        return cls.spectral("white", TabulatedSpectrum.white(share, experiment.band), np.ones(1), experiment)


@dataclass(frozen=True, kw_only=True)
class GivenTask(SpectrumTask):
    """Analyses an excitation: requirements are checked, a criterion is computed.

    `calibration` and `simulator` size `alpha` anew, see `Confidence`; `plants` are others than the nominal
    one.
    """

    experiment: Experiment
    excitation: GivenExcitation
    requirements: Sequence[RequirementFactory]
    criterion: Callable[[Experiment], Criterion] | None
    cost: dict[PowerKind, Weight]
    alpha: float
    calibration: Calibration | None
    simulator: Simulator | None
    limits: StatedLimits
    plants: Plants | None

    def delivered(self) -> Delivered:
        """Return r_u, information, predicted standard deviations and powers of the excitation."""
        started = time.perf_counter()
        excitation = self.excitation
        experiment = self.experiment.whitened(excitation.scale)
        if excitation.samples is not None:
            experiment = replace(experiment, samples=len(excitation.samples))
        information = excitation.information(experiment)
        eigenvalues, vectors = np.linalg.eigh(information)
        if eigenvalues[0] <= _TOO_FAINT * eigenvalues[-1]:
            raise bad_spec(
                "not-exciting",
                f"this excitation has no information on {experiment.unexcited(vectors[:, 0])}: infinite "
                "variance",
                hint="each sinusoid determines at most two parameters: add frequencies, or drop parameters",
                key="spectrum.given",
            )
        requirements = [make(experiment) for make in self.requirements]
        simulated = self._simulated(experiment)
        confidence = Confidence.of(self.calibration, requirements, information, self.alpha, simulated)
        requirements = with_alpha(requirements, confidence.alpha)
        informed, white = self._informed(experiment, requirements, information)
        results = self._report(experiment, informed, white, requirements, confidence)
        record, signal = self._record(experiment, worst_ratio(requirements)), None
        if record is None:
            found = too_long(self.record.length(experiment.samples), self.record.longest)
        else:
            signal, found = signal_of(self.record, informed.units, experiment, record, requirements), []
        power = Powers.of(excitation.power)
        found += limits_not_kept(self.limits, experiment.samples, power, signal)
        if record is None or signal is None:
            results = adding(results, results.outcome, found)
        else:
            results = self.applied(results, experiment, record, signal, requirements, found)
        seconds = {"analysis": time.perf_counter() - started}
        results = adding(results, replace(results.outcome, timing_s=seconds))
        if record is None:
            return Delivered(results, None, None, confidence.alpha)
        renewed = self._renewed(len(record.samples))
        return self.to_be_tried(
            results, record.samples, renewed, confidence.alpha, informed, experiment, requirements
        )

    def _informed(
        self, experiment: Experiment, requirements: Sequence[Requirement], information: Array
    ) -> tuple[Informed, White]:
        """Return the accuracy curves of the excitation, and white excitation at the same cost."""
        cost = weighted_sum(self.cost, self.excitation.power)
        level = cost / weighted_sum(self.cost, GivenExcitation.even(self.experiment, 1.0).power)
        white = GivenExcitation.even(self.experiment, level).information(experiment)
        errors, stated = self.errors(experiment, requirements)
        found = White(cost=cost, excitation_power=level)
        kind = None if self.criterion is None else self.criterion(experiment).letter
        labels, known = white_labels(kind, found, experiment.samples), (errors, information, stated)
        return Informed(self.header.units, *known, white=white, white_labels=labels, label="given"), found

    def _report(
        self,
        experiment: Experiment,
        informed: Informed,
        white: White,
        requirements: Sequence[Requirement],
        confidence: Confidence,
    ) -> Results:
        """Return the accuracy that the excitation gives, with its tables and curves."""
        units, excitation = informed.units, self.excitation
        beyond, of_table = self._beyond(experiment, requirements, informed.information)
        met = beyond <= max(_ROUNDING, of_table)
        error, listed = accuracy_of(units, confidence, requirements, informed.information, np.zeros(0))
        objective = None
        if self.criterion is not None:
            criterion = self.criterion(experiment)
            objective = Objective(criterion.letter, criterion.value(criterion.level(informed.information)))
        outcome = Outcome(
            title=self.header.title,
            status="given" if not requirements else "met" if met else "missed",
            objective=objective,
            cost=white.cost,
            samples=experiment.samples,
            power=Powers.of(excitation.power),
            model_error=error,
            requirements=listed,
            information=information_of(experiment, informed.information),
            spectrum=excitation.described(units),
            baseline=Baseline(white),
        )
        if met and of_table:
            outcome = outcome.saying([met_within_table(of_table)])
        tables, curves = informed.curves(experiment, self.ellipses)
        if excitation.basis is not None and excitation.x is not None:
            level = white.excitation_power if units.inputs == 1 else None
            tables["spectrum"], drawn = spectrum_curves(
                units, excitation.basis, excitation.x, experiment.band, white=level
            )
            curves["spectrum"] = replace(drawn, label="given")
        plants = self.plants
        if plants is not None:
            excited = AtPlants(excitation.information, excitation.scale, experiment.samples)
            nominal, centre = kept_of(requirements, informed.information), experiment.model.theta
            found = given_robust(excited, plants, nominal, centre, units)
            status = "missed" if found.entry.missed else outcome.status
            outcome = replace(outcome, robust=found.entry, status=status).saying(found.findings)
            tables |= found.tables
        return results_of(self.header, outcome, tables, curves)

    def _beyond(
        self, experiment: Experiment, requirements: Sequence[Requirement], information: Array
    ) -> tuple[float, float]:
        """Return the excess of the largest ratio over one, and its error by a table if that decides."""

        def largest(M: Array) -> float:
            return max((worst(r.violations(M)).ratio for r in requirements), default=0.0)

        ratio, basis, x = largest(information), self.excitation.basis, self.excitation.x
        decides = _ROUNDING < ratio - 1.0 <= _TABLE_ERROR
        if not decides or x is None or not isinstance(basis, TabulatedSpectrum):
            return ratio - 1.0, 0.0
        raised = largest(spectral_information(basis.raised(_TABLE_SHARE), x, experiment))
        return ratio - 1.0, min(ratio - raised, _TABLE_ERROR)

    def _record(self, experiment: Experiment, ratio: Callable[[Array], float]) -> Record | None:
        """Return the signal as given, or a record of the given spectrum; None if too short."""
        excitation, request = self.excitation, self.record
        if excitation.samples is not None:
            return Record(excitation.samples, "given", ratio(excitation.information(experiment)))
        if excitation.in_phase is None or not request.feasible(experiment.samples, least_period(1)):
            return given_record(request, experiment, excitation.drawn(request.step), ratio)
        samples, rng = request.length(experiment.samples), np.random.default_rng(request.settings.seed)
        record = excitation.in_phase.draw(1, samples, rng)[0]
        plant = FiniteRecord(experiment, samples, request.step)
        return Record(record, "multisine", ratio_at(plant, ratio, record))

    def _simulated(self, experiment: Experiment) -> SimulatedEstimates | None:
        """Return estimates of such experiments, for an exact confidence."""
        if self.simulator is None:
            return None
        if self.excitation.samples is not None:
            return self.simulator.of_record(self.excitation.samples)
        samples = as_long(self.record, experiment)
        renewed = None if samples is None else self._renewed(samples)
        return None if samples is None or renewed is None else self.simulator.of(renewed, samples)

    def _renewed(self, samples: int) -> Excitation | None:
        """Return the source of new records of the spectrum; None for a record that was given."""
        excitation, request = self.excitation, self.record
        if excitation.basis is None or excitation.x is None:
            return None
        spectrum = excitation.drawn(request.step)
        generator = SignalGenerator(spectrum, request.settings, samples, request.band)
        return excitation.in_phase or Redrawn("design", generator, excitation.basis, excitation.x)
