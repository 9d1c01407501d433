"""Spec -> Monte Carlo study with several inputs and outputs: does the experiment keep its promise?

Every run draws new phases of the designed sinusoids (scaled to their power exactly) and new noise. With
`simulation.excitation: record` all runs apply the one record that the design delivers.
"""

from __future__ import annotations

import re
import time
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.assemble.channel_analysis import analyse_channels
from inputdesign_cli.assemble.channel_curves import bound_curves_of, entry_bound_curves
from inputdesign_cli.assemble.channel_design import designed_channels
from inputdesign_cli.assemble.channel_requirements import build_entry_errors, unstated_errors
from inputdesign_cli.assemble.channel_task import channel_cost, with_prior
from inputdesign_cli.assemble.channels import channel_experiment, frequency_unit, record_step
from inputdesign_cli.assemble.model_error import model_error_alpha
from inputdesign_cli.assemble.true_system import true_channel_experiment
from inputdesign_cli.design.problem import weights_of
from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.outcome import ChannelErrorBandCurves, ErrorBandCurves, Outcome
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spec import Spec
from inputdesign_cli.spec.realisation import Simulation
from inputdesign_cli.study.batches import run_batches
from inputdesign_cli.study.channel_excitations import (
    ChannelExcitation,
)
from inputdesign_cli.study.channel_inputs import study_excitations
from inputdesign_cli.study.channel_trials import (
    ChannelTrialJob,
    ChannelTrials,
    joined_channels,
    run_channel_job,
)
from inputdesign_cli.study.executor import Executor
from inputdesign_cli.study.statistics import wishart_range
from inputdesign_cli.study.verdict import Promise, cloud, error_bands, fractions, gap_notes, judged

# Runs that are simulated and identified in one pass.
_BATCH = 50


def simulate_channels(spec: Spec, *, executor: Executor | None = None) -> Outcome:
    """The outcome of `solve` with the study of the designed (or given) excitation added.

    Args:
        executor: where the batches of runs are computed (default: in this process).

    Raises:
        SpecError: what cannot be simulated, and all that `solve` raises.
    """
    study = spec.simulation or Simulation()
    outcome, drawer = designed_channels(spec) if spec.designs else (analyse_channels(spec), None)
    started = time.perf_counter()
    result = dict(outcome.result)
    nominal = replace(with_prior(spec, channel_experiment(spec)), samples=int(result["samples"]))
    excitations = study_excitations(spec, study, nominal, outcome, drawer)
    nominal = replace(nominal, samples=int(result["signal"]["samples"]))
    true = true_channel_experiment(spec, nominal, result)
    promise = _promise(spec, nominal, outcome, excitations[0].information(nominal))
    inputs: dict[str, Any] = {}
    curves: dict[str, Any] = {}
    for excitation in excitations:
        name = excitation.name
        trials = _run(spec, true, nominal, excitation, study, executor)
        information = _theory(trials, excitation)
        entry = judged(
            trials, promise, information, name=name, cost=_cost(spec, trials), unit=frequency_unit(spec)
        )
        if true is not nominal:
            modelled = _run(spec, nominal, nominal, excitation, study, executor)
            entry["on_design_model"] = fractions(modelled, promise, _theory(modelled, excitation), name=name)
        inputs[name] = entry
        curves[f"errors_{name}"] = _error_bands(spec, trials, promise, name)
        drawn = cloud(trials, information)
        if drawn is not None:
            curves[f"cloud_{name}"] = drawn
    rng = np.random.default_rng(study.seed)
    size = len(nominal.model.names)
    result["simulation"] = {
        "runs": study.runs,
        "seed": study.seed,
        "samples": true.samples,
        "excitation": study.excitation,
        "true_parameters": dict(zip(true.model.names, true.model.theta.tolist(), strict=True)),
        "true_variance": true.model.covariance,
        "wishart_range": list(wishart_range(size, study.runs, rng)) if study.runs > 1 else [],
        "inputs": inputs,
    }
    notes = gap_notes(spec, inputs)
    if notes:
        result["notes"] = [*result.get("notes", []), *notes]
    result["timing_s"] = {**result["timing_s"], "simulation": time.perf_counter() - started}
    return replace(outcome, result=result, curves={**outcome.curves, **curves})


def _run(
    spec: Spec,
    true: ChannelExperiment,
    nominal: ChannelExperiment,
    excitation: ChannelExcitation,
    study: Simulation,
    executor: Executor | None,
) -> ChannelTrials:
    job = ChannelTrialJob(true, nominal.model, excitation, record_step(spec))
    # The same seed for every input: they meet the same noise.
    parts = run_batches(
        run_channel_job, job, runs=study.runs, size=_BATCH, seed=study.seed, executor=executor
    )
    return joined_channels(parts)


def _theory(trials: ChannelTrials, excitation: ChannelExcitation) -> Array | None:
    return excitation.information(trials.true) if trials.same_structure else None


def _cost(spec: Spec, trials: ChannelTrials) -> float:
    return sum(
        weight * (sum(trials.power[kind]) if channel is None else trials.power[kind][channel])
        for kind, channel, weight in weights_of(channel_cost(spec))
    )


def _promise(spec: Spec, nominal: ChannelExperiment, outcome: Outcome, information: Array) -> Promise:
    """What bound.csv says; where there is none, the r_u that the `information` gives."""
    experiment: Any = nominal
    table = outcome.tables.get("bound")
    if table is None:
        stated = build_entry_errors(spec, experiment)
        table, _ = bound_curves_of(spec, stated, information, None) or entry_bound_curves(
            spec, unstated_errors(spec, experiment), information, None, stated=False
        )
    columns = dict(table.columns)
    w, alpha = (
        np.asarray(next(iter(columns.values()))) * frequency_unit(spec),
        model_error_alpha(spec, experiment),
    )
    if "r_u" in columns:  # of the norm of all entries
        return Promise(w, columns["r_u"], columns.get("r_adm"), alpha)
    places = [name.removeprefix("r_u_") for name in columns if re.fullmatch(r"r_u_\d+", name)]
    stacked = {
        kind: np.concatenate([columns[f"{kind}_{place}"] for place in places])
        for kind in ("r_u", "r_adm")
        if f"{kind}_{places[0]}" in columns
    }
    entries = np.repeat([[int(place[0]) - 1, int(place[1]) - 1] for place in places], w.size, axis=0)
    return Promise(
        w=np.tile(w, len(places)),
        r_u=stacked["r_u"],
        r_adm=stacked.get("r_adm"),
        alpha=alpha,
        entries=entries,
    )


def _error_bands(
    spec: Spec, trials: ChannelTrials, promise: Promise, name: str
) -> ChannelErrorBandCurves | ErrorBandCurves:
    errors = trials.errors(promise)
    if promise.entries is None:
        return error_bands(
            errors,
            frequency=promise.w / frequency_unit(spec),
            r_u=promise.r_u if name == "design" else None,
            r_adm=promise.r_adm,
            name=name,
        )
    panels = {}
    for i, j in np.unique(promise.entries, axis=0):
        own = np.all(promise.entries == (i, j), axis=1)
        panels[f"[{i + 1},{j + 1}]"] = error_bands(
            errors[:, own],
            frequency=promise.w[own] / frequency_unit(spec),
            r_u=promise.r_u[own] if name == "design" else None,
            r_adm=None if promise.r_adm is None else promise.r_adm[own],
            name=name,
        )
    return ChannelErrorBandCurves(panels, name.replace("_", " "))
