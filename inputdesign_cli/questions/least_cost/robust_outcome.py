"""`robust` of the result: what the design keeps at the plants that were drawn, and at others like them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import cycle, islice

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError, what_ended
from inputdesign_cli.compute.watching import Counted, tell
from inputdesign_cli.design.convex.scenario_theory import risk_after, risk_before
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.statistics import binomial_limits
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.results import Json, Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.robust import (
    CONFIDENCE,
    MET,
    Batch,
    Kept,
    Plants,
    Searched,
    Tried,
    estimate_from,
    kept_by,
    tried_on,
)
from inputdesign_cli.questions.least_cost.fan import fan_curves
from inputdesign_cli.questions.least_cost.floor import Floor, floor_at, floor_entry, floor_notes, floor_of
from inputdesign_cli.questions.least_cost.outcome import Designed, costs_of

# A plant binds when it keeps all but this share of what is admitted.
_BINDS = 1e-5
_LISTED = 12
# Estimates that are foreseen, and the part of them that is told.
_ESTIMATES, _MOST_OF_THEM = 100, 0.95
_FEWER = "{} ended the trial on fresh plants after {} of {} (uncertainty.fresh)"


@dataclass(frozen=True)
class RobustResult:
    """`robust` of the result, with its tables and curves by the names of their files, and what to note."""

    entry: dict[str, Json]
    tables: dict[str, Table]
    curves: dict[str, Curves]
    notes: tuple[str, ...]


Peak = Callable[[Experiment], float]
"""The largest share of a limit on single samples that the record uses at a plant."""


def robust_result(done: Designed, plants: Plants, peak: Peak | None = None) -> RobustResult:
    """What the result says of the plants that were drawn, as far as the design is for them.

    Args:
        peak: None where no limit on single samples depends on the plant.
    """
    kept = done.kept
    units = done.units
    at_each = kept_by(done.problem, done.design, done.experiment.samples)
    shares = np.array([one.share for one in at_each])
    numbers = [0, *(number + 1 for number in kept)]  # of the plants, the nominal one being 0
    binding = _binding(done, shares)
    support = [place for place in binding if place > 0]
    entry = plants_entry(units, plants, numbers, at_each, binding) | {"support": len(support)}
    dearest_counts = plants.paid == "worst" and done.problem.goal == "cost"
    if dearest_counts:
        costs = costs_of(done, done.design.result.basis, done.design.result.x)
        dearest = int(np.argmax(costs))
        entry["dearest"] = {"scenario": numbers[dearest], "cost": costs[dearest]}
    floors = [floor_at((*one.requirements, *one.side)) for one in done.problem.scenarios[1:]]
    found, notes = floors_and_search(units, plants, kept, floors)
    entry |= found
    if plants.afresh is not None:
        entry |= _risk(plants, len(support), len(kept))
        promised = done.design.result.objective if dearest_counts else None
        tried = partial(tried_on, done.design, done.experiment.samples)
        fresh, fewer = fresh_entry(plants, plants.afresh(), tried, peak, promised)
        entry |= fresh | _estimates(done, plants, binding)
        notes += fewer
    tables, curves = {"scenarios": scenario_table(units, plants, numbers, at_each)}, dict[str, Curves]()
    fan = fan_curves(done, numbers, binding)
    if fan is not None and done.design.result.x.any():
        tables["fan"], curves["fan"] = fan
    return RobustResult(entry, tables, curves, notes)


def plants_entry(
    units: Units, plants: Plants, numbers: Sequence[int], at_each: Sequence[Kept], binding: Sequence[int]
) -> dict[str, Json]:
    """Return where the plants come from, how many count, and the worst of them.

    Args:
        units: of the spec.
        plants: all beside the nominal one.
        numbers: of those that count, the nominal one being 0.
        at_each: what each of these keeps.
        binding: places among them.
    """
    worst = int(np.argmax([one.share for one in at_each]))
    return {
        "source": plants.source,
        "scenarios": len(plants.batch.plants),
        "rejected": plants.batch.rejected,
        "discarded": len(plants.batch.plants) + 1 - len(numbers),
        "r_adm": plants.r_adm,
        "cost": plants.paid,
        "worst_share": at_each[worst].share,
        "worst_scenario": numbers[worst],
        "active": [_active(units, plants, numbers[place], at_each[place]) for place in binding[:_LISTED]],
    }


def floors_and_search(
    units: Units, plants: Plants, kept: Sequence[int], floors: Sequence[Floor]
) -> tuple[dict[str, Json], tuple[str, ...]]:
    """Return `floor` and `searched`, and the notes on floors and on plants that are none.

    Args:
        units: of the spec.
        plants: all beside the nominal one.
        kept: the numbers of those that count.
        floors: of these.
    """
    numbers = [number + 1 for number in kept]
    floored = floor_entry(floors, numbers, plants.names, plants.batch.thetas[list(kept)])
    entry: dict[str, Json] = {"floor": floored} if floored else {}
    if plants.searched is not None:
        entry["searched"] = _searched(units, plants, plants.searched)
    return entry, (*_unstable(plants.batch), *floor_notes(floored, len(kept)))


def _unstable(batch: Batch) -> tuple[str, ...]:
    """A note where most of what the plant is said to be is no plant that could be in operation."""
    drawn = len(batch.plants) + batch.rejected
    if 2 * batch.rejected <= drawn:
        return ()
    return (
        f"{batch.rejected} of {drawn} draws were unstable, or no plants, and were drawn again: what is said "
        "of the plants is said of the others alone; state what the plant can be in operation (uncertainty), "
        "or check the controller",
    )


def _binding(done: Designed, shares: Array) -> list[int]:
    """The plants that bind, those of the largest multipliers first."""
    weight = done.design.result.certificate.shares
    order = np.lexsort((-shares, -weight))
    taking_part = (weight > _BINDS) | (shares >= 1.0 - _BINDS)
    return [place for place in order.tolist() if taking_part[place]]


def _active(units: Units, plants: Plants, number: int, kept: Kept) -> dict[str, Json]:
    item: dict[str, Json] = {"scenario": number, "share": kept.share}
    if kept.frequency is not None:
        item["frequency"] = kept.frequency / units.frequency
    if number > 0:
        item["parameters"] = dict(zip(plants.names, plants.batch.thetas[number - 1].tolist(), strict=True))
    return item


def _searched(units: Units, plants: Plants, found: Searched) -> dict[str, Json]:
    """The worst plant that was found, which is no proof that there is no worse one."""
    entry: dict[str, Json] = {"proved": False, "region": found.region, "share": found.kept.share}
    if found.kept.frequency is not None:
        entry["frequency"] = found.kept.frequency / units.frequency
    entry["parameters"] = dict(zip(plants.names, found.theta.tolist(), strict=True))
    plant = None if plants.at is None else plants.at(found.theta)
    if plant is not None and (floor := floor_of(plant)).lost:
        entry |= {"lost": True} | ({} if floor.peak is None else {"peak": floor.peak})
    return entry | {"added": found.added, "tried": found.tried}


def _risk(plants: Plants, support: int, kept: int) -> dict[str, Json]:
    """Shares of plants that may be missed.

    Where some were left out, or sought, the theory is silent, and fresh draws count.
    """
    drawn = len(plants.batch.plants)
    if kept < drawn or (plants.searched is not None and plants.searched.added):
        return {}
    beta = 1.0 - CONFIDENCE
    risk: dict[str, Json] = {"confidence": CONFIDENCE, "after": risk_after(drawn, beta, support)}
    if plants.unknowns is not None:
        risk["before"] = risk_before(drawn, beta, plants.unknowns)
    return {"risk": risk}


def fresh_entry(
    plants: Plants,
    afresh: Iterator[Batch],
    try_on: Callable[[Batch, float], Sequence[Tried]],
    peak: Peak | None = None,
    promised: float | None = None,
) -> tuple[dict[str, Json], tuple[str, ...]]:
    """Return how many of other plants from the same distribution are missed, as many as there is time for.

    Args:
        plants: those that count.
        afresh: the others.
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
    fewer = () if len(tried) >= plants.fresh else (_FEWER.format(what_ended(), len(tried), plants.fresh),)
    if not tried:
        return {}, fewer
    shares = np.array([one.share for one in tried])
    dearer = np.array([promised is not None and one.cost > MET * promised for one in tried])
    less = shares > MET
    missed = int(np.sum(less | dearer))
    entry: dict[str, Json] = {
        "draws": len(tried),
        "rejected": rejected,
        "missed": missed,
        "share": missed / len(tried),
        "limits": list(binomial_limits(missed, len(tried))),
        "largest": largest,
    }
    for name, count in (
        ("raised", sum(floor.raised for floor in floors)),
        ("lost", sum(floor.lost for floor in floors)),
    ):
        if count:
            entry[name] = count
    if peaks:
        entry["beyond_limits"] = {"draws": sum(one > MET for one in peaks), "largest": max(peaks)}
    if promised is not None:
        entry |= {"less": int(np.sum(less)), "dearer": int(np.sum(dearer))}
    return {"fresh": entry}, fewer


