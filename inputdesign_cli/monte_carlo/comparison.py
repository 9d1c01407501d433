"""The inputs of a Monte Carlo study, each tried and judged: what all kinds of models have in common."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from inputdesign_cli.design.convex.problem import Weight, weights_of
from inputdesign_cli.information import PowerKind
from inputdesign_cli.monte_carlo.disturbance import Response, disturbance
from inputdesign_cli.monte_carlo.evaluation import (
    PredictedError,
    Trials,
    cloud,
    error_bands,
    fractions,
    gap_notes,
    judged,
)
from inputdesign_cli.monte_carlo.statistics import wishart_range
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import ErrorBandCurves, Results
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.realisation import Simulation
from inputdesign_cli.tasks.build.channels import frequency_unit


class Applied(Protocol):
    """An excitation of a study: its name, and what it tells of an experiment in theory."""

    @property
    def name(self) -> str: ...

    def information(self, experiment: Any) -> Array:
        """(k, k) in raw parameters, prior information included."""
        ...


@dataclass(frozen=True)
class Comparison:
    """What is tried, and on what.

    Attributes:
        outcome: of the design (or of the analysis of the given excitation).
        nominal, true: the experiment on the design model and on the true system; the same object where
            they do not differ.
        tried: all runs of an excitation on an experiment.
        cost: weights of the powers of an excitation.
        variance: of the noise of the true system, or its covariance (p, p).
        loop: how r drives the true loop; None in open loop.
    """

    spec: Spec
    study: Simulation
    outcome: Results
    nominal: Any
    true: Any
    excitations: Sequence[Any]
    promise: PredictedError
    tried: Callable[[Any, Any], Any]
    cost: Mapping[PowerKind, Weight]
    variance: float | Array
    loop: Response | None = None


def compared(comparison: Comparison, started: float) -> Results:
    """The outcome of the design with the study added.

    Args:
        started: `time.perf_counter()` when the study began.
    """
    spec, study, true, promise = comparison.spec, comparison.study, comparison.true, comparison.promise
    result = dict(comparison.outcome.result)
    inputs: dict[str, Any] = {}
    curves: dict[str, Any] = {}
    tables: dict[str, Any] = {}
    for excitation in comparison.excitations:
        name = excitation.name
        trials = comparison.tried(true, excitation)
        information = _theory(trials, true, excitation)
        entry = judged(
            trials,
            promise,
            information,
            name=name,
            cost=_cost(comparison, trials),
            unit=frequency_unit(spec),
        )
        if true is not comparison.nominal:
            modelled = comparison.tried(comparison.nominal, excitation)
            theory = _theory(modelled, comparison.nominal, excitation)
            entry["on_design_model"] = fractions(modelled, promise, theory, name=name)
        inputs[name] = entry
        curves[f"errors_{name}"] = _error_bands(spec, trials, promise, name)
        drawn = cloud(trials, information)
        if drawn is not None:
            curves[f"cloud_{name}"] = drawn
        if comparison.loop is not None:
            shown = disturbance(spec, comparison.loop, trials.first)
            tables[f"disturbance_{name}"], curves[f"disturbance_{name}"] = shown
    result["simulation"] = {
        "runs": study.runs,
        "seed": study.seed,
        "samples": true.samples,
        "excitation": study.excitation,
        "true_parameters": dict(zip(true.model.names, true.model.theta.tolist(), strict=True)),
        "true_variance": comparison.variance,
        "wishart_range": _wishart(study, len(comparison.nominal.model.names)),
        "inputs": inputs,
    }
    notes = gap_notes(spec, inputs)
    if notes:
        result["notes"] = [*result.get("notes", []), *notes]
    result["timing_s"] = {**result["timing_s"], "simulation": time.perf_counter() - started}
    return replace(
        comparison.outcome,
        result=result,
        tables={**comparison.outcome.tables, **tables},
        curves={**comparison.outcome.curves, **curves},
    )


def _theory(trials: Trials, experiment: Any, excitation: Applied) -> Array | None:
    return excitation.information(experiment) if trials.same_structure else None


def _cost(comparison: Comparison, trials: Trials) -> float:
    return sum(
        weight * (sum(trials.power[kind]) if channel is None else trials.power[kind][channel])
        for kind, channel, weight in weights_of(comparison.cost)
    )


def _wishart(study: Simulation, size: int) -> list[float]:
    return list(wishart_range(size, study.runs, np.random.default_rng(study.seed))) if study.runs > 1 else []


def _error_bands(spec: Spec, trials: Trials, promise: PredictedError, name: str) -> ErrorBandCurves:
    """Of every entry that the promise is about."""
    errors, frequency = trials.errors(promise), promise.w / frequency_unit(spec)
    r_u = promise.r_u if name == "design" else None
    title, runs = name.replace("_", " "), len(errors)
    if promise.entries is None:
        alone = error_bands(errors, frequency=frequency, r_u=r_u, r_adm=promise.r_adm)
        return ErrorBandCurves((alone,), title, runs)
    panels = []
    for i, j in np.unique(promise.entries, axis=0).tolist():
        own = np.all(promise.entries == (i, j), axis=1)
        panels.append(
            error_bands(
                errors[:, own],
                frequency=frequency[own],
                r_u=None if r_u is None else r_u[own],
                r_adm=None if promise.r_adm is None else promise.r_adm[own],
                entry=(i, j),
            )
        )
    return ErrorBandCurves(tuple(panels), title, runs)
