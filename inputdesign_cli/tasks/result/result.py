"""Design -> `result.json`: every number recomputed from the spectrum, bounds from the certificates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import Criterion, EntryOfPlant, NormError, Requirement, worst_violation
from inputdesign_cli.design.convex.candidate import candidate_at
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.design.convex.problem import Problem, weights_of
from inputdesign_cli.information import POWER_KINDS, ChannelExperiment, Experiment, PowerKind
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.specification import Spec
from inputdesign_cli.spectrum import Basis, DirectedLines, FirBasis, LinesBasis, flat_basis
from inputdesign_cli.tasks.build.channels import frequency_unit
from inputdesign_cli.tasks.build.task import Task
from inputdesign_cli.tasks.result.channel_curves import channel_spectrum_entry
from inputdesign_cli.tasks.result.curves import distinct

# A limit binds when the design uses all but this share of it.
_BINDS = 1e-6
# Below this share of its largest price, power at a frequency is called free of charge.
_FREE = 1e-3
_SUPPORT = 1e-3


def design_result(spec: Spec, task: Task, design: Design, how: dict[str, Any]) -> dict[str, Any]:
    """The content of `result.json` but for signal and timing."""
    found, problem = design.result, design.problem
    experiment = experiment_of(task, design)
    status = how.pop("status")
    cost = _cost(task, problem, found.basis, found.x)
    result: dict[str, Any] = {
        "format": 1,
        "title": spec.title,
        "status": status,
        "objective": _objective(spec, design),
        "cost": cost,
        "samples": experiment.samples,
        "power": powers(problem, found.basis, found.x),
        "information": information_entry(experiment, _information(design, experiment)),
        "spectrum": spectrum_entry(spec, found.basis, found.x),
        "baseline": {"white": _white(task, design, cost)},
        "solver": {**how, "tolerance": spec.solver.tolerance},
    }
    if status != "nothing_needed":
        result |= requirements_entry(
            spec, task, (*problem.requirements, *problem.side), found.information, found.active_frequencies
        )
    limits = _limits(spec, task, design)
    if limits:
        result["limits"] = limits
    notes = _notes(spec, design)
    if notes:
        result["notes"] = notes
    return result


def experiment_of(task: Task, design: Design) -> Experiment:
    """The experiment of the design in its coordinates, of the length that it has or that was found."""
    if design.problem.goal != "samples":
        return design.problem.experiment
    return replace(design.problem.experiment, samples=max(int(np.ceil(design.result.s * (1 - 1e-9))), 1))


def information_entry(experiment: Experiment, information: Array) -> dict[str, Any]:
    """The information matrix in raw parameters, its inverse and the predicted standard deviations."""
    entry: dict[str, Any] = {
        "parameters": list(experiment.model.names),
        "matrix": experiment.to_raw(information),
    }
    try:
        covariance = experiment.raw_covariance(information)
    except np.linalg.LinAlgError:  # some parameter is not excited at all
        return entry
    entry["covariance"] = covariance
    entry["standard_deviation"] = dict(
        zip(entry["parameters"], np.sqrt(np.diag(covariance)).tolist(), strict=True)
    )
    return entry


def requirements_entry(
    spec: Spec, task: Task, requirements: tuple[Requirement, ...], information: Array, active: Array
) -> dict[str, Any]:
    """`model_error` of the contract, and the worst ratio of each requirement."""
    listed: list[dict[str, Any]] = []
    entry: dict[str, Any] = {"alpha": task.alpha}
    for requirement in requirements:
        if isinstance(requirement, Criterion):
            continue
        violation = worst_violation(requirement, information)
        item: dict[str, Any] = {"name": requirement.name, "worst_ratio": violation.ratio}
        if violation.frequency is not None:
            item["frequency"] = violation.frequency / frequency_unit(spec)
        listed.append(item)
        if isinstance(requirement, EntryOfPlant):
            item["entry"] = requirement.label
        elif isinstance(requirement, NormError):
            item["norm"] = "frobenius"
        if requirement.name == "model_error" and violation.ratio > entry.get("worst_ratio", 0.0):
            entry["worst_ratio"] = violation.ratio
            if violation.frequency is not None:
                entry["worst_frequency"] = violation.frequency / frequency_unit(spec)
                entry["active_frequencies"] = distinct(active) / frequency_unit(spec)
    return {"model_error": entry, "requirements": listed} if listed else {"model_error": entry}


def spectrum_entry(spec: Spec, basis: Basis, x: Array) -> dict[str, Any]:
    """The designed spectrum: autocovariances, or sinusoids that carry power."""
    if not isinstance(basis, FirBasis | LinesBasis):
        return channel_spectrum_entry(spec, basis, x)
    if isinstance(basis, FirBasis):
        return {"type": "fir" if x.size > 1 else "white", "order": x.size - 1, "coefficients": x}
    frequencies, power = lines_of(basis, x)
    return {
        "type": "free" if basis.free else "multisine",
        "frequencies": frequencies / frequency_unit(spec),
        "powers": power,
    }


def lines_of(basis: LinesBasis, x: Array) -> tuple[Array, Array]:
    """The sinusoids that carry power, in ascending frequency (rad/sample)."""
    order = np.argsort(basis.frequencies)
    kept = order[x[order] > 1e-9 * x.sum()] if x.any() else order[:0]
    return basis.frequencies[kept], x[kept]


def powers(problem: Problem, basis: Basis, x: Array) -> dict[str, list[float]]:
    """The powers of input, output and excitation, one entry a channel."""
    at = problem if basis is problem.basis else replace(problem, basis=basis, finer=None)
    return {
        kind: [at.power(kind, channel).at(x) for channel in _channels(problem.experiment, kind)]
        for kind in POWER_KINDS
    }


def _channels(experiment: Experiment | ChannelExperiment, kind: PowerKind) -> Sequence[int | None]:
    model = experiment.model
    number = model.outputs if kind == "output" else model.inputs
    return [None] if number == 1 else range(number)


def _cost(task: Task, problem: Problem, basis: Basis, x: Array) -> float:
    spent = powers(problem, basis, x)
    total = 0.0
    for kind, channel, weight in weights_of(task.cost):
        total += weight * (sum(spent[kind]) if channel is None else spent[kind][channel])
    return total


def _objective(spec: Spec, design: Design) -> dict[str, Any]:
    found, anything = design.result, design.any_spectrum
    value, bound, any_bound = found.objective, found.certificate.bound, anything.certificate.bound
    first = design.problem.requirements[0] if design.problem.requirements else None
    if design.problem.goal == "factor" and isinstance(first, Criterion):
        # s is the inverse of the level, so that its lower bound is an upper bound of the criterion.
        reached, best = first.value(1.0 / value), first.value(1.0 / max(bound, 1e-300))
        size = design.problem.experiment.size if first.letter == "D" else abs(reached)
        return {
            "kind": first.letter,
            "value": reached,
            "upper_bound": best,
            "relative_gap": abs(best - reached) / size,
            "any_spectrum_bound": first.value(1.0 / max(any_bound, 1e-300)),
        }
    kind = {"cost": "least_cost", "samples": "shortest_experiment", "factor": "accuracy_factor"}
    if design.problem.goal == "factor":
        value, bound, any_bound = (float(np.sqrt(v)) for v in (value, bound, any_bound))
    return {
        "kind": kind[design.problem.goal],
        "value": value,
        "lower_bound": bound,
        "relative_gap": abs(value - bound) / value if value > 0 else 0.0,
        "any_spectrum_bound": any_bound,
    }


def _information(design: Design, experiment: Experiment) -> Array:
    """M of the delivered spectrum over the delivered number of samples."""
    if design.problem.goal != "samples":
        return design.result.information
    problem, found = design.problem, design.result
    at = problem if found.basis is problem.basis else replace(problem, basis=found.basis, finer=None)
    return candidate_at(at, experiment.samples * found.x, float(experiment.samples)).information


def _white(task: Task, design: Design, cost: float) -> dict[str, Any]:
    """Flat excitation that meets the same requirements, or exhausts the same limits."""
    basis = flat_basis(design.problem.experiment)
    x = np.array([design.white_power])
    white_cost = _cost(task, design.problem, basis, x)
    entry: dict[str, Any] = {
        "cost": white_cost,
        "power": powers(design.problem, basis, x),
        "ratio": white_cost / cost if cost > 0 else 1.0,
    }
    first = design.problem.requirements[0] if design.problem.requirements else None
    if design.problem.goal == "samples":
        entry["samples"] = int(np.ceil(design.white.s * (1 - 1e-9)))
    elif isinstance(first, Criterion):
        entry["value"] = first.value(1.0 / design.white.objective)
    elif design.problem.goal == "factor":
        entry["value"] = float(np.sqrt(design.white.objective))
    if task.question.limits or task.question.densities:
        entry["within_limits"] = design.white_within
    return entry


def _limits(spec: Spec, task: Task, design: Design) -> list[dict[str, Any]]:
    """Each power limit with what the design uses of it."""
    found, problem = design.result, design.problem
    at = problem if found.basis is problem.basis else replace(problem, basis=found.basis, finer=None)
    entries: list[dict[str, Any]] = []
    for limit in task.question.limits:
        value = at.power(limit.kind, limit.channel).at(found.x)
        slack = (limit.bound - value) if limit.upper else (value - limit.bound)
        entry: dict[str, Any] = {"name": f"{limit.kind}_power"}
        if limit.channel is not None:
            entry["channel"] = limit.channel + 1
        entry |= {
            "max" if limit.upper else "min": limit.bound,
            "value": value,
            "binding": slack <= _BINDS * limit.bound,
        }
        entries.append(entry)
    for index, density in enumerate(task.question.densities):
        breaches = [b for b in at.density_breaches(found.x, 1.0, above=-np.inf) if b.place.limit == index]
        tightest = max(breaches, key=lambda b: b.ratio)
        entries.append(
            {
                "name": "spectrum",
                "kind": "max" if density.upper else "min",
                "worst_ratio": tightest.ratio,
                "frequency": tightest.place.frequency / frequency_unit(spec),
                "binding": tightest.ratio >= 1.0 - _BINDS,
            }
        )
    return entries


def _notes(spec: Spec, design: Design) -> list[str]:
    """What a user should know before trusting a number."""
    found, problem = design.result, design.problem
    notes = []
    if not found.x.any():
        sources = ["the noise in normal operation"] if spec.closed_loop else []
        sources += ["experiment.prior"] if spec.experiment.prior is not None else []
        known = " and ".join(sources) or "the noise"
        notes.append(f"no excitation is needed: what {known} tells of the parameters meets the accuracy")
    if spec.closed_loop and isinstance(found.basis, LinesBasis | DirectedLines) and found.x.any():
        frequencies, power = found.basis.frequencies, found.x
        price = found.basis.integrals(problem.price.density, problem.experiment.singularities)
        dearest = np.abs(problem.price.density(problem.grid)).max()
        cheap = (price < _FREE * dearest) & (power > _SUPPORT * power.sum())
        if np.any(cheap):
            at = float(frequencies[cheap].max()) / frequency_unit(spec)
            near_zero = at < 1e-6 * np.pi / frequency_unit(spec)
            where = "near frequency zero" if near_zero else f"below {at:.3g} rad/{spec.time_unit}"
            notes.append(
                f"power {where} is almost free of charge in this loop (integral "
                "action), so that the excitation power of the optimum is ill defined: give "
                "cost.excitation_power a small weight, or limit it"
            )
    return notes
