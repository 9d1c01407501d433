"""Spec -> design -> outcome."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import ModelError
from inputdesign_cli.design.convex.designs import Design, solve_design
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.textbook import solve_on_grid
from inputdesign_cli.errors import Diagnostic, InaccurateError, InfeasibleError
from inputdesign_cli.runs.results import Results
from inputdesign_cli.signal.single import as_channels
from inputdesign_cli.specification import Spec
from inputdesign_cli.spectrum import FirBasis
from inputdesign_cli.tasks.build.header import build_units
from inputdesign_cli.tasks.build.signal_settings import build_record_request
from inputdesign_cli.tasks.build.task import Task, build_task, lines_of_the_grid
from inputdesign_cli.tasks.record import designed_spectrum, make_record, record_notes
from inputdesign_cli.tasks.result.curves import (
    bound_curves,
    optimality_curves,
    spectrum_curves,
)
from inputdesign_cli.tasks.result.ellipses import experiment_ellipses
from inputdesign_cli.tasks.result.infeasible import explain
from inputdesign_cli.tasks.result.periodogram import with_periodogram, with_record
from inputdesign_cli.tasks.result.result import design_result, experiment_of
from inputdesign_cli.tasks.result.signal import other_files, signal_curves, signal_entry

# A gap up to this many tolerances is "almost optimal"; beyond, there is no answer.
_ALMOST = 100.0


def solve_convex(spec: Spec) -> Results:
    """The design, its proof, its signal and its curves.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
        InfeasibleError: nothing within the limits meets the requirements.
        InaccurateError: the proof did not close.
    """
    started = time.perf_counter()
    task = build_task(spec)
    with plain_errors():
        if spec.solver.method == "lmi":
            design, how = _by_grid(spec, task)
        else:
            design, how = by_exchange(spec, task)
    result = design_result(spec, task, design, how)
    check_length(spec, result)
    solved = time.perf_counter()
    experiment = experiment_of(task, design)
    request, units, channel = build_record_request(spec), build_units(spec), as_channels(experiment)
    record = make_record(request, design, channel)
    if record is not None:
        result["signal"] = signal_entry(
            request,
            units,
            channel,
            record,
            design.problem.requirements,
            designed=design.result.information,
            spectrum=designed_spectrum(request, design, 1),
        )
        notes = record_notes(request, experiment.samples, record)
        if notes:
            result["notes"] = [*result.get("notes", []), *notes]
    result["timing_s"] = {"design": solved - started, "signal": time.perf_counter() - solved}
    tables: dict[str, Any] = {}
    curves: dict[str, Any] = {}
    white = design.white_power
    tables["spectrum"], curves["spectrum"] = spectrum_curves(
        spec, design.result.basis, design.result.x, white
    )
    if result["status"] != "nothing_needed":
        flat = design.white.information / (design.white.s if design.problem.goal == "factor" else 1.0)
        tables["bound"], curves["bound"] = bound_curves(
            spec,
            experiment,
            task,
            design.result.information,
            white=flat,
            active=design.result.active_frequencies,
        )
        ellipses = experiment_ellipses(spec, experiment, design.result.information, flat)
        if ellipses is not None:
            curves["ellipses"] = ellipses
        optimality = optimality_curves(spec, design)
        if optimality is not None:
            curves["optimality"] = optimality
    if record is not None:
        tables["signal"], curves["signal"] = signal_curves(request, units, record)
        tables["spectrum"], curves["spectrum"] = with_periodogram(
            tables["spectrum"], curves["spectrum"], spec, record.samples[:, 0]
        )
        curves["bound"] = with_record(curves["bound"], spec, experiment, task.alpha, record.samples[:, 0])
    files = {} if record is None else other_files(request, units, record)
    return Results(result, spec.to_yaml(), spec.time_unit, tables, curves, files)


@contextmanager
def plain_errors() -> Iterator[None]:
    """Numerical failures in the words of the spec."""
    try:
        yield
    except np.linalg.LinAlgError as error:
        raise InaccurateError(
            Diagnostic(
                "numerically-singular",
                "the information matrix is singular to working precision: the parameters are nearly "
                "indistinguishable",
                hint="lower the orders, or look for poles and zeros that nearly cancel",
                key="plant",
            )
        ) from error


def by_exchange(spec: Spec, task: Task) -> tuple[Design, dict[str, Any]]:
    tolerance = spec.solver.tolerance
    try:
        design = solve_design(task.question, tolerance=tolerance)
    except UnreachableError as unreachable:
        raise explain(spec, task, unreachable) from unreachable
    result = design.result
    gap = result.gap
    if gap > _ALMOST * tolerance:
        raise InaccurateError(
            Diagnostic(
                "gap-not-closed",
                f"the design is proved only to within {gap:.1e} of the optimum; solver.tolerance asks for "
                f"{tolerance:.1e}",
                hint="loosen solver.tolerance, lower the order of the spectrum, or look for parameters that "
                "are nearly indistinguishable",
                key="solver.tolerance",
            )
        )
    status = "optimal" if gap <= tolerance else "almost_optimal"
    if result.objective == 0.0:
        status = "nothing_needed"
    return design, {
        "method": "exchange",
        "status": status,
        "rounds": result.rounds,
        "cuts": result.cuts,
        "any_spectrum_gap": design.any_spectrum.gap,
    }


def _by_grid(spec: Spec, task: Task) -> tuple[Design, dict[str, Any]]:
    requirement = task.model_error
    assert isinstance(requirement, ModelError)
    baseline = solve_design(replace(task.question, basis=FirBasis(0)), tolerance=spec.solver.tolerance)
    basis = task.question.basis
    assert isinstance(basis, FirBasis)
    problem = replace(baseline.problem, basis=basis)
    answer = solve_on_grid(
        problem,
        lines_of_the_grid(spec, requirement),
        baseline.white_power * basis.white,
        positivity=spec.solver.positivity,
    )
    on_grid = replace(
        baseline.result,
        basis=basis,
        x=answer.x,
        objective=answer.cost,
        information=problem.information(answer.x),
        certificate=answer.certificate,
        active=(),
    )
    how = {"method": "lmi", "status": "optimal_on_grid", "grid": int(spec.solver.grid)}
    return replace(baseline, problem=problem, result=on_grid), how


def check_length(spec: Spec, result: dict[str, Any]) -> None:
    """Raise `InfeasibleError` when even the shortest experiment is longer than limits.samples."""
    most = spec.limits.samples
    if spec.goal != "shortest_experiment" or most is None or result["samples"] <= most:
        return
    raise InfeasibleError(
        Diagnostic(
            "too-long",
            f"the shortest experiment within the power limits takes {result['samples']} samples (proved: no "
            f"fewer than {int(np.ceil(result['objective']['lower_bound']))}), but limits.samples is {most}",
            hint="allow more samples or more power, or ask for less accuracy",
            key="limits.samples",
            location=spec.locate("limits.samples"),
        )
    )
