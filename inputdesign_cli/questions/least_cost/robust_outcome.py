"""`robust` of the outcome: what the design keeps at the plants that were drawn, and at others like them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import cycle, islice

import numpy as np

from inputdesign_cli.accuracy import OnModelError, Requirement, model_errors, worst
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError, seconds_left
from inputdesign_cli.compute.watching import Counted, tell
from inputdesign_cli.design.convex.question import Alternative
from inputdesign_cli.design.convex.scenario_theory import risk_after, risk_before
from inputdesign_cli.errors import IdesignError, bad_spec
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
    FloorUse,
    FreshPlants,
    LostPlant,
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
    Searched,
    Tried,
    delivered,
    estimate_from,
    kept_by,
    tried_on,
)
from inputdesign_cli.questions.common.spectrum import axis
from inputdesign_cli.questions.least_cost.outcome import Designed, costs_of
from inputdesign_cli.questions.least_cost.worst_case import worst_plant

# A plant binds when it is within this share of its limit.
_BINDS = 1e-5
_LISTED = 12
# Estimates that are foreseen, and the share of them that counts.
_ESTIMATES, _MOST_OF_THEM = 100, 0.95
_GRID_POINTS = 300


@dataclass(frozen=True)
class Floor:
    """How a plant stands to its own r_adm.

    Attributes:
        raised: whether the floor counts at some frequency.
        lost: whether nothing keeps what is asked there, since its own r_adm vanishes.
        peak: of |S| with that plant if all is lost; None if no loop is asked about.
        share: of r_adm of the plant of the spec, which is the floor.
    """

    raised: bool
    lost: bool
    peak: float | None
    share: float


def floor_at(requirements: Iterable[Requirement]) -> Floor:
    """Return how a plant stands to its own r_adm, by what is required there."""
    errors = model_errors(requirements)
    floors = [(floor, error.grid) for error in errors if (floor := error.admissible.floored) is not None]
    lost = any(floor.lost(grid) for floor, grid in floors)
    raised = lost or any(floor.raised(grid) for floor, grid in floors)
    share = max((floor.share for floor, _ in floors), default=0.0)
    loops = [(kept, error.grid) for error in errors if (kept := error.admissible.kept) is not None]
    peak = max((float(np.max(kept.nominal(grid))) for kept, grid in loops), default=None)
    return Floor(raised, lost, peak if lost else None, share)


def floor_of(plant: Alternative) -> Floor:
    """Return how a plant that the design was not made for stands to its own r_adm."""
    return floor_at(make(plant.experiment) for make in (*plant.requirements, *plant.side))


def floor_use(plants: Plants, kept: Sequence[int], floors: Sequence[Floor]) -> FloorUse | None:
    """Return which of the plants that count are held to the floor; None if each has an r_adm of its own."""
    raised = [place for place, one in enumerate(floors) if one.raised]
    if not raised:
        return None
    lost = sorted((p for p in raised if floors[p].lost), key=lambda p: -(floors[p].peak or 0.0))
    worst = [
        LostPlant(kept[p] + 1, _named(plants, plants.batch.thetas[kept[p]]), floors[p].peak)
        for p in lost[:_LISTED]
    ]
    share, numbers = floors[raised[0]].share, np.array(kept) + 1
    return FloorUse(
        share, tuple(numbers[raised].tolist()), tuple(numbers[sorted(lost)].tolist()), tuple(worst) or None
    )


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
    promised = done.design.result.objective if dearest_counts else None
    tried = partial(tried_on, done.design, done.experiment.samples)
    fresh, fewer = fresh_plants(plants, tried, peak, promised)
    if plants.afresh is not None:
        risk, estimates = _risk(plants, support, len(kept)), _estimates(done, plants, binding)
        entry = replace(entry, risk=risk, fresh=fresh, estimates=estimates)
    fan = fan_curves(done, numbers, binding) if done.excites else None
    return RobustResult(
        entry,
        found.tables if fan is None else found.tables | {"fan": fan[0]},
        {} if fan is None else {"fan": fan[1]},
        (*found.findings, *fewer),
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
        at_each: what these keep, the plant of the spec first.
        binding: places among them.
    """
    numbers = [0, *(number + 1 for number in kept)]
    worst = int(np.argmax([one.share for one in at_each]))
    floor = floor_use(plants, kept, floors)
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
    try_on: Callable[[Batch, float], Sequence[Tried]],
    peak: Peak | None = None,
    promised: float | None = None,
) -> tuple[FreshPlants | None, list[Finding]]:
    """Return how many of other plants from the same distribution are missed, as far as there is time.

    Args:
        try_on: what they keep; a share up to the number may be returned as 0.
        promised: the cost that a design promises at every plant.
    """
    if plants.afresh is None:
        return None, []
    tried, peaks, rejected, largest, floors = list[Kept](), list[float](), 0, 0.0, list[Floor]()
    for batch in plants.afresh():
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
    fewer = fewer_plants(len(tried), plants.fresh)
    if not tried:
        return None, fewer
    less = np.array([one.share for one in tried]) > MET
    dearer = np.array([promised is not None and one.cost > MET * promised for one in tried])
    missed = int(np.sum(less | dearer))
    found = FreshPlants(
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
    return found, fewer


def _estimates(done: Designed, plants: Plants, binding: Sequence[int]) -> DrawnEstimates | None:
    """Return how near the best accuracy comes to being missed at estimates of the plants that bind.

    Data are judged at their estimate, so that some are drawn.
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


@dataclass(frozen=True)
class AtPlants:
    """An excitation of this `power` over these `samples`; `information` gives M in any coordinates."""

    information: Callable[[Experiment], Array]
    power: float
    samples: int

    def on(self, plant: Alternative) -> Tried:
        """Return how near a plant comes to being missed: infinitely if its parameters are undetermined."""
        seconds_left()
        own = replace(plant.experiment, samples=self.samples)
        asked = tuple(make(own) for make in (*plant.requirements, *plant.side))
        try:
            coordinates = own.whitened(self.power)
            there = plant.at(coordinates)
            return Tried(kept_of((*there.requirements, *there.side), self.information(coordinates)), asked)
        except OutOfTimeError:
            raise
        except (np.linalg.LinAlgError, IdesignError):
            return Tried(Kept(np.inf), asked)

    def on_each(self, batch: Batch, above: float = 0.0) -> list[Tried]:
        """Return this for every plant of a batch, to the last digit also up to `above`."""
        return [self.on(plant) for plant in batch.plants]


def kept_of(requirements: Sequence[Requirement], information: Array) -> Kept:
    """Return the largest ratio of an error to what is admitted, and where it is."""
    found = worst([one for requirement in requirements for one in requirement.violations(information)])
    return Kept(found.ratio, found.frequency)


def given_robust(at: AtPlants, plants: Plants, nominal: Kept, centre: Array, units: Units) -> RobustResult:
    """Return what the excitation keeps at the plants of `uncertainty`.

    Args:
        plants: all but the plant of the spec. The worst are left out, as many as may be discarded.
        nominal: what it keeps at the plant of the spec, whose parameters are `centre` (k,).

    Raises:
        SpecError: `not-exciting` if parameters of a plant are undetermined.
    """
    batch = plants.batch
    tried = at.on_each(batch)
    shares = np.array([one.kept.share for one in tried])
    rising = np.argsort(shares, kind="stable").tolist()
    kept = sorted(rising[: len(rising) - plants.discard])
    at_each = [nominal, *(tried[place].kept for place in kept)]
    looked_at = list(at_each)
    if plants.region is not None:
        starts = [centre, *(batch.thetas[place] for place in reversed(rising))]
        found = worst_plant(plants.region, lambda _, plant: at.on(plant).kept, starts)
        sought = Searched(plants.region.name, found.theta, found.kept, found.tried, added=0)
        plants, looked_at = replace(plants, searched=sought), [*looked_at, found.kept]
    if not all(np.isfinite(one.share) for one in looked_at):
        raise bad_spec(
            "not-exciting",
            "the given excitation does not determine the parameters of every plant of uncertainty",
            hint="excite more frequencies, or state the uncertainty more tightly",
            key="uncertainty",
        )
    binding = [int(np.argmax([one.share for one in at_each]))]
    floors = [floor_at(tried[place].asked) for place in kept]
    found_there = plants_kept(units, plants, kept, at_each, binding, floors)
    fresh, fewer = fresh_plants(plants, at.on_each)
    missed = sum(one.share > MET for one in looked_at)
    return replace(
        found_there,
        entry=replace(found_there.entry, missed=missed, fresh=fresh),
        findings=(*found_there.findings, *fewer),
    )
