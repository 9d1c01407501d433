"""`robust` of the outcome: what the design keeps at the plants that were drawn, and at others like them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import cycle, islice

import numpy as np

from inputdesign_cli.accuracy import OnModelError, model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.compute.watching import Counted, tell
from inputdesign_cli.design.convex.scenario_theory import risk_after, risk_before
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.unfinished import fewer_plants, floor_findings, unstable_draws
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.statistics import binomial_limits
from inputdesign_cli.outcome import Robust
from inputdesign_cli.outcome.curves import Curves, FanCurves
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.robust import (
    ActivePlant,
    BeyondLimits,
    DearestPlant,
    DrawnEstimates,
    FreshPlants,
    Risk,
    SearchedPlant,
)
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.robust import (
    CONFIDENCE,
    MET,
    Batch,
    Kept,
    Plants,
    Tried,
    delivered,
    estimate_from,
    kept_by,
    tried_on,
)
from inputdesign_cli.questions.common.spectrum import axis
from inputdesign_cli.questions.least_cost.floor import Floor, floor_at, floor_of, floor_use
from inputdesign_cli.questions.least_cost.outcome import Designed, costs_of

# A plant binds when it is within this share of its limit.
_BINDS = 1e-5
_LISTED = 12
# Estimates that are foreseen, and the share of them that counts.
_ESTIMATES, _MOST_OF_THEM = 100, 0.95
_GRID_POINTS = 300


@dataclass(frozen=True)
class RobustResult:
    """`robust` of the outcome, with its tables and curves by the names of their files, and findings."""

    entry: Robust
    tables: dict[str, Table]
    curves: dict[str, Curves] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()


Peak = Callable[[Experiment], float]
"""The largest share of a limit on single samples that the record uses at a plant."""


def robust_result(done: Designed, plants: Plants, peak: Peak | None = None) -> RobustResult:
    """Return what a design keeps at the plants that it is for.

    Args:
        peak: None if no limit on single samples depends on the plant.
    """
    kept, units = done.kept, done.units
    at_each = kept_by(done.problem, done.design, done.experiment.samples)
    numbers = [0, *(number + 1 for number in kept)]  # of the plants, the nominal one being 0
    binding = _binding(done, np.array([one.share for one in at_each]))
    support = sum(place > 0 for place in binding)
    floors = [floor_at((*one.requirements, *one.side)) for one in done.problem.scenarios[1:]]
    found = plants_kept(units, plants, kept, at_each, binding, floors)
    entry = replace(found.entry, support=support)
    dearest_counts = plants.paid == "worst" and done.problem.goal == "cost"
    if dearest_counts:
        costs = costs_of(done, done.design.result.basis, done.design.result.x)
        dearest = int(np.argmax(costs))
        entry = replace(entry, dearest=DearestPlant(numbers[dearest], costs[dearest]))
    if plants.afresh is not None:
        entry = replace(entry, risk=_risk(plants, support, len(kept)))
        promised = done.design.result.objective if dearest_counts else None
        tried = partial(tried_on, done.design, done.experiment.samples)
        fresh = fresh_plants(plants, plants.afresh(), tried, peak, promised)
        entry = replace(entry, fresh=fresh, estimates=_estimates(done, plants, binding))
    fan = fan_curves(done, numbers, binding) if done.excites else None
    return RobustResult(
        entry,
        found.tables if fan is None else found.tables | {"fan": fan[0]},
        {} if fan is None else {"fan": fan[1]},
        (*found.findings, *fresh_findings(plants, entry.fresh)),
    )


def plants_kept(
    units: Units,
    plants: Plants,
    kept: Sequence[int],
    at_each: Sequence[Kept],
    binding: Sequence[int],
    floors: Sequence[Floor],
) -> RobustResult:
    """Return where the plants come from, how many count, the worst of them, and scenarios.csv.

    Args:
        kept: the numbers of the plants that count.
        at_each: what these keep, the plant of the spec first.
        binding: places among them.
        floors: of the plants that count.
    """
    numbers = [0, *(number + 1 for number in kept)]
    worst = int(np.argmax([one.share for one in at_each]))
    floor = floor_use(floors, numbers[1:], plants.names, plants.batch.thetas[list(kept)])
    batch = plants.batch
    entry = Robust(
        source=plants.source,
        scenarios=len(batch.plants),
        rejected=batch.rejected,
        discarded=len(batch.plants) - len(kept),
        r_adm=plants.r_adm,
        cost=plants.paid,
        worst_share=at_each[worst].share,
        worst_scenario=numbers[worst],
        active=tuple(_active(units, plants, numbers[place], at_each[place]) for place in binding[:_LISTED]),
        floor=floor,
        searched=_searched(units, plants),
    )
    findings = unstable_draws(batch.rejected, len(batch.plants) + batch.rejected)
    findings += floor_findings(floor, len(kept))
    table = _scenario_table(units, plants, numbers, at_each)
    return RobustResult(entry, {"scenarios": table}, findings=tuple(findings))


def _binding(done: Designed, shares: Array) -> list[int]:
    """Return the plants that bind, the largest multipliers first."""
    weight = done.design.result.certificate.shares
    order = np.lexsort((-shares, -weight))
    taking_part = (weight > _BINDS) | (shares >= 1.0 - _BINDS)
    return [place for place in order.tolist() if taking_part[place]]


def _named(plants: Plants, theta: Array) -> dict[str, float]:
    return dict(zip(plants.names, theta.tolist(), strict=True))


def _at(units: Units, kept: Kept) -> float | None:
    return None if kept.frequency is None else kept.frequency / units.frequency


def _active(units: Units, plants: Plants, number: int, kept: Kept) -> ActivePlant:
    named = _named(plants, plants.batch.thetas[number - 1]) if number > 0 else None
    return ActivePlant(number, kept.share, _at(units, kept), named)


def _searched(units: Units, plants: Plants) -> SearchedPlant | None:
    """Return the worst plant that was found, which is no proof that there is no worse one."""
    found = plants.searched
    if found is None:
        return None
    plant = None if plants.at is None else plants.at(found.theta)
    floor = None if plant is None else floor_of(plant)
    lost = floor is not None and floor.lost
    return SearchedPlant(
        proved=False,
        region=found.region,
        share=found.kept.share,
        parameters=_named(plants, found.theta),
        added=found.added,
        tried=found.tried,
        frequency=_at(units, found.kept),
        lost=lost or None,
        peak=floor.peak if lost and floor is not None else None,
    )


def _risk(plants: Plants, support: int, kept: int) -> Risk | None:
    """Return shares of plants that may be missed.

    If some were left out, or searched, the theory is silent, and fresh draws count.
    """
    drawn = len(plants.batch.plants)
    if kept < drawn or (plants.searched is not None and plants.searched.added):
        return None
    beta = 1.0 - CONFIDENCE
    before = None if plants.unknowns is None else risk_before(drawn, beta, plants.unknowns)
    return Risk(CONFIDENCE, risk_after(drawn, beta, support), before)


def fresh_plants(
    plants: Plants,
    afresh: Iterator[Batch],
    try_on: Callable[[Batch, float], Sequence[Tried]],
    peak: Peak | None = None,
    promised: float | None = None,
) -> FreshPlants | None:
    """Return how many of other plants from the same distribution are missed; None if there is no time.

    Args:
        plants: that count.
        afresh: the others; as many are tried as there is time for.
        try_on: what they keep; a share up to the number may be returned as 0.
        peak: see `robust_result`.
        promised: the cost that a design promises at every plant.
    """
    tried, peaks, rejected, largest, floors = list[Kept](), list[float](), 0, 0.0, list[Floor]()
    for batch in afresh:
        try:
            at_each = try_on(batch, min(largest, 1.0))
        except OutOfTimeError:
            break
        peaks += [] if peak is None else [peak(plant.experiment) for plant in batch.plants]
        tried += (one.kept for one in at_each)
        floors += (floor_at(one.asked) for one in at_each)
        tell(Counted("fresh plants", len(tried), plants.fresh))
        rejected += batch.rejected
        largest = max((one.share for one in tried if np.isfinite(one.share)), default=0.0)
    if not tried:
        return None
    less = np.array([one.share for one in tried]) > MET
    dearer = np.array([promised is not None and one.cost > MET * promised for one in tried])
    missed = int(np.sum(less | dearer))
    return FreshPlants(
        draws=len(tried),
        rejected=rejected,
        missed=missed,
        share=missed / len(tried),
        limits=binomial_limits(missed, len(tried)),
        largest=largest,
        raised=sum(floor.raised for floor in floors) or None,
        lost=sum(floor.lost for floor in floors) or None,
        beyond_limits=BeyondLimits(sum(one > MET for one in peaks), max(peaks)) if peaks else None,
        less=None if promised is None else int(np.sum(less)),
        dearer=None if promised is None else int(np.sum(dearer)),
    )


def fresh_findings(plants: Plants, fresh: FreshPlants | None) -> list[Finding]:
    """Return a finding if fewer fresh plants were tried than were asked for."""
    return [] if plants.afresh is None else fewer_plants(0 if fresh is None else fresh.draws, plants.fresh)


def _estimates(done: Designed, plants: Plants, binding: Sequence[int]) -> DrawnEstimates | None:
    """Return how near the best accuracy comes to being missed at estimates of the plants that bind.

    Data are judged at their estimate, so that some are drawn.

    Args:
        binding: places among the plants that are kept, the plant of the spec being 0.
    """
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
            tried = tried_on(done.design, samples, Batch(theta[None], (estimated,), 1))
            shares += [one.kept.share for one in tried]
    except IdesignError:  # no time is left, or what is asked cannot be asked of this plant
        return None
    highest = float(np.quantile(shares, _MOST_OF_THEM, method="higher"))
    return DrawnEstimates(len(shares), _MOST_OF_THEM, highest) if np.isfinite(highest) else None


def _scenario_table(units: Units, plants: Plants, numbers: Sequence[int], at_each: Sequence[Kept]) -> Table:
    """Return scenarios.csv: the plants that count, with their parameters."""
    listed = [place for place, number in enumerate(numbers) if number > 0]
    columns: dict[str, Array] = {
        "scenario": np.array([numbers[place] for place in listed], dtype=float),
        "share": np.array([at_each[place].share for place in listed]),
    }
    where = np.array([_at(units, at_each[place]) for place in listed], dtype=float)
    if not np.any(np.isnan(where)):
        columns[units.frequency_header] = where
    chosen = plants.batch.thetas[[numbers[place] - 1 for place in listed]]
    return Table(columns | dict(zip(plants.names, chosen.T, strict=True)))


def fan_curves(
    done: Designed, numbers: Sequence[int], active: Sequence[int]
) -> tuple[Table, FanCurves] | None:
    """Return fan.csv and its figure: r_u / r_adm at the plant of the spec, the largest, and at active ones.

    None if no model error is bounded.

    Args:
        numbers: what the scenarios are called, in their order; the plant of the spec is 0.
        active: the places of binding plants, in that order.
    """
    problem, units = done.problem, done.units
    bounded = [model_errors((*one.requirements, *one.side)) for one in problem.scenarios]
    if not bounded[0]:
        return None
    peaks = done.design.result.active_frequencies
    grid = np.unique(np.concatenate([error.grid for error in bounded[0]]))
    lo, hi = bounded[0][0].band
    w = axis(lo, hi, np.concatenate([np.clip(peaks, lo, hi), grid[:: max(grid.size // _GRID_POINTS, 1)]]))
    informations = delivered(problem, done.design, done.experiment.samples)
    ratios = np.array([_largest(errors, M, w) for errors, M in zip(bounded, informations, strict=True)])
    named = {f"plant {numbers[place]}": ratios[place] for place in active if place > 0}
    frequency = w / units.frequency
    columns = {units.frequency_header: frequency, "nominal": ratios[0], "largest": ratios.max(axis=0)}
    columns |= {name.replace(" ", "_"): values for name, values in named.items()}
    return Table(columns), FanCurves(frequency, ratios[1:], ratios[0], named)


def _largest(errors: Sequence[OnModelError], information: Array, w: Array) -> Array:
    """Return (n,): the largest ratio of several entries of G."""
    return np.max([error.ratios(information, w) for error in errors], axis=0)
