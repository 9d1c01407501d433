"""Convex designs: least cost, best accuracy, shortest experiment, with proof, signal and curves."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from inputdesign_cli.accuracy import ModelError, OnModelError, model_errors
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.convex.designs import Design, Question, solve_design
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.problem import Weight
from inputdesign_cli.design.convex.textbook import solve_on_grid
from inputdesign_cli.errors import InaccurateError, InfeasibleError
from inputdesign_cli.information import Experiment, FiniteRecord, PowerKind
from inputdesign_cli.monte_carlo.excitations import Redrawn
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Curves, Json, Results, Table
from inputdesign_cli.runs.units import Header
from inputdesign_cli.signal import Record
from inputdesign_cli.spectrum import flat_basis
from inputdesign_cli.tasks.audit import audit
from inputdesign_cli.tasks.factor_columns import FewColumns, restrict_columns
from inputdesign_cli.tasks.other_spectra import power_that_fits
from inputdesign_cli.tasks.record import RecordRequest, designed_spectrum, make_record, record_notes, redrawn
from inputdesign_cli.tasks.result.bound import bound_curves
from inputdesign_cli.tasks.result.design import Designed, design_result
from inputdesign_cli.tasks.result.ellipses import Pairs, experiment_ellipses
from inputdesign_cli.tasks.result.infeasible import explain
from inputdesign_cli.tasks.result.signal import other_files, signal_curves, signal_entry
from inputdesign_cli.tasks.result.spectrum import optimality_curves, spectrum_curves, with_periodogram
from inputdesign_cli.tasks.simulation import Delivered, Simulation, simulate

# A gap up to this many tolerances is "almost optimal"; beyond, there is no answer.
_ALMOST = 100.0


@dataclass(frozen=True)
class GridMethod:
    """The papers' own program: on how many frequencies, and how positivity is written."""

    lines: int
    positivity: Literal["gram", "kyp"]


