"""Spec -> moments of the regressors that give the least mean-squared error -> outcome."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from inputdesign_cli.design.regression import (
    OutOfReachError,
    ToeplitzDesign,
    design_toeplitz,
    energy_bound,
    error_bound,
    least_energy,
    least_error,
)
from inputdesign_cli.design.regression.alternating import alternate
from inputdesign_cli.design.regression.limits import SMALLEST_EIGENVALUE
from inputdesign_cli.errors import Diagnostic, InaccurateError, InfeasibleError
from inputdesign_cli.runs.results import MomentsCurves, Results, SignalCurves, Table
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.regression_task import KEY, RegressionTask, build_regression
from inputdesign_cli.tasks.build.regressors import RegressorRecord, realise_regressors
from inputdesign_cli.tasks.result.regression_result import MomentsDesign, error_curves, moments_result

_STRUCTURED_TOLERANCE = 1e-6


@dataclass(frozen=True)
class RegressionRun:
    """A design with its regressors, for the study, and its outcome."""

    task: RegressionTask
    design: MomentsDesign
    record: RegressorRecord | None
    outcome: Results


def solve_regression(spec: Spec) -> Results:
    """The design, its proof, its signal and its curves."""
    return run_regression(spec).outcome


def run_regression(spec: Spec) -> RegressionRun:
    """The design and all that comes with it.

    Raises:
        SpecError: the spec asks for what a regression design does not do.
        InfeasibleError: `target-out-of-reach`.
        InaccurateError: `target-undecided`.
    """
    started = time.perf_counter()
    task = build_regression(spec)
    design = _toeplitz(spec, task) if task.toeplitz else _free(task)
    solved = time.perf_counter()
    record = realise_regressors(spec, task.regression, design.R, design.rho, task.target)
    result = moments_result(spec, task, design)
    if record is not None:
        result["signal"] = record.entry
    result["timing_s"] = {"design": solved - started, "signal": time.perf_counter() - solved}
    tables: dict[str, Table] = {}
    curves: dict[str, Any] = {
        "error": error_curves(task, design),
        "moments": MomentsCurves(design.R, task.regression.m),
    }
    if record is not None:
        _add_signal(spec, record, tables, curves)
    outcome = Results(result, spec.to_yaml(), spec.time_unit, tables, curves)
    return RegressionRun(task, design, record, outcome)


def _free(task: RegressionTask) -> MomentsDesign:
    regression = task.regression
    if task.target is not None:
        R = least_energy(regression, task.target)
        bound = energy_bound(regression, task.target, R)
    else:
        assert task.energy is not None
        R = least_error(regression, task.energy)
        bound = error_bound(regression, task.energy)
    return MomentsDesign(R, None, regression.error(R), bound, {"method": "closed_form"})


def _toeplitz(spec: Spec, task: RegressionTask) -> MomentsDesign:
    tolerance = _tolerance(spec)
    method = "alternating" if spec.solver.method == "alternating" else "sequential_convex"
    try:
        found: ToeplitzDesign = design_toeplitz(
            task.regression,
            target=task.target,
            energy=task.energy,
            tolerance=tolerance,
            rng=np.random.default_rng(spec.signal.seed or 0),
            search=alternate if method == "alternating" else None,
        )
    except OutOfReachError as error:
        raise _infeasible(task, error) from error
    search = {
        "method": method,
        "starts": found.starts,
        "solves": found.solves,
        "nodes": found.nodes,
        "tolerance": tolerance,
    }
    if found.assumed:
        search["assumed_smallest_eigenvalue"] = found.assumed
    return MomentsDesign(found.R, found.rho, found.split, found.bound, search)


def _tolerance(spec: Spec) -> float:
    return spec.solver.tolerance if "tolerance" in spec.solver.model_fields_set else _STRUCTURED_TOLERANCE


def _infeasible(task: RegressionTask, error: OutOfReachError) -> InfeasibleError | InaccurateError:
    regression, target = task.regression, task.target
    assert target is not None
    bias = error.bias * float(np.linalg.norm(regression.estimated))
    alpha = regression.neglected_norm
    smallest, largest = alpha**2 * bias**2, float(np.sqrt(target)) / bias
    hint = (
        f"a target above {smallest:.7g} can be met, or neglected_norm below {largest:.7g}; "
        "or estimate more parameters"
    )
    if not error.reach:
        message = (
            f"no Toeplitz moments were found that reach a mean-squared error of {target:.7g} (the least "
            f"biased ones leave {smallest:.7g} at any energy), nor was it proved that there are none"
        )
        return InaccurateError(Diagnostic("target-undecided", message, hint=hint, key=f"{KEY}.target"))
    energy = (
        error.reach * regression.n * regression.variance * float(np.sum(regression.estimated**2)) / target
    )
    proof = f"proved for every energy up to {energy:.3g}"
    if error.assumed:
        proof += f" and R11 / r_0 with eigenvalues above {SMALLEST_EIGENVALUE:g}"
    message = (
        f"no Toeplitz moments reach a mean-squared error of {target:.7g} ({proof}): the bias alone "
        f"leaves {smallest:.7g}"
    )
    return InfeasibleError(Diagnostic("target-out-of-reach", message, hint=hint, key=f"{KEY}.target"))


def _add_signal(
    spec: Spec, record: RegressorRecord, tables: dict[str, Table], curves: dict[str, Any]
) -> None:
    channels = {f"u{i + 1}": column for i, column in enumerate(record.channels.T)}
    time_axis = spec.sample_time * np.arange(record.channels.shape[0], dtype=np.float64)
    tables["signal"] = Table({f"time_{spec.time_unit}": time_axis, **channels})
    curves["signal"] = SignalCurves(time_axis, channels)
    if record.line_frequency is not None and record.line_power is not None:
        frequency = record.line_frequency / spec.sample_time
        header = f"frequency_rad_per_{spec.time_unit}"
        tables["spectrum"] = Table({header: frequency, "line_power": record.line_power})
        curves["moments"] = replace(
            curves["moments"],
            line_frequency=frequency,
            line_power=record.line_power,
            nyquist=spec.nyquist,
        )
