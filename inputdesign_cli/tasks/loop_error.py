"""Spec -> design for the closed-loop error -> outcome."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from inputdesign_cli.design.loop_error import ParametricCriterion
from inputdesign_cli.design.loop_error.loss import error_eigenvalues, root_moments
from inputdesign_cli.plant.frequencies import graded_grid, local_maxima
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.runs.results import Results, SignalCurves, Table
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.loop_error_design import ClosedLoopDesign, design_closed_loop
from inputdesign_cli.tasks.loop_error_signal import ClosedLoopSignal, realise_closed_loop
from inputdesign_cli.tasks.result.loop_error_curves import spectrum_tables


def solve_closed_loop_error(spec: Spec) -> Results:
    """The design, its proof, its signal and its curves."""
    started = time.perf_counter()
    design = design_closed_loop(spec)
    solved = time.perf_counter()
    return outcome_of(spec, design, design_seconds=solved - started)


def outcome_of(spec: Spec, design: ClosedLoopDesign, *, design_seconds: float) -> Results:
    """What a design hands to the record and the report."""
    started = time.perf_counter()
    signal = realise_closed_loop(spec, design)
    result = _result(spec, design)
    result["signal"] = _signal_entry(signal)
    result["timing_s"] = {"design": design_seconds, "signal": time.perf_counter() - started}
    tables, curves = spectrum_tables(spec, design)
    time_axis = spec.sample_time * np.arange(signal.samples.shape[1], dtype=np.float64)
    channels = {f"u{i + 1}": u for i, u in enumerate(signal.samples)}
    tables["signal"] = Table({f"time_{spec.time_unit}": time_axis, **channels})
    curves["signal"] = SignalCurves(time_axis, channels)
    return Results(result, spec.to_yaml(), spec.time_unit, tables, curves)


def loss_entry(criterion: ParametricCriterion, information: Array) -> dict[str, Any]:
    """Theory for the model structure: N E||y - y0||^2, and mean and sd of its root over experiments."""
    covariance = np.asarray(np.linalg.inv(information))
    mean, sd = root_moments(error_eigenvalues(criterion.W, covariance))
    return {"value": criterion.value(information), "loss": {"mean": mean, "sd": sd}}


def _result(spec: Spec, design: ClosedLoopDesign) -> dict[str, Any]:
    error = spec.accuracy.closed_loop_error
    assert error is not None
    samples = spec.experiment.samples
    information = design.information
    inputs = design.covariance("input")
    outputs = design.covariance("output")
    power = {
        "input": np.diag(inputs).tolist(),
        "output": np.diag(outputs).tolist(),
        "excitation": np.diag(inputs).tolist(),
    }
    optimal = design.gap <= spec.solver.tolerance
    structure = {
        "design": loss_entry(design.criterion, information),
        "white": loss_entry(design.criterion, design.white_information),
    }
    return {
        "format": 1,
        "title": spec.title,
        "status": "optimal" if optimal else "almost_optimal",
        "objective": {
            "kind": "closed_loop_error",
            "value": design.value,
            "lower_bound": design.lower_bound,
            "relative_gap": design.gap,
            "any_spectrum_bound": design.lower_bound,
        },
        "cost": _cost(spec, power),
        "samples": samples,
        "power": power,
        "closed_loop_error": {
            "law": _law_name(spec),
            "covariance": error.covariance,
            "expected": design.value / samples,
            "band": [edge / spec.sample_time for edge in design.problem.band],
            "noise_model_part": design.noise_part,
            "parametric": structure,
            "limits": _limits_entry(design),
        },
        "information": {
            "parameters": list(design.problem.plant.names),
            "matrix": samples * information,
            "covariance": np.linalg.inv(information) / samples,
        },
        "spectrum": _spectrum_entry(spec, design),
        "baseline": {
            "white": {
                "value": design.white_value,
                "ratio": design.white_value / design.value,
                "power": _white_power(design),
            }
        },
        "solver": {
            "method": "exchange" if design.lines is not None else "dual",
            "steps": design.steps,
            "nodes": int(design.rule.nodes.size),
            "settled": design.settled,
            "tolerance": spec.solver.tolerance,
        },
    }


def _white_power(design: ClosedLoopDesign) -> dict[str, list[float]]:
    n = design.problem.plant.inputs
    share = design.white_level * float(design.rule.weights.sum())
    G = design.problem.plant.plant_at(design.rule.nodes)
    gain = np.einsum("kab,kab,k->a", G, np.conj(G), design.rule.weights).real
    output = (design.white_level * gain).tolist()
    return {"input": [share] * n, "output": output, "excitation": [share] * n}


def _cost(spec: Spec, power: dict[str, list[float]]) -> float:
    weights = {
        "input": spec.cost.input_power,
        "output": spec.cost.output_power,
        "excitation": spec.cost.excitation_power,
    }
    return float(sum(np.sum(np.asarray(weights[kind]) * np.array(power[kind])) for kind in power))


def _law_name(spec: Spec) -> str:
    error = spec.accuracy.closed_loop_error
    assert error is not None
    names = ("model_reference", "internal_model", "minimum_variance")
    return next(name for name in names if getattr(error.control, name) is not None)


def _limits_entry(design: ClosedLoopDesign) -> list[dict[str, Any]]:
    rows = []
    for index, limit in enumerate(design.problem.limits):
        row: dict[str, Any] = {
            "power": limit.kind,
            "max": limit.most,
            "attained": float(design.powers[index]),
        }
        if limit.channel is not None:
            row["channel"] = limit.channel + 1
        if design.multipliers is not None:
            row["multiplier"] = float(design.multipliers[index])
        rows.append(row)
    return rows


def _spectrum_entry(spec: Spec, design: ClosedLoopDesign) -> dict[str, Any]:
    if design.lines is not None:
        lines = design.lines
        return {
            "type": "multisine",
            "frequencies": lines.frequencies / spec.sample_time,
            "masses": lines.spectrum,
        }
    entry: dict[str, Any] = {"type": "pointwise", "grid": getattr(spec.spectrum, "grid", 512)}

    def trace(w: Array) -> Array:
        return np.asarray(np.trace(design.density(w), axis1=1, axis2=2).real)

    lo, hi = design.problem.band
    grid = graded_grid(design.problem.plant.singularities, lo, hi)
    peaks, heights = local_maxima(trace, grid, trace(grid))
    top = float(peaks[np.argmax(heights)])
    where = {"peak": top, "lowest": lo, "highest": hi}
    for name, w in where.items():
        matrix = design.density(np.array([w]))[0]
        entry[name] = {
            "frequency": w / spec.sample_time,
            "trace": float(np.trace(matrix).real),
            "matrix": _tidy(matrix),
            "eigenvalues": np.linalg.eigvalsh(matrix),
        }
    entry["loop_input"] = _loop_input(design)
    return entry


def _loop_input(design: ClosedLoopDesign) -> dict[str, Any]:
    """C S Phi_r (C S)^* at the lowest frequency: what the loop will apply there, and its matrix root."""
    problem = design.problem
    w = np.array([problem.band[0]])
    applied = np.linalg.inv(problem.plant.plant_at(w)) @ problem.law.complementary(w)
    reference = problem.entering(w) - problem.plant.disturbance_at(w)
    matrix = (applied @ reference @ np.conj(np.swapaxes(applied, 1, 2)))[0]
    values, vectors = np.linalg.eigh(matrix)
    root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ np.conj(vectors.T)
    return {
        "matrix": _tidy(matrix),
        "root": _tidy(root),
        "root_eigenvalues": np.sqrt(np.maximum(values, 0.0)),
    }


def _tidy(matrix: ComplexArray) -> Array | ComplexArray:
    """The real part of a matrix that is real up to rounding."""
    return matrix.real if np.abs(matrix.imag).max() <= 1e-13 * np.abs(matrix).max() else matrix


def _signal_entry(signal: ClosedLoopSignal) -> dict[str, Any]:
    u = signal.samples
    rms = np.sqrt(np.mean(u * u, axis=1))
    peak = np.abs(u).max(axis=1)
    return {
        "type": signal.method,
        "samples": u.shape[1],
        "power": (rms**2).tolist(),
        "peak": peak.tolist(),
        "crest_factor": (peak / rms).tolist(),
        **signal.details,
    }
