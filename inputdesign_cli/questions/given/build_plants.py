"""A given excitation at every plant that the true one might be: what it buys there, and where least."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.accuracy import Requirement, worst
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError, seconds_left
from inputdesign_cli.design.convex.question import Alternative
from inputdesign_cli.errors import IdesignError, bad_spec
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.robust import MET, Batch, Kept, Plants, Searched, Tried
from inputdesign_cli.questions.least_cost.floor import floor_at
from inputdesign_cli.questions.least_cost.robust_outcome import (
    RobustResult,
    fresh_findings,
    fresh_plants,
    plants_kept,
)
from inputdesign_cli.questions.least_cost.worst_case import worst_plant


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
    fresh = None if plants.afresh is None else fresh_plants(plants, plants.afresh(), at.on_each)
    missed = sum(one.share > MET for one in looked_at)
    return replace(
        found_there,
        entry=replace(found_there.entry, missed=missed, fresh=fresh),
        findings=(*found_there.findings, *fresh_findings(plants, fresh)),
    )
