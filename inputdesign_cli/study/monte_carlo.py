"""Spec -> Monte Carlo study of a polynomial model: does the experiment keep its promise on the true system?

Every run draws a new realisation of the spectrum (scaled to its power exactly) and new noise. With
`simulation.excitation: record` all runs apply the one record that the design delivers.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import error_bound
from inputdesign_cli.assemble import solve
from inputdesign_cli.assemble.experiment import build_cost, build_experiment
from inputdesign_cli.assemble.signal_settings import build_recipe
from inputdesign_cli.assemble.true_system import true_experiment
from inputdesign_cli.identification import Structure
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome import CloudCurves, ErrorBandCurves, Outcome, SignalCurves, Table
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import Recipe, input_and_output
from inputdesign_cli.signal.recipe import Method
from inputdesign_cli.spec import Spec
from inputdesign_cli.spec.realisation import Simulation
from inputdesign_cli.spectrum import FirBasis, LinesBasis
from inputdesign_cli.study.batches import run_batches
from inputdesign_cli.study.excitations import Excitation
from inputdesign_cli.study.executor import Executor
from inputdesign_cli.study.statistics import binomial_limits, whitened_eigenvalues, wishart_range
from inputdesign_cli.study.trials import TrialJob, Trials, joined, run_job

_QUANTILES = (0.05, 0.5, 0.95)
# A fraction on the true system this far below that on the design model is worth a note.
_GAP = 0.03
_PAIRS = 4
# Time constants of the loop that a figure shows after the end of the excitation.
_FADED = 3.0
# Inputs to compare with have a flat spectrum; white noise is Gaussian.
_METHODS: dict[str, Method] = {
    "white": "filtered_noise",
    "prbs": "prbs",
    "multisine": "multisine",
    "binary": "binary",
}
_CLOUD = 2000
# Runs that are simulated and identified in one pass.
_BATCH = 100


@dataclass(frozen=True)
class Promise:
    """What the design promises over frequency (rad/sample): r_u and, if one is asked for, r_adm."""

    w: Array
    r_u: Array
    r_adm: Array | None
    alpha: float


def simulate_polynomial(spec: Spec, *, executor: Executor | None = None) -> Outcome:
    """The outcome of `solve` with the study of the designed (or given) excitation added.

    Args:
        executor: where the batches of runs are computed (default: in this process).

    Raises:
        SpecError: what cannot be simulated, and all that `solve` raises.
    """
    nominal = build_experiment(spec)
    study = spec.simulation or Simulation()
    outcome = solve(spec)
    started = time.perf_counter()
    result = dict(outcome.result)
    nominal = replace(nominal, samples=int(result["samples"]))
    excitations = _excitations(spec, study, outcome)
    nominal = replace(nominal, samples=_length(excitations[0], nominal, result))
    true = true_experiment(spec, nominal, result)
    promise = _promise(spec, outcome)
    structure = Structure.of(nominal.model)
    differs = study.plant is not None or study.noise is not None
    inputs: dict[str, Any] = {}
    curves: dict[str, Any] = {}
    tables: dict[str, Any] = {}
    for excitation in excitations:
        trials = _run(true, nominal, structure, excitation, study, executor)
        entry = _entry(spec, trials, excitation, promise)
        if differs:
            modelled = _run(nominal, nominal, structure, excitation, study, executor)
            entry["on_design_model"] = _fractions(modelled, promise, excitation)
        inputs[excitation.name] = entry
        curves |= _curves(spec, trials, excitation, promise)
        if spec.closed_loop:
            stem = f"disturbance_{excitation.name}"
            tables[stem], curves[stem] = _disturbance(spec, trials)
    rng = np.random.default_rng(study.seed)
    result["simulation"] = {
        "runs": study.runs,
        "seed": study.seed,
        "samples": true.samples,
        "excitation": study.excitation,
        "true_parameters": dict(zip(true.model.names, true.model.theta.tolist(), strict=True)),
        "true_variance": true.model.variance,
        "wishart_range": list(wishart_range(structure.size, study.runs, rng)) if study.runs > 1 else [],
        "inputs": inputs,
    }
    notes = _notes(spec, inputs)
    if notes:
        result["notes"] = [*result.get("notes", []), *notes]
    result["timing_s"] = {**result["timing_s"], "simulation": time.perf_counter() - started}
    return replace(
        outcome,
        result=result,
        tables={**outcome.tables, **tables},
        curves={**outcome.curves, **curves},
    )


def _run(
    true: Experiment,
    nominal: Experiment,
    structure: Structure,
    excitation: Excitation,
    study: Simulation,
    executor: Executor | None,
) -> Trials:
    job = TrialJob(true, structure, nominal.model.theta, excitation)
    # The same seed for every input: they meet the same noise.
    parts = run_batches(run_job, job, runs=study.runs, size=_BATCH, seed=study.seed, executor=executor)
    return joined(parts)


def _length(excitation: Excitation, nominal: Experiment, result: Mapping[str, Any]) -> int:
    if excitation.record is not None:
        return excitation.record.size
    return int(result.get("signal", {}).get("samples", nominal.samples))


def _excitations(spec: Spec, study: Simulation, outcome: Outcome) -> list[Excitation]:
    """The design, what `compare` names at equal power, and white noise of the power that it would need."""
    result = outcome.result
    spectrum = result["spectrum"]
    table = outcome.tables.get("signal")
    record = None if table is None else list(table.columns.values())[1]
    if record is None:
        raise spec.complain(
            "nothing-to-simulate",
            "no excitation is needed, so that there is no experiment to simulate",
            hint="ask for more accuracy, or give an excitation under spectrum.given",
            key="accuracy",
        )
    if study.excitation == "record" or ("coefficients" not in spectrum and "frequencies" not in spectrum):
        design = Excitation("design", record=record)
    elif "coefficients" in spectrum:
        x = np.asarray(spectrum["coefficients"], dtype=float)
        design = Excitation("design", FirBasis(x.size - 1), x, build_recipe(spec))
    else:
        basis = LinesBasis(np.asarray(spectrum["frequencies"]) * spec.sample_time)
        recipe = replace(build_recipe(spec), method="multisine")
        design = Excitation("design", basis, np.asarray(spectrum["powers"], dtype=float), recipe)
    listed = [design]
    power = np.array([float(np.sum(result["power"]["excitation"]))])
    listed += [Excitation(name, x=power, recipe=Recipe(_METHODS[name])) for name in study.compare]
    needed = result.get("baseline", {}).get("white", {}).get("power", {}).get("excitation")
    if needed and result.get("objective", {}).get("kind") == "least_cost" and "white" in study.compare:
        listed.append(Excitation("white_that_suffices", x=np.array([float(needed[0])])))
    return listed


def _promise(spec: Spec, outcome: Outcome) -> Promise:
    columns = list(outcome.tables["bound"].columns.items())
    table = dict(columns)
    return Promise(
        w=np.asarray(columns[0][1]) * spec.sample_time,
        r_u=np.asarray(table["r_u"]),
        r_adm=None if "r_adm" not in table else np.asarray(table["r_adm"]),
        alpha=float(outcome.result["model_error"]["alpha"]),
    )


def _entry(spec: Spec, trials: Trials, excitation: Excitation, promise: Promise) -> dict[str, Any]:
    cost = build_cost(spec)
    entry: dict[str, Any] = _fractions(trials, promise, excitation)
    entry |= {
        "mean_estimate": dict(zip(trials.structure.names, trials.theta.mean(axis=0).tolist(), strict=True)),
        "cost": sum(weight * trials.power[kind] for kind, weight in cost.items()),
        "power": {kind: [value] for kind, value in trials.power.items()},
        "total_power": {kind: [value] for kind, value in trials.total_power.items()},
        "not_converged": int(np.sum(~trials.converged)),
    }
    information = _theory(trials, excitation)
    if information is not None:
        entry["covariance_eigenvalues"] = whitened_eigenvalues(trials.theta, information)
        deviations = np.sqrt(np.diag(_inverse(information)))
        rms = np.sqrt(np.mean((trials.theta - trials.true.model.theta) ** 2, axis=0))
        entry["rms_over_theory"] = dict(zip(trials.structure.names, (rms / deviations).tolist(), strict=True))
        if promise.r_adm is not None:
            ratio = error_bound(trials.true, information, promise.alpha, promise.w) / promise.r_adm
            entry["theory_on_truth"] = {
                "worst_ratio": float(ratio.max()),
                "frequency": float(promise.w[int(np.argmax(ratio))] / spec.sample_time),
            }
    if promise.r_adm is not None:
        beyond = trials.errors(promise.w) / promise.r_adm
        failed = beyond.max(axis=1) > 1.0
        if np.any(failed):
            where = promise.w[np.argmax(beyond[failed], axis=1)] / spec.sample_time
            entry["violations"] = {
                "runs": int(failed.sum()),
                "frequency_quantiles": np.quantile(where, _QUANTILES),
                "largest_ratio": float(beyond.max()),
            }
    return entry


def _fractions(trials: Trials, promise: Promise, excitation: Excitation) -> dict[str, Any]:
    """Fractions of the runs whose error stays within bounds at all frequencies, with 95 % limits."""
    errors = trials.errors(promise.w)
    runs = len(errors)
    bounds = {} if promise.r_adm is None else {"r_adm": promise.r_adm}
    if excitation.name == "design":
        bounds["promised_r_u"] = promise.r_u
    information = _theory(trials, excitation)
    if information is not None:
        bounds["r_u"] = error_bound(trials.true, information, promise.alpha, promise.w)
    entry: dict[str, Any] = {}
    for name, bound in bounds.items():
        inside = int(np.sum(np.all(errors <= bound, axis=1)))
        entry[f"within_{name}"] = inside / runs
        entry[f"within_{name}_limits"] = list(binomial_limits(inside, runs))
    return entry


def _theory(trials: Trials, excitation: Excitation) -> Array | None:
    return excitation.information(trials.true) if trials.same_structure else None


def _inverse(information: Array) -> Array:
    scale = np.sqrt(np.diag(information))
    return np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale)


def _notes(spec: Spec, inputs: Mapping[str, Any]) -> list[str]:
    """The gap between what the design promises on its own model and what the true system gives."""
    for name, entry in inputs.items():
        modelled = entry.get("on_design_model", {}).get("within_r_adm")
        found = entry.get("within_r_adm")
        if modelled is None or found is None or modelled - found < _GAP:
            continue
        text = (
            f"{name.replace('_', ' ')}: {100 * found:.0f} % of the runs stay within r_adm on the true "
            f"system, but {100 * modelled:.0f} % where the true system is the design model: the experiment "
            "was designed on an initial estimate that is not the truth"
        )
        unit = f"rad/{spec.time_unit}"
        theory = entry.get("theory_on_truth")
        if theory is not None:
            text += (
                f". On the true system r_u reaches {theory['worst_ratio']:.2f} r_adm "
                f"(at {theory['frequency']:.3g} {unit})"
            )
        if "violations" in entry:
            low, middle, high = entry["violations"]["frequency_quantiles"]
            text += f"; 9 in 10 violations lie at {low:.3g} to {high:.3g} {unit}, median {middle:.3g}"
        return [text]
    return []


def _disturbance(spec: Spec, trials: Trials) -> tuple[Table, SignalCurves]:
    """What the excitation of the first run alone does to the loop: r, u_r and y_r, until they have faded."""
    slowest = float(np.abs(trials.true.loop.poles).max(initial=0.0))
    tail = min(int(np.ceil(_FADED / (1.0 - slowest))), trials.first.size)
    r = np.concatenate([trials.first, np.zeros(tail)])
    u_r, y_r = input_and_output(trials.true, r)
    instants = spec.sample_time * np.arange(r.size, dtype=np.float64)
    channels = {"r1": r, "u1_r": u_r, "y1_r": y_r}
    drawn = {"r": r, "ur": u_r, "yr": y_r}
    return Table({f"time_{spec.time_unit}": instants, **channels}), SignalCurves(instants, drawn)


def _curves(
    spec: Spec, trials: Trials, excitation: Excitation, promise: Promise
) -> dict[str, CloudCurves | ErrorBandCurves]:
    errors = trials.errors(promise.w)
    bands = ErrorBandCurves(
        frequency=promise.w / spec.sample_time,
        quantiles={q: np.quantile(errors, q, axis=0) for q in _QUANTILES},
        r_u=promise.r_u if excitation.name == "design" else None,
        r_adm=promise.r_adm,
        name=excitation.name.replace("_", " "),
        runs=len(errors),
    )
    curves: dict[str, CloudCurves | ErrorBandCurves] = {f"errors_{excitation.name}": bands}
    information = _theory(trials, excitation)
    if information is not None and trials.structure.size > 1:
        covariance = _inverse(information)
        last = trials.structure.size - 2
        pairs = sorted({round(i) for i in np.linspace(0, last, _PAIRS)})
        curves[f"cloud_{excitation.name}"] = CloudCurves(
            names=trials.structure.names,
            pairs=tuple((i, i + 1) for i in pairs),
            theta=trials.theta[:_CLOUD],
            centre=trials.true.model.theta,
            covariance=covariance,
        )
    return curves
