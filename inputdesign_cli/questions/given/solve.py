"""A given excitation: what accuracy it buys. Nothing is optimised."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from inputdesign_cli.accuracy import Criterion, ModelError, Requirement, model_errors, worst
from inputdesign_cli.accuracy.calibration import Calibration, with_alpha
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.convex.cost import Weight, weighted_sum
from inputdesign_cli.design.convex.demands import RequirementFactory
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.findings.limits_not_kept import StatedLimits, limits_not_kept
from inputdesign_cli.information import POWER_KINDS, Experiment, FiniteRecord, PowerKind
from inputdesign_cli.monte_carlo.excitations import Excitation, InPhase, Redrawn, spectral_information
from inputdesign_cli.outcome import Powers, read_plain
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.objectives import white_labels
from inputdesign_cli.outcome.results import Json, Results, Table, typed
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.questions.common.bound import bound_curves
from inputdesign_cli.questions.common.confidence import Confidence
from inputdesign_cli.questions.common.ellipses import Pairs, experiment_ellipses
from inputdesign_cli.questions.common.foresight import Foreseen, Foresight
from inputdesign_cli.questions.common.nyquist import nyquist_curves
from inputdesign_cli.questions.common.of_length import curves_of_length
from inputdesign_cli.questions.common.record import (
    RecordRequest,
    as_long,
    given_record,
    least_period,
    worst_ratio,
)
from inputdesign_cli.questions.common.record_notes import record_notes
from inputdesign_cli.questions.common.robust import Plants
from inputdesign_cli.questions.common.signal_outcome import other_files, signal_curves, signal_entry
from inputdesign_cli.questions.common.simulated_estimates import SimulatedEstimates, Simulator
from inputdesign_cli.questions.common.simulation import Delivered, Simulation, simulate
from inputdesign_cli.questions.common.spectrum import plain_complex, spectrum_curves
from inputdesign_cli.questions.common.unknown_start import begun_anywhere
from inputdesign_cli.questions.given.build_plants import AtPlants, given_robust, kept_of
from inputdesign_cli.questions.least_cost.outcome import information_entry, requirements_entry
from inputdesign_cli.signal import DesignedSpectrum, Record, SignalGenerator, in_phase_record
from inputdesign_cli.spectrum import LinesBasis, TabulatedSpectrum

_TOO_FAINT = 1e-12
_ROUNDING = 1e-9
# The error of linear interpolation is a quarter of that with every second row, taken twice to be safe; what
# it leaves open of a ratio is at most so much.
_TABLE_SHARE, _TABLE_ERROR = 0.5, 1e-4


@dataclass(frozen=True)
class GivenExcitation:
    """What it is called, its powers by kind and channel, and the information matrix that it gives.

    `information` maps an experiment to M (k, k) in its coordinates. A recorded signal has `samples` (n, r),
    the others a `basis` and the coefficients `x` on it; `sinusoids` are the frequencies (L,) and amplitudes
    (L, r) of a multisine, in phase over the channels.
    """

    kind: str
    power: dict[PowerKind, list[float]]
    information: Callable[[Experiment], Array]
    basis: TabulatedSpectrum | LinesBasis | None = None
    x: Array | None = None
    sinusoids: tuple[Array, Array] | None = None
    samples: Array | None = None

    @property
    def scale(self) -> float:
        """The power of the white excitation that coordinates are whitened by."""
        return max(sum(self.power["excitation"]), 1e-300)

    @classmethod
    def spectral(
        cls,
        kind: str,
        basis: TabulatedSpectrum | LinesBasis,
        x: Array,
        experiment: Experiment,
        *,
        sinusoids: tuple[Array, Array] | None = None,
    ) -> GivenExcitation:
        """An excitation that is known by its spectrum."""

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
        return cls(kind, found, information, basis, x, sinusoids)

    @classmethod
    def even(cls, experiment: Experiment, power: float) -> GivenExcitation:
        """White excitation of this total power, flat over the band and even over the channels."""
        share = np.full(experiment.inputs, power / experiment.inputs)
        return cls.spectral("white", TabulatedSpectrum.white(share, experiment.band), np.ones(1), experiment)


@dataclass(frozen=True)
class GivenTask:
    """The analysis of an excitation.

    `unstated` are errors of the entries of G that have r_u where no requirement bounds it. The value of
    `criterion` is computed, not bounded. `plants` are others that the true one might be.
    """

    header: Header
    experiment: Experiment
    requirements: Sequence[RequirementFactory]
    unstated: Sequence[ModelError]
    excitation: GivenExcitation
    cost: dict[PowerKind, Weight]
    alpha: float
    calibration: Calibration | None
    simulator: Simulator | None
    limits: StatedLimits
    record: RecordRequest
    ellipses: Pairs | None
    simulation: Simulation
    foresight: Foresight | None = None
    criterion: Callable[[Experiment], Criterion] | None = None
    plants: Plants | None = None

    def solve(self) -> Results:
        """r_u, information, predicted standard deviations and powers of the excitation.

        Raises:
            SpecError: `not-exciting` when the excitation leaves parameters undetermined.
        """
        return self._delivered().results

    def simulate(self, executor: Executor | None = None) -> Results:
        """The same, with the excitation tried many times on the true system; see `common.simulation`.

        Raises:
            SpecError: `nothing-to-simulate`; `not-supported` for an input to compare with; see `solve`.
        """
        return simulate(self.simulation, self._delivered(), executor)

    def _delivered(self) -> Delivered:
        started = time.perf_counter()
        raw, excitation, units = self.experiment, self.excitation, self.header.units
        experiment = raw.whitened(excitation.scale)
        if excitation.samples is not None:
            experiment = replace(experiment, samples=len(excitation.samples))
        information = excitation.information(experiment)
        _check_excites(experiment, information)
        requirements = [make(experiment) for make in self.requirements]
        simulated = self._simulated(experiment)
        confidence = Confidence.of(self.calibration, requirements, information, self.alpha, simulated)
        requirements = with_alpha(requirements, confidence.alpha)
        cost = weighted_sum(self.cost, excitation.power)
        level = cost / weighted_sum(self.cost, GivenExcitation.even(raw, 1.0).power)
        white = GivenExcitation.even(raw, level).information(experiment)
        result = self._result(experiment, requirements, information, confidence)
        tables = self._at_plants(result, experiment, requirements, information)
        result |= {"cost": cost, "power": excitation.power, "spectrum": self._spectrum_entry()}
        result["baseline"] = {"white": {"cost": cost, "excitation_power": level}}
        curves: dict[str, Curves] = {}
        stated = model_errors(requirements)
        unstated = [replace(error, experiment=experiment) for error in self.unstated]
        tables["bound"], curves["bound"] = bound_curves(
            units,
            stated or unstated,
            information,
            white=white,
            white_labels=white_labels(result),
            stated=bool(stated),
        )
        loops = nyquist_curves(units, (stated or unstated)[:1], information)
        tables, curves = tables | loops[0], curves | loops[1]
        if excitation.basis is not None and excitation.x is not None:
            tables["spectrum"], curves["spectrum"] = spectrum_curves(
                units,
                excitation.basis,
                excitation.x,
                experiment.band,
                white=level if units.inputs == 1 else None,
            )
        ellipses = experiment_ellipses(experiment, information, white, self.ellipses)
        if ellipses is not None:
            curves["ellipses"] = ellipses
        record, files = self._record(experiment, worst_ratio(requirements)), {}
        if record is not None:
            result["signal"] = signal_entry(self.record, units, experiment, record, requirements)
            drawn = signal_curves(self.record, units, experiment, record)
            tables, curves = tables | drawn[0], curves | {"signal": drawn[1]}
            files = other_files(self.record, units, record)
        notes = result.pop("notes", [])
        notes += record_notes(self.record, experiment.samples, record, {}) if record is None else []
        if record is not None and np.isfinite(record.worst_ratio):
            start = begun_anywhere(experiment, record.samples, self.record.step, requirements)
            result["signal"] |= start.entry
            notes += start.notes
        foreseen = Foreseen()
        if record is not None and self.foresight is not None:
            foreseen = self.foresight.foreseen(record.samples, requirements, result)
            result |= {"foreseen": foreseen.entry} if foreseen.entry else {}
        if notes:
            result["notes"] = notes
        result["timing_s"] = {"analysis": time.perf_counter() - started}
        outcome = typed(result)
        broken = limits_not_kept(
            self.limits, experiment.samples, read_plain(Powers, excitation.power), outcome.signal
        )
        outcome = outcome.saying([*broken, *foreseen.findings])
        results = Results(outcome, self.header.resolved_spec, units.time_unit, tables, curves, files)
        if record is None:
            return Delivered(results, None, None, confidence.alpha)
        renewed, seen = self._renewed(len(record.samples)), self.foresight
        tried = None if seen is None else partial(seen.tried, record.samples, requirements)
        of_length = partial(
            curves_of_length,
            units,
            experiment,
            information,
            white,
            stated or unstated,
            stated=bool(stated),
            ellipses=self.ellipses,
        )
        return Delivered(results, record.samples, renewed, confidence.alpha, of_length, tried)

    def _result(
        self,
        experiment: Experiment,
        requirements: Sequence[Requirement],
        information: Array,
        confidence: Confidence,
    ) -> dict[str, Json]:
        beyond, told_to = self._beyond(experiment, requirements, information)
        met = beyond <= max(_ROUNDING, told_to)
        result: dict[str, Json] = {
            "format": 1,
            "title": self.header.title,
            "status": "given" if not requirements else "met" if met else "missed",
            "samples": experiment.samples,
            "information": information_entry(experiment, information),
        }
        if met and told_to:
            result["notes"] = [
                f"what is asked is met to the {told_to:.1g} to which the table tells the spectrum, linear "
                "between its rows"
            ]
        if self.criterion is not None:
            criterion = self.criterion(experiment)
            value = criterion.value(criterion.level(information))
            result["objective"] = {"kind": criterion.letter, "value": value}
        nowhere = np.zeros(0)
        units = self.header.units
        return result | requirements_entry(units, confidence, requirements, information, nowhere)

    def _at_plants(
        self,
        result: dict[str, Json],
        experiment: Experiment,
        requirements: Sequence[Requirement],
        information: Array,
    ) -> dict[str, Table]:
        """Add what the excitation buys at the other plants to the result, and return their table."""
        if self.plants is None:
            return {}
        excited = AtPlants(self.excitation.information, self.excitation.scale, experiment.samples)
        nominal, centre = kept_of(requirements, information), experiment.model.theta
        found = given_robust(excited, self.plants, nominal, centre, self.header.units)
        result["robust"] = found.entry
        if found.entry["missed"]:
            result["status"] = "missed"
        result["notes"] = [*result.get("notes", []), *found.notes]
        return dict(found.tables)

    def _beyond(
        self, experiment: Experiment, requirements: Sequence[Requirement], information: Array
    ) -> tuple[float, float]:
        """How far the largest ratio is above one, and the error of it that the rows of a table leave.

        That is looked at only where it decides; 0 else.
        """

        def largest(M: Array) -> float:
            return max((worst(r.violations(M)).ratio for r in requirements), default=0.0)

        ratio, basis, x = largest(information), self.excitation.basis, self.excitation.x
        decides = _ROUNDING < ratio - 1.0 <= _TABLE_ERROR
        if not decides or x is None or not isinstance(basis, TabulatedSpectrum):
            return ratio - 1.0, 0.0
        raised = largest(spectral_information(basis.raised(_TABLE_SHARE), x, experiment))
        return ratio - 1.0, min(ratio - raised, _TABLE_ERROR)

    def _spectrum_entry(self) -> dict[str, Json]:
        excitation, units = self.excitation, self.header.units
        entry: dict[str, Json] = {"type": "given", "given": excitation.kind}
        if isinstance(excitation.basis, LinesBasis) and excitation.x is not None:
            frequencies, powers = excitation.basis.lines(excitation.x)
            entry["frequencies"] = frequencies / units.frequency
            entry["powers"] = powers[:, 0, 0].real if units.inputs == 1 else plain_complex(powers)
        elif excitation.kind == "white":
            entry["power"] = excitation.power["excitation"]
            if units.inputs == 1:
                entry["coefficients"] = excitation.power["excitation"]
        return entry

    def _record(self, experiment: Experiment, ratio: Callable[[Array], float]) -> Record | None:
        """The signal as given, or one record of the given spectrum; None for one too short."""
        excitation, request = self.excitation, self.record
        if excitation.samples is not None:
            return Record(excitation.samples, "given", ratio(excitation.information(experiment)))
        basis, x = excitation.basis, excitation.x
        if basis is None or x is None:
            return None
        several = experiment.inputs > 1
        if excitation.sinusoids is not None and several:
            return self._in_phase(*excitation.sinusoids, experiment, ratio)
        spectrum = DesignedSpectrum.of(basis, x, inputs=experiment.inputs, step=request.step)
        return given_record(request, experiment, spectrum, ratio)

    def _simulated(self, experiment: Experiment) -> SimulatedEstimates | None:
        """Estimates of such experiments, for an exact confidence."""
        if self.simulator is None:
            return None
        if self.excitation.samples is not None:
            return self.simulator.of_record(self.excitation.samples)
        samples = as_long(self.record, experiment)
        renewed = None if samples is None else self._renewed(samples)
        return None if samples is None or renewed is None else self.simulator.of(renewed, samples)

    def _renewed(self, samples: int) -> Excitation | None:
        """What realises the spectrum anew; None for a record that was given."""
        excitation, request = self.excitation, self.record
        basis, x = excitation.basis, excitation.x
        if basis is None or x is None:
            return None
        inputs = self.experiment.inputs
        if excitation.sinusoids is not None and isinstance(basis, LinesBasis) and inputs > 1:
            frequencies, amplitudes = excitation.sinusoids
            return InPhase("design", frequencies * request.step, amplitudes, basis, x)
        spectrum = DesignedSpectrum.of(basis, x, inputs=inputs, step=request.step)
        return Redrawn("design", SignalGenerator(spectrum, request.settings, samples, request.band), basis, x)

    def _in_phase(
        self, frequencies: Array, amplitudes: Array, experiment: Experiment, ratio: Callable[[Array], float]
    ) -> Record | None:
        """Sinusoids in phase over several inputs: their power matrices have rank one, in every period."""
        request = self.record
        samples = request.length(experiment.samples)
        if not request.feasible(experiment.samples, least_period(1)):
            return None
        rng = np.random.default_rng(request.settings.seed)
        record = in_phase_record(frequencies * request.step, amplitudes, samples, rng)
        return Record(record, "multisine", _ratio_of(request, experiment, record, ratio))


def _ratio_of(
    request: RecordRequest, experiment: Experiment, record: Array, ratio: Callable[[Array], float]
) -> float:
    """The worst ratio of a record; infinite when it is too short to excite every parameter."""
    try:
        return ratio(FiniteRecord(experiment, len(record), request.step).information(record))
    except np.linalg.LinAlgError:
        return np.inf


def _check_excites(experiment: Experiment, information: Array) -> None:
    """Raise `SpecError` (`not-exciting`) when the information matrix is singular to working precision."""
    eigenvalues, vectors = np.linalg.eigh(information)
    if eigenvalues[0] > _TOO_FAINT * eigenvalues[-1]:
        return
    raise bad_spec(
        "not-exciting",
        f"this excitation tells nothing about {experiment.unexcited(vectors[:, 0])}: infinite variance",
        hint="each sinusoid determines at most two parameters: add frequencies, or drop parameters",
        key="spectrum.given",
    )