@dataclass(frozen=True)
class ConvexTask:
    """A convex design.

    `experiment` is of the length that the spec states (in `question` it has one sample where the length is
    sought). `alpha` sizes the confidence region of r_u, `most_samples` is the longest experiment allowed.
    `unstated` are errors of the entries of G that have r_u where no requirement bounds it.
    """

    header: Header
    question: Question
    experiment: Experiment
    cost: dict[PowerKind, Weight]
    alpha: float
    tolerance: float
    any_spectrum_tolerance: float
    most_samples: int | None
    ellipses: Pairs | None
    grid: GridMethod | None
    columns: FewColumns | None
    record: RecordRequest
    unstated: Sequence[ModelError]
    simulation: Simulation

    def check(self) -> None:
        """Nothing: building has checked all."""

    def solve(self) -> Results:
        """The design, its proof, its signal and its curves.

        Raises:
            InfeasibleError: nothing within the limits meets the requirements.
            InaccurateError: the proof did not close.
        """
        return self._delivered().results

    def simulate(self, executor: Executor | None = None) -> Results:
        """The same, with the design tried many times on the true system; see `tasks.simulation`.

        Raises:
            SpecError: `nothing-to-simulate`; `not-supported` for an input to compare with.
            InfeasibleError, InaccurateError: see `solve`.
        """
        return simulate(self.simulation, self._delivered(), executor)

    def _delivered(self) -> Delivered:
        started = time.perf_counter()
        done, how = self.designed()
        result = design_result(done, how, self.tolerance)
        if self.columns is not None:
            result["spectrum"] |= {"factor_columns": self.columns.columns}
        self._check_length(result)
        solved = time.perf_counter()
        audit(done, result, on_grid=self.grid is not None)
        checked = time.perf_counter()
        record = self._made(done)
        tables, curves = self._illustrations(done, record)
        files: dict[str, bytes] = {}
        if record is not None:
            result["signal"] = self._signal_entry(done, record)
            tables["signal"], curves["signal"] = signal_curves(self.record, self.header.units, record)
            files = other_files(self.record, self.header.units, record)
        if done.design.result.x.any():
            notes = record_notes(self.record, done.experiment.samples, record)
            result |= {"notes": [*result.get("notes", []), *notes]} if notes else {}
        result["timing_s"] = {
            "design": solved - started,
            "check": checked - solved,
            "signal": time.perf_counter() - checked,
        }
        units = self.header.units
        results = Results(result, self.header.resolved_spec, units.time_unit, tables, curves, files)
        if record is None:
            return Delivered(results, None, None)
        found = done.design.result
        generator = redrawn(self.record, done.design, record)
        return Delivered(results, record.samples, Redrawn("design", generator, found.basis, found.x))

    def _made(self, done: Designed) -> Record | None:
        """The record; where none is found within the limits on samples, the error names what would do.

        Raises:
            InfeasibleError: `limits-too-tight`.
        """
        try:
            return make_record(self.record, done.design, done.experiment)
        except InfeasibleError as missed:
            power = power_that_fits(self.record, self.question, done.design, done.experiment)
            if power is None:
                raise
            told = missed.diagnostics[0]
            hint = f"with limits.input_power: {power:.4g} a record of this length does; or {told.hint}"
            raise InfeasibleError(replace(told, hint=hint)) from missed

    def designed(self) -> tuple[Designed, dict[str, Json]]:
        """The design with its experiment, its status and what the solver did.

        Raises:
            InfeasibleError, InaccurateError: see `solve`.
        """
        design, how = self._by_exchange() if self.grid is None else self._by_grid(self.grid)
        if self.columns is not None:
            design, climbed = restrict_columns(self.columns, design)
            how |= climbed
        experiment = design.problem.experiment
        if design.problem.goal == "samples":
            experiment = replace(experiment, samples=max(int(np.ceil(design.result.s * (1 - 1e-9))), 1))
        return Designed(self.header, self.question, design, experiment, self.cost, self.alpha), how

    def _by_exchange(self) -> tuple[Design, dict[str, Json]]:
        try:
            design = solve_design(
                self.question, tolerance=self.tolerance, any_spectrum_tolerance=self.any_spectrum_tolerance
            )
        except UnreachableError as unreachable:
            raise explain(self.header.units, self.question, unreachable) from unreachable
        found = design.result
        if found.gap > _ALMOST * self.tolerance:
            raise InaccurateError.because(
                "gap-not-closed",
                f"the design is proved only to within {found.gap:.1e} of the optimum; solver.tolerance "
                f"asks for {self.tolerance:.1e}",
                hint="loosen solver.tolerance, lower the order of the spectrum, or look for parameters "
                "that are nearly indistinguishable",
                key="solver.tolerance",
            )
        status = "optimal" if found.gap <= self.tolerance else "almost_optimal"
        return design, {
            "method": "exchange",
            "status": "nothing_needed" if found.objective == 0.0 else status,
            "rounds": found.rounds,
            "cuts": found.cuts,
            "any_spectrum_gap": design.any_spectrum.gap,
        }

    def _by_grid(self, method: GridMethod) -> tuple[Design, dict[str, Json]]:
        white = replace(self.question, basis=flat_basis(self.experiment))
        baseline = solve_design(white, tolerance=self.tolerance)
        basis = self.question.basis
        problem = replace(baseline.problem, basis=basis)
        stated = [r for r in problem.requirements if isinstance(r, ModelError)]
        lo, hi = stated[0].band
        frequencies = np.geomspace(max(lo, 1e-3 * hi), hi, method.lines)
        start = baseline.white_power * basis.even
        answer = solve_on_grid(problem, stated, frequencies, start, positivity=method.positivity)
        on_grid = replace(
            baseline.result,
            basis=basis,
            x=answer.x,
            objective=answer.cost,
            information=problem.information(answer.x),
            certificate=answer.certificate,
            active=(),
        )
        how = {"method": "lmi", "status": "optimal_on_grid", "grid": method.lines}
        return replace(baseline, problem=problem, result=on_grid), how

    def _check_length(self, result: dict[str, Json]) -> None:
        """Raise `InfeasibleError` when even the shortest experiment is longer than limits.samples."""
        most = self.most_samples
        if self.question.goal != "samples" or most is None or result["samples"] <= most:
            return
        least = int(np.ceil(result["objective"]["lower_bound"]))
        raise InfeasibleError.because(
            "too-long",
            f"the shortest experiment within the power limits takes {result['samples']} samples (proved: "
            f"no fewer than {least}), but limits.samples is {most}",
            hint="allow more samples or more power, or ask for less accuracy",
            key="limits.samples",
        )

    def _signal_entry(self, done: Designed, record: Record) -> dict[str, Json]:
        design = done.design
        return signal_entry(
            self.record,
            self.header.units,
            done.experiment,
            record,
            design.problem.requirements,
            designed=design.result.information,
            spectrum=designed_spectrum(self.record, design, done.experiment.inputs),
        )

    def _illustrations(
        self, done: Designed, record: Record | None
    ) -> tuple[dict[str, Table], dict[str, Curves]]:
        """Tables and curves of the spectrum, of r_u and of the proof."""
        design, units = done.design, self.header.units
        found, problem = design.result, design.problem
        level = design.white_power if units.inputs == 1 else None
        spectrum = spectrum_curves(units, found.basis, found.x, problem.experiment.band, white=level)
        if record is not None:
            spectrum = with_periodogram(units, *spectrum, record.samples)
        tables: dict[str, Table] = {"spectrum": spectrum[0]}
        curves: dict[str, Curves] = {"spectrum": spectrum[1]}
        if not found.x.any():
            return tables, curves
        white = design.white.information / (design.white.s if problem.goal == "factor" else 1.0)
        asked = (*problem.requirements, *problem.side)
        errors = model_errors(asked)
        unstated = [replace(error, experiment=done.experiment) for error in self.unstated]
        with suppress(np.linalg.LinAlgError):  # a parameter that a T-optimal design does not excite
            tables["bound"], curves["bound"] = bound_curves(
                units,
                errors or unstated,
                found.information,
                white=white,
                record=self._known(done, record),
                stated=bool(errors),
                active=[found.active_at(i) for i, r in enumerate(asked) if isinstance(r, OnModelError)],
            )
        optimality = optimality_curves(units, design)
        if optimality is not None:
            tables["optimality"], curves["optimality"] = optimality
        shown = white if problem.needs_definite else None
        ellipses = experiment_ellipses(done.experiment, found.information, shown, self.ellipses)
        if ellipses is not None:
            curves["ellipses"] = ellipses
        return tables, curves

    def _known(self, done: Designed, record: Record | None) -> Array | None:
        """The information (k, k) of the record; None where it leaves a parameter undetermined."""
        if record is None or not np.isfinite(record.worst_ratio):
            return None
        plant = FiniteRecord(done.experiment, len(record.samples), self.record.step)
        return plant.information(record.samples)
