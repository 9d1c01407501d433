"""Design -> `result.json`: every number recomputed from the spectrum, bounds from the certificates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inputdesign_cli.accuracy import Criterion, OnModelError, Requirement, model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.candidate import candidate_at
from inputdesign_cli.design.convex.cost import Weight, paid_for, weighted_sum
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.information import POWER_KINDS, Experiment, PowerKind
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.questions.common.confidence import Confidence
from inputdesign_cli.questions.common.robust import Plants
from inputdesign_cli.questions.common.spectrum import distinct, spectrum_entry
from inputdesign_cli.spectrum import Basis, flat_basis

# A limit binds when the design uses all but this share of it.
_ROUNDING = 1e-9
_BINDS = 1e-6
# Below this share of its largest price, power at a frequency is called free of charge.
_FREE = 1e-3
_SUPPORT = 1e-3
# An input with less than this share of the power has none.
_NOTHING = 1e-9
# Time constants that an experiment has at least, for its spectrum to tell what it reaches.
_SETTLED = 2.0
_KINDS = {"cost": "least_cost", "samples": "shortest_experiment", "factor": "accuracy_factor"}


@dataclass(frozen=True)
class Designed:
    """A design with what it answers and the experiment of the delivered length.

    `kept` are the numbers of the `plants` that the design is for, without those that it leaves out.
    """

    header: Header
    question: Question
    design: Design
    experiment: Experiment
    cost: dict[PowerKind, Weight]
    confidence: Confidence
    kept: Sequence[int] = ()
    plants: Plants | None = None

    @property
    def units(self) -> Units:
        """Those of the header."""
        return self.header.units

    @property
    def problem(self) -> Problem:
        """The problem on the basis of the answer, which may have grown."""
        return self.design.problem.on(self.design.result.basis)

    @cached_property
    def information(self) -> Array:
        """(k, k): M of the delivered spectrum over the delivered number of samples."""
        if self.design.problem.goal != "samples":
            return self.design.result.information
        samples = float(self.experiment.samples)
        return candidate_at(self.problem, samples * self.design.result.x, samples).informations[0]


def design_result(done: Designed, how: dict[str, Json], tolerance: float) -> dict[str, Json]:
    """The content of `result.json` but for signal and timing.

    Args:
        how: the status, and what the solver did.
    """
    found, problem = done.design.result, done.design.problem
    status = how.pop("status")
    cost = _cost(done, found.basis, found.x)
    result: dict[str, Json] = {
        "format": 1,
        "title": done.header.title,
        "status": status,
        "objective": _objective(done.design),
        "cost": cost,
        "samples": done.experiment.samples,
        "power": powers(problem, found.basis, found.x),
        "information": information_entry(done.experiment, done.information),
        "spectrum": spectrum_entry(done.units, found.basis, found.x),
        "baseline": {"white": _white(done, cost)},
        "solver": {**how, "tolerance": tolerance},
    }
    if status != "nothing_needed":
        asked = (*problem.requirements, *problem.side)
        active = found.active_frequencies
        result |= requirements_entry(done.units, done.confidence, asked, done.information, active)
    for name, entry in (("limits", _limits(done)), ("notes", _notes(done))):
        if entry:
            result[name] = entry
    return result


def information_entry(experiment: Experiment, information: Array) -> dict[str, Json]:
    """The information matrix in raw parameters, its inverse and the predicted standard deviations."""
    entry: dict[str, Json] = {
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
    units: Units,
    confidence: Confidence,
    requirements: Sequence[Requirement],
    information: Array,
    active: Array,
) -> dict[str, Json]:
    """`model_error` of the contract, and the worst ratio of each requirement."""
    listed: list[dict[str, Json]] = []
    entry: dict[str, Json] = {"alpha": confidence.alpha, **confidence.entry}
    for requirement in requirements:
        if isinstance(requirement, Criterion):
            continue
        item = requirement_entry(units, requirement, information)
        listed.append(item)
        if isinstance(requirement, OnModelError) and item["worst_ratio"] > entry.get("worst_ratio", 0.0):
            entry["worst_ratio"] = item["worst_ratio"]
            if "frequency" in item:
                entry["worst_frequency"] = item["frequency"]
                entry["active_frequencies"] = distinct(active, requirement.band[1]) / units.frequency
    return {"model_error": entry, "requirements": listed} if listed else {"model_error": entry}


def requirement_entry(units: Units, requirement: Requirement, information: Array) -> dict[str, Json]:
    """A requirement with its worst ratio, and where that is."""
    violation = requirement.worst(information)
    item: dict[str, Json] = {"name": requirement.name, "worst_ratio": violation.ratio}
    if violation.frequency is not None:
        item["frequency"] = violation.frequency / units.frequency
    if requirement.entry is not None and not units.single:
        item["entry"] = units.entry(*requirement.entry)
    elif requirement.of_the_norm:
        item["norm"] = "frobenius"
    for error in model_errors([requirement]):
        kept = error.admissible.kept
        if kept is not None and kept.settings is not None:
            item["loop"] = {**kept.settings, **kept.margins(error.grid)}
    return item


def powers(problem: Problem, basis: Basis, x: Array, scenario: int = 0) -> dict[PowerKind, list[float]]:
    """The powers of input, output and excitation at a plant, one entry a channel."""
    at, model = problem.on(basis), problem.experiment.model
    channels = {"input": model.inputs, "output": model.outputs, "excitation": model.inputs}
    # A channel without power may come out below zero by rounding.
    return {
        kind: [max(at.power(kind, c, scenario).at(x), 0.0) for c in range(channels[kind])]
        for kind in POWER_KINDS
    }


def _cost(done: Designed, basis: Basis, x: Array) -> float:
    """At the nominal plant, the mean over all plants or that of the dearest, as they are paid."""
    return paid_for(done.design.problem.paid, costs_of(done, basis, x))


def costs_of(done: Designed, basis: Basis, x: Array) -> list[float]:
    """What a spectrum costs at each plant that is paid for."""
    problem = done.design.problem
    return [weighted_sum(done.cost, powers(problem, basis, x, scenario)) for scenario in problem.paying]


def _objective(design: Design) -> dict[str, Json]:
    """The value with its bounds; those of which nothing is proved yet are left out."""
    found, anything = design.result, design.any_spectrum
    value, bound = found.objective, found.certificate.bound
    any_bound = 0.0 if anything is None else anything.certificate.bound
    proved, proved_of_any = (b > 0.0 or value == 0.0 for b in (bound, any_bound))
    criterion, goal = design.problem.demands.criterion, design.problem.goal
    entry: dict[str, Json]
    if goal == "factor" and criterion is not None:
        # s is the inverse of the level, so that its lower bound is an upper bound of the criterion.
        reached = criterion.value(1.0 / value)
        entry = {"kind": criterion.letter, "value": reached}
        if proved:
            best = criterion.value(1.0 / max(bound, 1e-300))
            size = design.problem.experiment.size if criterion.letter == "D" else abs(reached)
            entry |= {"upper_bound": best, "relative_gap": abs(best - reached) / size}
        if proved_of_any:
            entry["any_spectrum_bound"] = criterion.value(1.0 / max(any_bound, 1e-300))
        return entry
    if goal == "factor":
        value, bound, any_bound = (float(np.sqrt(v)) for v in (value, bound, any_bound))
    entry = {"kind": _KINDS[goal], "value": value, "lower_bound": bound}
    entry["relative_gap"] = abs(value - bound) / value if value > 0 else 0.0
    if proved_of_any:
        entry["any_spectrum_bound"] = any_bound
    return entry


def _white(done: Designed, cost: float) -> dict[str, Json]:
    """Flat excitation that meets the same requirements, or exhausts the same limits."""
    design, problem = done.design, done.design.problem
    basis, x = flat_basis(problem.experiment), np.array([design.white_power])
    white_cost = _cost(done, basis, x)
    entry: dict[str, Json] = {
        "cost": white_cost,
        "power": powers(problem, basis, x),
        "ratio": white_cost / cost if cost > 0 else 1.0,
    }
    if problem.goal == "samples":
        entry["samples"] = int(np.ceil(design.white.s * (1 - 1e-9)))
    elif problem.demands.criterion is not None:
        entry["value"] = problem.demands.criterion.value(1.0 / design.white.objective)
    elif problem.goal == "factor":
        entry["value"] = float(np.sqrt(design.white.objective))
    if done.question.limits or done.question.densities:
        entry["within_limits"] = design.white_within
    return entry


def _limits(done: Designed) -> list[dict[str, Json]]:
    """Each power limit with what the design uses of it, and the tightest place of density limits."""
    x, at = done.design.result.x, done.problem
    entries: list[dict[str, Json]] = []
    for limit in done.question.limits:
        # Where the plant takes part in the power, the one of all scenarios that comes nearest to the limit.
        alike = [at.limits[index].scenario for index in limit.everywhere(at.limits)]
        values = [at.power(limit.kind, limit.channel, scenario).at(x) for scenario in alike]
        value = max(values) if limit.upper else min(values)
        slack = (limit.bound - value) if limit.upper else (value - limit.bound)
        entry: dict[str, Json] = {"name": limit.key.removeprefix("limits.")}
        if limit.channel is not None:
            entry["channel"] = limit.channel + 1
        entry |= {
            "max" if limit.upper else "min": limit.bound,
            "value": value,
            "binding": slack <= _BINDS * limit.bound,
        }
        entries.append(entry)
    for index, density in enumerate(done.question.densities):
        breaches = [b for b in at.density_breaches(x, 1.0, above=-np.inf) if b.place.limit == index]
        tightest = max(breaches, key=lambda b: b.ratio)
        entries.append(
            {
                "name": "spectrum",
                "kind": "max" if density.upper else "min",
                "worst_ratio": tightest.ratio,
                "frequency": tightest.place.frequency / done.units.frequency,
                "binding": tightest.ratio >= 1.0 - _BINDS,
            }
        )
    return entries


def _notes(done: Designed) -> list[str]:
    """What a user should know before trusting a number."""
    found, units, experiment = done.design.result, done.units, done.experiment
    if not found.x.any():
        sources = ["the noise in normal operation"] if units.closed_loop else []
        sources += ["experiment.prior"] if experiment.prior is not None else []
        known = " and ".join(sources) or "the noise"
        kept = " at every plant that is not left out" if done.kept else ""
        return [f"no excitation is needed: what {known} tells of the parameters meets the accuracy{kept}"]
    notes = _left_out(done) + _too_short(experiment) + _as_large_as_the_plant(done)
    if units.closed_loop and not found.basis.has_density:
        notes += _free_of_charge(done)
    return notes


def _as_large_as_the_plant(done: Designed) -> list[str]:
    """Requirements that leave even the sign of G open."""
    notes = []
    for requirement in model_errors(done.problem.requirements):
        size, admitted = (
            requirement.nominal_size(requirement.grid),
            requirement.admissible.at(requirement.grid),
        )
        acts = size > 0.0
        least = float(np.min(admitted[acts] / size[acts], initial=np.inf))
        if 1.0 - _ROUNDING <= least < np.inf:
            notes.append(
                f"the admissible error is {least:.4g} times |G| or more at every frequency of its band: a "
                "model that meets it may have the wrong sign (relative: 0.1 means 10 %)"
            )
    return list(dict.fromkeys(notes))


def _too_short(experiment: Experiment) -> list[str]:
    """Whether the experiment ends before its slowest mode has settled; without a length nothing is said."""
    if experiment.model.continuous or experiment.samples == 1:
        return []
    damping = np.abs(experiment.singularities.imag)
    slowest = float(np.min(damping[damping > 0.0], initial=np.inf))
    if slowest * experiment.samples >= _SETTLED:
        return []
    return [
        f"the slowest mode has a time constant of {1.0 / slowest:.2g} samples, the experiment "
        f"{experiment.samples}: spectra tell what long records reach; believe what the record reaches by its "
        "own samples, and idesign simulate"
    ]


def _left_out(done: Designed) -> list[str]:
    """The inputs that a T-optimal design leaves without power: trace M may be largest without them."""
    excited = powers(done.design.problem, done.design.result.basis, done.design.result.x)["excitation"]
    return [
        f"input {channel + 1} gets no power, so that nothing is learnt about what it alone drives: T adds up "
        "what is learnt; criterion D, A or E asks for every parameter"
        for channel, power in enumerate(excited)
        if power <= _NOTHING * sum(excited)
    ]


def _free_of_charge(done: Designed) -> list[str]:
    """Whether sinusoids of the design lie where power costs next to nothing."""
    units, problem = done.units, done.problem
    lines, matrices = done.design.result.basis.lines(done.design.result.x)
    power = np.einsum("naa->n", matrices).real
    costs, all_costs = (_unit_price(problem.price.density(w)) for w in (lines, problem.gradients.grid))
    cheap = (costs < _FREE * all_costs.max()) & (power > _SUPPORT * power.sum())
    if not np.any(cheap):
        return []
    at = float(lines[cheap].max()) / units.frequency
    near_zero = at < 1e-6 * np.pi / units.frequency
    where = "near frequency zero" if near_zero else f"below {at:.3g} {units.per_time}"
    return [
        f"power {where} is almost free of charge in this loop (integral action), so that the excitation "
        "power of the optimum is ill defined: give cost.excitation_power a small weight, or limit it"
    ]


def _unit_price(density: Array) -> Array:
    """The price (n,) of power one, even over the channels."""
    return density if density.ndim == 1 else np.einsum("naa->n", density).real / density.shape[1]
