"""Spec -> Monte Carlo study of a polynomial model: does the experiment keep its promise on the true system?

Every run draws a new realisation of the spectrum (scaled to its power exactly) and new noise. With
`simulation.excitation: record` all runs apply the one record that the design delivers.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.assemble import solve
from inputdesign_cli.assemble.experiment import build_cost, build_experiment
from inputdesign_cli.assemble.signal_files import deviations
from inputdesign_cli.assemble.signal_settings import build_recipe
from inputdesign_cli.assemble.true_system import true_experiment
from inputdesign_cli.identification import Structure
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome import ErrorBandCurves, Outcome, SignalCurves, Table
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import Recipe, input_and_output
from inputdesign_cli.signal.recipe import Method
from inputdesign_cli.spec import Spec
from inputdesign_cli.spec.realisation import Simulation
from inputdesign_cli.spectrum import FirBasis, LinesBasis
from inputdesign_cli.study.batches import run_batches
from inputdesign_cli.study.excitations import Excitation
from inputdesign_cli.study.executor import Executor
from inputdesign_cli.study.statistics import wishart_range
from inputdesign_cli.study.trials import TrialJob, Trials, joined, run_job
from inputdesign_cli.study.verdict import Promise, cloud, error_bands, fractions, gap_notes, judged

# Time constants of the loop that a figure shows after the end of the excitation.
_FADED = 3.0
# Inputs to compare with have a flat spectrum; white noise is Gaussian.
_METHODS: dict[str, Method] = {
    "white": "filtered_noise",
    "prbs": "prbs",
    "multisine": "multisine",
    "binary": "binary",
}
# Runs that are simulated and identified in one pass.
_BATCH = 100


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
        name = excitation.name
        trials = _run(true, nominal, structure, excitation, study, executor)
        information = _theory(trials, excitation)
        cost = sum(weight * trials.power[kind][0] for kind, weight in build_cost(spec).items())
        entry = judged(trials, promise, information, name=name, cost=cost, unit=spec.sample_time)
        if differs:
            modelled = _run(nominal, nominal, structure, excitation, study, executor)
            entry["on_design_model"] = fractions(modelled, promise, _theory(modelled, excitation), name=name)
        inputs[name] = entry
        curves[f"errors_{name}"] = _error_bands(spec, trials, excitation, promise)
        drawn = cloud(trials, information)
        if drawn is not None:
            curves[f"cloud_{name}"] = drawn
        if spec.closed_loop:
            tables[f"disturbance_{name}"], curves[f"disturbance_{name}"] = _disturbance(spec, trials)
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
    notes = gap_notes(spec, inputs)
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
    if table is None:
        raise spec.complain(
            "nothing-to-simulate",
            "no excitation is needed, so that there is no experiment to simulate",
            hint="ask for more accuracy, or give an excitation under spectrum.given",
            key="accuracy",
        )
    if study.excitation == "record" or ("coefficients" not in spectrum and "frequencies" not in spectrum):
        design = Excitation("design", record=deviations(spec, table)[:, 0])
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


def _theory(trials: Trials, excitation: Excitation) -> Array | None:
    return excitation.information(trials.true) if trials.same_structure else None


def _error_bands(spec: Spec, trials: Trials, excitation: Excitation, promise: Promise) -> ErrorBandCurves:
    return error_bands(
        trials.errors(promise),
        frequency=promise.w / spec.sample_time,
        r_u=promise.r_u if excitation.name == "design" else None,
        r_adm=promise.r_adm,
        name=excitation.name,
    )
