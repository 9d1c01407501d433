"""At which plants r_adm is that of `uncertainty.floor`: what is asked there is less than what the loop needs.

A controller whose sensitivity exceeds what is asked at a plant that is known exactly has no r_adm there. The
floor makes a design possible, and no model of that plant will be found good enough.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import model_errors
from inputdesign_cli.accuracy.requirement import Requirement
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.question import Alternative
from inputdesign_cli.outcome.robust import FloorUse, LostPlant

_LISTED = 12


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


def floor_use(
    floors: Sequence[Floor], numbers: Sequence[int], names: Sequence[str], thetas: Array
) -> FloorUse | None:
    """Return which plants are held to the floor; None if every plant has an r_adm of its own.

    Args:
        floors: of the plants.
        numbers: what they are called.
        thetas: (S, k), these parameters.
    """
    raised = [place for place, one in enumerate(floors) if one.raised]
    if not raised:
        return None
    lost = sorted((p for p in raised if floors[p].lost), key=lambda p: -(floors[p].peak or 0.0))
    worst = [
        LostPlant(numbers[p], dict(zip(names, thetas[p].tolist(), strict=True)), floors[p].peak)
        for p in lost[:_LISTED]
    ]
    return FloorUse(
        floors[raised[0]].share,
        tuple(numbers[place] for place in raised),
        tuple(numbers[place] for place in sorted(lost)),
        tuple(worst) or None,
    )