def _estimates(done: Designed, plants: Plants, binding: Sequence[int]) -> dict[str, Json]:
    """How near the best accuracy comes to being missed where the data will tell the plant to be.

    Data are judged at their estimate: some are drawn of the plants that bind.

    Args:
        binding: places among those that are kept, the nominal plant being 0.
    """
    worst = [plants.batch.plants[done.kept[place - 1]] for place in binding if place > 0]
    if done.problem.goal != "factor" or plants.at is None or not worst:
        return {}
    rng, samples, shares = np.random.default_rng(0), done.experiment.samples, list[float]()
    try:
        for plant in islice(cycle(worst), _ESTIMATES):
            theta = estimate_from(done.design, samples, plant, rng)
            told = None if theta is None else plants.at(theta)
            if theta is None or told is None:
                shares.append(np.inf)
            else:
                shares += [
                    one.kept.share for one in tried_on(done.design, samples, Batch(theta[None], (told,), 1))
                ]
    except IdesignError:  # no time is left, or what is asked cannot be asked of such a plant
        return {}
    highest = float(np.quantile(shares, _MOST_OF_THEM, method="higher"))
    if not np.isfinite(highest):
        return {}
    return {"estimates": {"draws": len(shares), "confidence": _MOST_OF_THEM, "largest": highest}}


def scenario_table(units: Units, plants: Plants, numbers: Sequence[int], at_each: Sequence[Kept]) -> Table:
    """Return scenarios.csv: the plants that count, with their parameters."""
    thetas = plants.batch.thetas
    where = [np.nan if one.frequency is None else one.frequency / units.frequency for one in at_each]
    listed = [place for place, number in enumerate(numbers) if number > 0]
    columns: dict[str, Array] = {
        "scenario": np.array([numbers[place] for place in listed], dtype=float),
        "share": np.array([at_each[place].share for place in listed]),
    }
    if not np.any(np.isnan([where[place] for place in listed])):
        columns[units.frequency_header] = np.array([where[place] for place in listed])
    chosen = thetas[[numbers[place] - 1 for place in listed]]
    columns |= dict(zip(plants.names, chosen.T, strict=True))
    return Table(columns)
