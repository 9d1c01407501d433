"""Design -> the record to be applied, and what the result says of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import Criterion, Requirement
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import (
    Record,
    Target,
    input_and_output,
    largest_move,
    realise,
    record_information,
)
from inputdesign_cli.specification import Spec
from inputdesign_cli.spectrum import FirBasis, LinesBasis
from inputdesign_cli.tasks.build.signal_settings import build_bounds, build_signal_settings, operating_points
from inputdesign_cli.tasks.build.task import Task
from inputdesign_cli.tasks.result.result import powers
from inputdesign_cli.tasks.result.signal_files import wav_scale
from inputdesign_cli.tasks.shortest_record import shortest_record

_LAGS = 50


def make_record(spec: Spec, task: Task, design: Design, experiment: Experiment) -> Record | None:
    """The best of several records of the designed spectrum; None when no excitation is needed.

    Best is the least power that meets the requirements by the record itself, or the best criterion.

    Raises:
        InfeasibleError: no record of this length within the limits on single samples meets them.
    """
    if not np.any(design.result.x):
        return None
    problem = design.problem
    basis = design.result.basis
    assert isinstance(basis, FirBasis | LinesBasis)
    if isinstance(basis, FirBasis):
        basis = FirBasis(design.result.x.size - 1)
    length = experiment.samples if problem.goal == "samples" else spec.signal_samples
    recipe = build_signal_settings(spec)
    samples = -(-(spec.signal.samples or length) // recipe.block) * recipe.block
    cost = {kind: float(np.sum(weight)) for kind, weight in problem.cost.items()} or {"excitation": 1.0}
    spent = powers(problem, design.result.basis, design.result.x)
    demand = Target(
        worst_ratio(problem.requirements),
        meets=problem.goal != "factor" and spec.signal.scale != "design",
        cost=cost,
        designed=sum(weight * sum(spent[kind]) for kind, weight in cost.items()),
    )
    bounds = build_bounds(spec, list(task.question.limits))

    def made(samples: int, candidates: int | None = None) -> Record:
        tried = (
            recipe
            if candidates is None
            else replace(recipe, candidates=candidates, most_candidates=candidates)
        )
        return realise(experiment, basis, design.result.x, demand, tried, samples=samples, bounds=bounds)

    record = made(samples)
    if record.met or recipe.level is not None or not (bounds.hard or recipe.quantiser):
        return record
    return shortest_record(spec, design, record, recipe.block, made)


def record_notes(spec: Spec, length: int, record: Record) -> list[str]:
    """What a user should know before applying the record; `length` is that of the experiment."""
    notes = []
    if not record.met:
        notes.append(
            f"the record misses the accuracy: its worst ratio is {record.worst_ratio:.4g}; the limits on the "
            "powers, or the level asked for, leave no room to raise it: a little more power or a few more "
            "samples would do"
        )
    asked = spec.signal.samples or length
    if record.method != "given" and len(record.samples) > asked + build_signal_settings(spec).block:
        notes.append(
            f"within the limits on single samples the accuracy takes {len(record.samples)} samples; the "
            f"spectrum alone would take {asked}"
        )
    return notes


def given_record(
    spec: Spec,
    experiment: Experiment,
    basis: FirBasis | LinesBasis,
    x: Array,
    ratio: Callable[[Array], float],
) -> Record:
    """One record of a spectrum that was given, of its power as far as the limits on samples allow."""
    recipe = replace(build_signal_settings(spec), candidates=1, most_candidates=1)
    return realise(
        experiment,
        basis,
        x,
        Target(ratio),
        recipe,
        samples=spec.signal_samples,
        bounds=build_bounds(spec, []),
    )


def worst_ratio(requirements: Sequence[Requirement]) -> Callable[[Array], float]:
    """The largest ratio of several requirements as a function of the information matrix; 0 for none."""

    def ratio(information: Array) -> float:
        return max((v.ratio for r in requirements for v in r.violations(information)), default=0.0)

    return ratio


def signal_entry(
    spec: Spec,
    experiment: Experiment,
    record: Record,
    requirements: Sequence[Requirement] = (),
    basis: tuple[FirBasis | LinesBasis, Array] | None = None,
) -> dict[str, Any]:
    """What `result.json` says of a record.

    For a criterion it gives the criterion that the record reaches, per as many samples as the experiment
    has; for other requirements their worst ratio. `basis` and coefficients are those of the design.
    """
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
        "input_peak": [float(np.abs(u).max())],
        "input_move": [largest_move(u)],
        "output_peak": [float(np.abs(y).max())],
    }
    if record.method == "multisine":
        entry["phases"] = build_signal_settings(spec).phases
    first = requirements[0] if requirements else None
    if isinstance(first, Criterion):
        per_sample = experiment.samples / samples.size
        entry["criterion"] = first.value(per_sample * first.level(record_information(experiment, samples)))
    elif requirements and np.isfinite(record.worst_ratio):
        entry["worst_ratio"] = record.worst_ratio
    if record.method != "given":
        entry["extra_power"] = record.extra_power
    if basis is not None:
        entry["spectrum_error"] = spectrum_error(*basis, samples)
    entry |= applied_entry(spec, samples, given=record.method == "given")
    if record.factor_residual is not None:
        entry["spectral_factor_residual"] = record.factor_residual
    return entry


def applied_entry(spec: Spec, samples: Array, *, given: bool = False) -> dict[str, Any]:
    """What must be known to read the files of the record as its deviations."""
    entry: dict[str, Any] = {}
    if spec.signal.offset is not None and not given:
        entry["operating_point"] = operating_points(spec).tolist()
    if "wav" in (spec.signal.also or ()):
        entry["wav_full_scale"] = wav_scale(spec, samples, given=given)
    return entry


def spectrum_error(basis: FirBasis | LinesBasis, x: Array, samples: Array) -> float:
    """The largest error of the record's autocorrelations, lags 1 to 50, against those of the design."""
    lags = np.arange(min(_LAGS, samples.size // 4) + 1)
    if isinstance(basis, FirBasis):
        wanted = np.zeros(lags.size)
        kept = min(lags.size, x.size)
        wanted[:kept] = x[:kept]
    else:
        wanted = np.cos(np.outer(lags, basis.frequencies)) @ x
    found = np.array([np.mean(samples[: samples.size - lag] * samples[lag:]) for lag in lags])
    return float(np.abs(found / found[0] - wanted / wanted[0]).max())
