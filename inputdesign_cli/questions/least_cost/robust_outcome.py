"""The accuracy of a design at the plants that were drawn, at others like them, and at the worst found.

The worst plant of a region is sought by ascent from several starts, as in [frank-wolfe-1956]. A step leads
towards the farthest point of the region in the direction of the gradient. The worst plant is added to the
design until none is found to be missed; that there is no worse one is not proved.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import cycle, islice

import numpy as np

from inputdesign_cli.accuracy import Requirement, model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import Counted, OutOfTimeError, report_progress, seconds_left
from inputdesign_cli.design.convex.demands import Alternative, Question
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.design.convex.scenario_theory import risk_after, risk_before
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.unfinished import fewer_plants, floor_findings, unstable_draws
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.statistics import binomial_limits
from inputdesign_cli.outcome import robust as parts
from inputdesign_cli.outcome.curves import Curves, FanCurves
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.sentences import of_plant
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.bound_curves import axis
from inputdesign_cli.questions.common.robust import (
    CONFIDENCE,
    MET,
    Batch,
    Kept,
    Plants,
    Region,
    Searched,
    delivered,
    delivered_samples,
    estimate_from,
    kept_by,
    tried_on,
)
from inputdesign_cli.questions.least_cost.outcome import Answer, Designed, spent

# Step lengths towards the farthest point, the step of a difference, and the most steps of an ascent.
_LENGTHS, _DIFFERENCE, _STEPS = (1.0, 0.5, 0.25, 0.1, 0.03), 0.01, 15
_GAIN = 1e-5
_STARTS = 3  # beside the plant of the spec
# Plants are added until the worst one is missed by no more than this, and no more than this number.
_NEARLY, _MOST_ADDED = 1.0 + 1e-6, 8


# A plant binds when it is within this share of its limit.
_BINDS = 1e-5
_LISTED = 12
_SAID = 4  # number of parameters in the label of a plant's curve
# Number of estimates that are drawn, and the quantile of their ratios that is reported.
_ESTIMATES, _QUANTILE = 100, 0.95
_GRID_POINTS = 300


def worst_plant(
    region: Region, keeps: Callable[[Alternative], Kept], starts: Sequence[Array]
) -> tuple[Searched, Alternative]:
    """Return the worst plant of the region that ascents find, from `starts` (k,), the worst known first."""
    tried, worst = 0, list[tuple[Array, Alternative, Kept]]()

    def share(z: Array) -> float:
        """Return the largest ratio to the admitted error of the plant at z, 0 where there is none."""
        nonlocal tried, worst
        seconds_left()
        theta = region.theta(z)
        plant = region.at(theta)
        if plant is None:
            return 0.0
        kept, tried = keeps(plant), tried + 1
        if not worst or kept.share > worst[0][2].share:
            worst = [(theta, plant, kept)]
        return kept.share

    def slope(z: Array, axis: int, here: float) -> float:
        """Return the derivative along an axis, by a difference within the region; 0 without a plant."""
        step = np.zeros(z.size)
        step[axis] = -_DIFFERENCE if z[axis] > 0.0 else _DIFFERENCE
        there = share(z + step)
        return (there - here) / step[axis] if there > 0.0 and np.isfinite(there) else 0.0

    def ascend(z: Array) -> None:
        """Take steps as long as they lead to a worse plant."""
        found = share(z)
        for _ in range(_STEPS):
            ahead = np.array([slope(z, axis, found) for axis in range(z.size)])
            if not (np.isfinite(found) and np.any(ahead)):
                return
            target, before = region.farthest(ahead), found
            for length in _LENGTHS:
                step = z + length * (target - z)
                reached = share(step)
                if reached > (1.0 + _GAIN) * before:
                    z, found = step, reached
                    break
            if found == before:
                return

    for theta in starts[: 1 + _STARTS]:
        ascend(region.nearest(theta))
    ((theta, plant, kept),) = worst
    return Searched(region.name, theta, kept, tried, added=0), plant


def with_worst_plants(
    plants: Plants, region: Region, question: Question, first: Answer, solve: Callable[[Question], Answer]
) -> tuple[Plants, Question, Answer]:
    """Return the design for the worst plants of the region too, added until none is found to be missed."""
    answer, added = first, 0
    while True:
        design = answer.design
        samples = delivered_samples(design)
        kept = kept_by(design.problem.on(design.result.basis), design, samples)
        nominal = question.experiment.model.theta
        shares = np.array([one.share for one in kept[1:]])
        thetas = [nominal, *plants.batch.thetas[np.argsort(-shares, kind="stable")]]

        def keeps(plant: Alternative, design: Design = design, samples: int = samples) -> Kept:
            return tried_on(design, samples, [plant])[0]

        found, plant = worst_plant(region, keeps, thetas)
        if found.kept.share <= _NEARLY or added == _MOST_ADDED:
            return replace(plants, searched=replace(found, added=added)), question, answer
        batch, added = plants.batch, added + 1
        thetas_now = np.concatenate([batch.thetas, found.theta[None]])
        plants = replace(plants, batch=Batch(thetas_now, (*batch.plants, plant), batch.drawn + 1))
        question = replace(question, others=[*question.others, plant])
        answer = solve(question)


@dataclass(frozen=True)
class Floor:
    """Compares r_adm of a plant with its floor, which is a `share` of r_adm of the spec.

    It is `raised` to the floor at some frequency. It is `lost` if it vanishes; then `peak` is that of |S|.
    """

    raised: bool
    lost: bool
    peak: float | None
    share: float

    @classmethod
    def at(cls, requirements: Sequence[Requirement]) -> Floor:
        """Return the relation of r_adm of a plant to its floor, from the requirements there."""
        errors = model_errors(requirements)
        floors = [(floor, error.grid) for error in errors if (floor := error.admissible.floored) is not None]
        lost = any(floor.lost(grid) for floor, grid in floors)
        raised = lost or any(floor.raised(grid) for floor, grid in floors)
        loops = [(kept, error.grid) for error in errors if (kept := error.admissible.kept) is not None]
        peak = max((float(np.max(kept.nominal(grid))) for kept, grid in loops), default=None)
        share = max((floor.share for floor, _ in floors), default=0.0)
        return cls(raised, lost, peak if lost else None, share)


@dataclass(frozen=True)
class RobustResult:
    """Holds `robust` of the outcome, with tables and curves by the names of their files, and findings."""

    entry: parts.Robust
    tables: dict[str, Table]
    curves: dict[str, Curves] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()


def robust_result(
    done: Designed, plants: Plants, peak: Callable[[Experiment], float] | None = None
) -> RobustResult:
    """Return the accuracy of a design at its plants.

    The `peak` is the largest share of a limit on single samples that the record uses at a plant; it is None
    if the limits do not depend on plants.
    """
    kept, problem, samples = done.kept, done.problem, done.experiment.samples
    at_each = kept_by(problem, done.design, samples)
    numbers = [0, *(number + 1 for number in kept)]  # of the plants, the nominal one being 0
    # The plants that bind, the largest multipliers first.
    shares, weight = np.array([one.share for one in at_each]), done.design.result.certificate.shares
    taking_part = (weight > _BINDS) | (shares >= 1.0 - _BINDS)
    binding = [place for place in np.lexsort((-shares, -weight)).tolist() if taking_part[place]]
    support = sum(place > 0 for place in binding)
    found = plants_kept(done.header.units, plants, kept, at_each, binding)
    entry, promised = replace(found.entry, support=support), None
    if plants.paid == "worst" and problem.goal == "cost":
        (_, costs), promised = spent(done, problem.basis, done.design.result.x), done.design.result.objective
        dearest = int(np.argmax(costs))
        entry = replace(entry, dearest=parts.DearestPlant(numbers[dearest], costs[dearest]))
    fresh, fewer = fresh_plants(plants, partial(tried_on, done.design, samples), peak, promised)
    if plants.afresh is not None:
        entry = replace(entry, fresh=fresh, estimates=_estimates(done, plants, binding))
        drawn, beta = len(plants.batch.plants), 1.0 - CONFIDENCE
        searched = plants.searched is not None and plants.searched.added
        # Scenario theory does not cover plants that were left out or searched; fresh draws do.
        if len(kept) == drawn and not searched:
            before = None if plants.unknowns is None else risk_before(drawn, beta, plants.unknowns)
            risk = parts.Risk(CONFIDENCE, risk_after(drawn, beta, support), before)
            entry = replace(entry, risk=risk)
    fan = fan_curves(done, numbers, binding, entry.active) if done.excites else None
    tables, curves = ({}, {}) if fan is None else ({"fan": fan[0]}, {"fan": fan[1]})
    return RobustResult(entry, found.tables | tables, {**curves}, (*found.findings, *fewer))


def plants_kept(
    units: Units, plants: Plants, kept: Sequence[int], at_each: Sequence[Kept], binding: Sequence[int]
) -> RobustResult:
    """Return the source of the plants, the number that counts, the worst of them, and scenarios.csv.

    The plant of the spec comes first in `at_each`; `binding` are places there.
    """
    numbers, batch = [0, *(number + 1 for number in kept)], plants.batch
    shares = np.array([one.share for one in at_each])
    worst, floors = int(np.argmax(shares)), [Floor.at(one.asked) for one in at_each[1:]]
    raised = [p for p, one in enumerate(floors) if one.raised]
    floor: parts.FloorUse | None = None
    if raised:  # numbers of plants that are held to the floor, and of plants without an own r_adm
        lost = sorted((p for p in raised if floors[p].lost), key=lambda p: -(floors[p].peak or 0.0))
        listed = (
            parts.LostPlant(numbers[p + 1], _named(plants, batch.thetas[kept[p]]), floors[p].peak)
            for p in lost[:_LISTED]
        )
        held, without = (tuple(numbers[p + 1] for p in places) for places in (raised, sorted(lost)))
        floor = parts.FloorUse(floors[raised[0]].share, held, without, tuple(listed) or None)
    active = (
        parts.ActivePlant(
            numbers[place],
            at_each[place].share,
            _at(units, at_each[place]),
            _named(plants, batch.thetas[numbers[place] - 1]) if place > 0 else None,
        )
        for place in binding[:_LISTED]
    )
    entry = parts.Robust(
        source=plants.source,
        scenarios=len(batch.plants),
        rejected=batch.rejected,
        discarded=len(batch.plants) - len(kept),
        r_adm=plants.r_adm,
        cost=plants.paid,
        worst_share=at_each[worst].share,
        worst_scenario=numbers[worst],
        active=tuple(active),
        floor=floor,
        searched=_searched(units, plants),
    )
    findings = unstable_draws(batch.rejected, len(batch.plants) + batch.rejected)
    findings += floor_findings(floor, len(kept))
    columns: dict[str, Array] = {"scenario": np.array(numbers[1:], dtype=float), "share": shares[1:]}
    where = np.array([_at(units, one) for one in at_each[1:]], dtype=float)
    if not np.any(np.isnan(where)):
        columns[units.frequency_header] = where
    columns |= dict(zip(plants.names, batch.thetas[list(kept)].T, strict=True))
    return RobustResult(entry, {"scenarios": Table(columns)}, findings=tuple(findings))


def _named(plants: Plants, theta: Array) -> dict[str, float]:
    return dict(zip(plants.names, theta.tolist(), strict=True))


def _at(units: Units, kept: Kept) -> float | None:
    return None if kept.frequency is None else kept.frequency / units.frequency


def _searched(units: Units, plants: Plants) -> parts.SearchedPlant | None:
    """Return the worst plant that was found, which is no proof that there is no worse one."""
    found = plants.searched
    if found is None:
        return None
    floor = Floor.at(found.kept.asked)
    return parts.SearchedPlant(
        proved=False,
        region=found.region,
        share=found.kept.share,
        parameters=_named(plants, found.theta),
        added=found.added,
        tried=found.tried,
        frequency=_at(units, found.kept),
        lost=floor.lost or None,
        peak=floor.peak,
    )


def fresh_plants(
    plants: Plants,
    try_on: Callable[[Sequence[Alternative], float], Sequence[Kept]],
    peak: Callable[[Experiment], float] | None = None,
    promised: float | None = None,
) -> tuple[parts.FreshPlants | None, list[Finding]]:
    """Return the share of other plants from the same distribution that are missed, as time allows.

    `try_on` may return 0 for a share up to its second argument; `promised` bounds the cost at every plant.
    """
    if plants.afresh is None:
        return None, []
    shares, costs, peaks, floors = list[float](), list[float](), list[float](), list[Floor]()
    rejected, largest = 0, 0.0
    for batch in plants.afresh():
        try:
            at_each = try_on(batch.plants, min(largest, 1.0))
        except OutOfTimeError:
            break
        peaks += [] if peak is None else [peak(plant.experiment) for plant in batch.plants]
        shares += (one.share for one in at_each)
        costs += (one.cost for one in at_each)
        floors += (Floor.at(one.asked) for one in at_each)
        report_progress(Counted("fresh plants", len(shares), plants.fresh))
        rejected += batch.rejected
        largest = max((share for share in shares if np.isfinite(share)), default=0.0)
    draws = len(shares)
    fewer = fewer_plants(draws, plants.fresh)
    if not shares:
        return None, fewer
    less = np.array(shares) > MET
    dearer = np.array(costs) > (np.inf if promised is None else MET * promised)
    missed = int(np.sum(less | dearer))
    found = parts.FreshPlants(
        draws=draws,
        rejected=rejected,
        missed=missed,
        share=missed / draws,
        limits=binomial_limits(missed, draws),
        largest=largest,
        raised=sum(floor.raised for floor in floors) or None,
        lost=sum(floor.lost for floor in floors) or None,
        beyond_limits=parts.BeyondLimits(sum(one > MET for one in peaks), max(peaks)) if peaks else None,
        less=None if promised is None else int(np.sum(less)),
        dearer=None if promised is None else int(np.sum(dearer)),
    )
    return found, fewer


def _estimates(done: Designed, plants: Plants, binding: Sequence[int]) -> parts.DrawnEstimates | None:
    """Return the ratios to the best accuracy at estimates from data of the plants that bind."""
    worst = [plants.batch.plants[done.kept[place - 1]] for place in binding if place > 0]
    if done.problem.goal != "factor" or plants.at is None or not worst:
        return None
    rng, samples, shares = np.random.default_rng(0), done.experiment.samples, list[float]()
    try:
        for plant in islice(cycle(worst), _ESTIMATES):
            theta = estimate_from(done.design, samples, plant, rng)
            estimated = None if theta is None else plants.at(theta)
            if theta is None or estimated is None:
                shares.append(np.inf)
                continue
            shares += [one.share for one in tried_on(done.design, samples, [estimated])]
    except IdesignError:  # no time is left, or what is asked cannot be asked of this plant
        return None
    highest = float(np.quantile(shares, _QUANTILE, method="higher"))
    return parts.DrawnEstimates(len(shares), _QUANTILE, highest) if np.isfinite(highest) else None


def fan_curves(
    done: Designed, numbers: Sequence[int], active: Sequence[int], listed: Sequence[parts.ActivePlant]
) -> tuple[Table, FanCurves] | None:
    """Return fan.csv and its figure, r_u / r_adm over the plants; None if no model error is bounded."""
    problem, units = done.problem, done.header.units
    bounded = [model_errors((*one.requirements, *one.side)) for one in problem.scenarios]
    if not bounded[0]:
        return None
    peaks = done.design.result.active_frequencies
    grid = np.unique(np.concatenate([error.grid for error in bounded[0]]))
    lo, hi = bounded[0][0].band
    w = axis(lo, hi, np.concatenate([np.clip(peaks, lo, hi), grid[:: max(grid.size // _GRID_POINTS, 1)]]))
    informations = delivered(problem, done.design, done.experiment.samples)
    at_each = zip(bounded, informations, strict=True)
    ratios = np.array([np.max([error.ratios(M, w) for error in errors], axis=0) for errors, M in at_each])
    named = {f"plant {numbers[place]}": ratios[place] for place in active if place > 0}
    frequency = w / units.frequency
    columns = {units.frequency_header: frequency, "nominal": ratios[0], "largest": ratios.max(axis=0)}
    columns |= {name.replace(" ", "_"): values for name, values in named.items()}
    stated = {f"plant {one.scenario}": one.parameters or {} for one in listed}
    drawn = {_with_parameters(name, stated.get(name, {})): values for name, values in named.items()}
    return Table(columns), FanCurves(frequency, ratios[1:], ratios[0], drawn)


def _with_parameters(name: str, parameters: Mapping[str, float]) -> str:
    """Return the name of a plant with its first parameters, as many as a legend has room for."""
    said = of_plant(parameters, 3)
    return ", ".join([name, *said[:_SAID], *[".."] * (len(said) > _SAID)])
