"""Spec -> least-cost design -> outcome."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import ModelError
from inputdesign_cli.assemble.curves import (
    bound_curves,
    distinct,
    optimality_curves,
    signal_curves,
    spectrum_curves,
)
from inputdesign_cli.assemble.experiment import build_cost, build_experiment
from inputdesign_cli.assemble.requirements import build_model_error
from inputdesign_cli.design.least_cost import LeastCost, least_cost, whitened_problem
from inputdesign_cli.design.problem import Problem, RequirementFactory
from inputdesign_cli.design.textbook import solve_on_grid
from inputdesign_cli.design.white import least_white_power
from inputdesign_cli.errors import Complaint, InaccurateError
from inputdesign_cli.information import POWER_KINDS, Experiment
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.signal import Record, input_and_output, realise
from inputdesign_cli.spec import Spec
from inputdesign_cli.spectrum import FirBasis

_CANDIDATES = 20
_DEFAULT_ORDER = 20
# A gap up to this many tolerances is "almost optimal"; beyond, there is no answer.
_ALMOST = 100.0


@dataclass(frozen=True)
class Task:
    """A spec in the words of the mathematics."""

    experiment: Experiment
    requirement: ModelError
    basis: FirBasis
    cost: Mapping[Any, float]

    @property
    def factories(self) -> list[RequirementFactory]:
        """Makes the requirement in other coordinates."""
        return [lambda experiment: replace(self.requirement, experiment=experiment)]


def build_task(spec: Spec) -> Task:
    """Everything that can be wrong with the spec comes to light here, before anything is computed."""
    _check_supported(spec)
    experiment = build_experiment(spec)
    requirement = build_model_error(spec, experiment)
    spectrum = spec.spectrum
    kind = "fir" if spectrum is None else getattr(spectrum, "type", "given")
    order = 0 if kind == "white" else getattr(spectrum, "order", _DEFAULT_ORDER)
    experiment.whitened(1.0)  # says which parameters cannot be told apart
    return Task(experiment, requirement, FirBasis(order), build_cost(spec))


def solve_least_cost(spec: Spec) -> Outcome:
    """The design, its proof, its signal and its curves."""
    started = time.perf_counter()
    task = build_task(spec)
    if spec.solver.method == "lmi":
        solution, how = _by_grid(spec, task)
    else:
        solution, how = _by_exchange(spec, task)
    solved = time.perf_counter()
    record = _record(spec, solution)
    result = _result(spec, task, solution, how)
    if record is not None:
        result["signal"] = _signal_entry(task.experiment, record)
    result["timing_s"] = {"design": solved - started, "signal": time.perf_counter() - solved}
    x, basis = solution.result.x, task.basis
    tables: dict[str, Any] = {}
    curves: dict[str, Any] = {}
    tables["spectrum"], curves["spectrum"] = spectrum_curves(spec, basis, x, solution.white_power)
    if solution.white_power > 0:
        tables["bound"], curves["bound"] = bound_curves(spec, solution)
        curves["optimality"] = optimality_curves(spec, solution)
    if record is not None:
        tables["signal"], curves["signal"] = signal_curves(spec, record.samples)
    return Outcome(result, spec.to_yaml(), spec.time_unit, tables, curves)


def _by_exchange(spec: Spec, task: Task) -> tuple[LeastCost, dict[str, Any]]:
    try:
        solution = least_cost(
            task.experiment, task.basis, task.cost, task.factories, tolerance=spec.solver.tolerance
        )
    except np.linalg.LinAlgError as error:
        raise InaccurateError(
            Complaint(
                "numerically-singular",
                "the information matrix is singular to working precision: the parameters are nearly "
                "indistinguishable",
                hint="lower the orders, or look for poles and zeros that nearly cancel",
                key="plant",
            )
        ) from error
    result = solution.result
    gap = result.gap
    if gap > _ALMOST * spec.solver.tolerance:
        raise InaccurateError(
            Complaint(
                "gap-not-closed",
                f"the design is proved only to within {gap:.1e} of the optimum; solver.tolerance asks for "
                f"{spec.solver.tolerance:.1e}",
                hint="loosen solver.tolerance, lower the order of the spectrum, or look for parameters that "
                "are nearly indistinguishable",
                key="solver.tolerance",
            )
        )
    status = "optimal" if gap <= spec.solver.tolerance else "almost_optimal"
    how = {"method": "exchange", "status": status, "rounds": result.rounds, "cuts": result.cuts}
    return solution, how


def _by_grid(spec: Spec, task: Task) -> tuple[LeastCost, dict[str, Any]]:
    power = least_white_power(task.experiment, task.factories)
    problem = whitened_problem(task.experiment, task.basis, task.cost, task.factories, power)
    solution = least_cost(
        task.experiment, FirBasis(0), task.cost, task.factories, tolerance=spec.solver.tolerance
    )
    lo, hi = task.requirement.band
    frequencies = np.geomspace(max(lo, 1e-3 * hi), hi, spec.solver.grid)
    answer = solve_on_grid(problem, frequencies, power * task.basis.white, positivity=spec.solver.positivity)
    on_grid = replace(
        solution.result,
        basis=task.basis,
        x=answer.x,
        cost=answer.cost,
        information=problem.information(answer.x),
        certificate=answer.certificate,
        active=(),
    )
    how = {"method": "lmi", "status": "optimal_on_grid", "grid": int(spec.solver.grid)}
    return replace(solution, problem=problem, result=on_grid), how


def _result(spec: Spec, task: Task, solution: LeastCost, how: dict[str, Any]) -> dict[str, Any]:
    problem, found = solution.problem, solution.result
    experiment = problem.experiment
    white = solution.white_power * task.basis.white
    white_cost = problem.price.at(white)
    worst = problem.worst_ratio(found.information) if solution.white_power > 0 else None
    known = worst is not None
    result: dict[str, Any] = {
        "format": 1,
        "title": spec.title,
        "status": how.pop("status"),
        "objective": {
            "kind": "least_cost",
            "value": found.cost,
            "lower_bound": found.certificate.bound,
            "relative_gap": abs(found.cost - found.certificate.bound) / found.cost if found.cost > 0 else 0.0,
            "any_spectrum_bound": solution.any_spectrum.certificate.bound,
        },
        "cost": found.cost,
        "samples": experiment.samples,
        "power": _powers(problem, found.x),
        "model_error": {"alpha": task.requirement.alpha},
        "information": {
            "parameters": list(experiment.model.names),
            "matrix": experiment.to_raw(found.information),
        },
        "spectrum": {
            "type": "fir" if task.basis.order else "white",
            "order": task.basis.order,
            "coefficients": found.x,
        },
        "baseline": {
            "white": {
                "cost": white_cost,
                "power": _powers(problem, white),
                "ratio": white_cost / found.cost if found.cost > 0 else 1.0,
            }
        },
        "solver": {**how, "tolerance": spec.solver.tolerance},
    }
    if known and worst is not None and worst.frequency is not None:
        result["model_error"] |= {
            "worst_ratio": worst.ratio,
            "worst_frequency": worst.frequency / spec.sample_time,
            "active_frequencies": distinct(found.active_frequencies) / spec.sample_time,
        }
        result["information"]["covariance"] = experiment.raw_covariance(found.information)
    return result


def _powers(problem: Problem, x: np.ndarray) -> dict[str, list[float]]:
    return {kind: [problem.power(kind).at(x)] for kind in POWER_KINDS}


def _record(spec: Spec, solution: LeastCost) -> Record | None:
    if solution.white_power == 0:
        return None
    problem = solution.problem

    def worst_ratio(information: np.ndarray) -> float:
        return problem.worst_ratio(information).ratio

    return realise(
        problem.experiment,
        FirBasis(solution.result.x.size - 1),
        solution.result.x,
        worst_ratio,
        method="multisine" if spec.signal.type == "multisine" else "filtered_noise",
        samples=spec.signal_samples,
        candidates=spec.signal.candidates or _CANDIDATES,
        seed=spec.signal.seed or 0,
    )


def _signal_entry(experiment: Experiment, record: Record) -> dict[str, Any]:
    samples = record.samples
    u, y = input_and_output(experiment, samples)
    peak = float(np.abs(samples).max())
    rms = float(np.sqrt(np.mean(samples**2)))
    entry: dict[str, Any] = {
        "type": record.method,
        "samples": samples.size,
        "power": [rms**2],
        "peak": [peak],
        "crest_factor": [peak / rms],
        "input_power": [float(np.mean(u**2))],
        "output_power": [float(np.mean(y**2))],
    }
    if np.isfinite(record.worst_ratio):
        entry["worst_ratio"] = record.worst_ratio
    if record.factor_residual is not None:
        entry["spectral_factor_residual"] = record.factor_residual
    return entry


_SUPPORTED_SIGNALS = (None, "filtered_noise", "multisine")
_UNSUPPORTED_SIGNAL_KEYS = ("periods", "hold", "lines", "amplitudes", "offset", "ramp", "bits")


def _check_supported(spec: Spec) -> None:
    """Say plainly what this version does not design yet, rather than ignore it."""

    def refuse(key: str, what: str, hint: str) -> Exception:
        return spec.complain("not-supported", f"this version does not {what}", hint=hint, key=key)

    if spec.goal != "least_cost":
        raise refuse(
            "objective" if spec.objective else "accuracy",
            f"design for {spec.goal}",
            "ask for objective: least_cost with model_error",
        )
    for name in (*spec.accuracy.requirements, *spec.accuracy.goals):
        if name != "model_error":
            raise refuse(f"accuracy.{name}", f"handle {name}", "state the accuracy as model_error")
    if spec.accuracy.model_error is None:
        raise spec.complain(
            "missing-key",
            "nothing is asked of the model",
            hint="add accuracy: {model_error: {relative: 0.05}}",
            key="accuracy",
        )
    for name in type(spec.limits).model_fields:
        if getattr(spec.limits, name) is not None:
            raise refuse(
                f"limits.{name}", f"enforce limits.{name}", "remove it, and check the powers in the result"
            )
    kind = "fir" if spec.spectrum is None else getattr(spec.spectrum, "type", "given")
    if kind not in ("fir", "white"):
        raise refuse("spectrum", f"design spectra of type {kind}", "use type: fir or type: white")
    if spec.solver.method == "alternating":
        raise refuse("solver.method", "use the alternating method here", "use exchange or lmi")
    if spec.signal.type not in _SUPPORTED_SIGNALS:
        raise refuse("signal.type", f"make {spec.signal.type} signals", "use filtered_noise or multisine")
    for name in _UNSUPPORTED_SIGNAL_KEYS:
        if getattr(spec.signal, name) is not None:
            raise refuse(f"signal.{name}", f"apply signal.{name}", "remove it")
    if spec.signal.phases not in (None, "random"):
        raise refuse("signal.phases", f"choose {spec.signal.phases} phases", "use phases: random")
