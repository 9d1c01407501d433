"""At which plants r_adm is that of `uncertainty.floor`: what is asked there is less than what the loop needs.

A controller whose sensitivity exceeds what is asked at a plant that is known exactly has no r_adm there. The
floor makes a design possible, and no model of that plant will be found good enough.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import OnModelError, model_errors
from inputdesign_cli.accuracy.requirement import Requirement
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.question import Alternative
from inputdesign_cli.outcome.results import Json

_LISTED = 12


@dataclass(frozen=True)
class Floor:
    """How a plant stands to its own r_adm.

    Args:
        raised: whether the floor counts at some frequency.
        lost: whether nothing keeps what is asked there, for its own r_adm vanishes.
        peak: of |S| with that plant where all is lost; None where no loop is asked about.
        share: that of r_adm of the plant of the spec which is the floor.
    """

    raised: bool
    lost: bool
    peak: float | None
    share: float


def floor_at(requirements: Iterable[Requirement]) -> Floor:
    """Of a plant, by what is required there."""
    errors = model_errors(requirements)
    floors = [(floor, error.grid) for error in errors if (floor := error.admissible.floored) is not None]
    lost = any(floor.lost(grid) for floor, grid in floors)
    raised = lost or any(floor.raised(grid) for floor, grid in floors)
    share = max((floor.share for floor, _ in floors), default=0.0)
    return Floor(raised, lost, max(_peaks(errors), default=None) if lost else None, share)


def _peaks(errors: Sequence[OnModelError]) -> Iterator[float]:
    for error in errors:
        if (kept := error.admissible.kept) is not None:
            yield float(np.max(kept.nominal(error.grid)))


def floor_of(plant: Alternative) -> Floor:
    """Of a plant that the design was not made for."""
    return floor_at(make(plant.experiment) for make in (*plant.requirements, *plant.side))


def floor_entry(
    floors: Sequence[Floor], numbers: Sequence[int], names: Sequence[str], thetas: Array
) -> dict[str, Json]:
    """`floor` of the result; empty where every plant has an r_adm of its own.

    Args:
        floors: of the plants.
        numbers: what they are called.
        names: of their parameters.
        thetas: (S, k), these parameters.
    """
    raised = [place for place, one in enumerate(floors) if one.raised]
    if not raised:
        return {}
    lost = sorted((p for p in raised if floors[p].lost), key=lambda p: -(floors[p].peak or 0.0))
    entry: dict[str, Json] = {
        "share": floors[raised[0]].share,
        "raised": [numbers[place] for place in raised],
        "lost": [numbers[place] for place in sorted(lost)],
    }
    if lost:
        entry["worst"] = [
            {"scenario": numbers[place]}
            | ({} if floors[place].peak is None else {"peak": floors[place].peak})
            | {"parameters": dict(zip(names, thetas[place].tolist(), strict=True))}
            for place in lost[:_LISTED]
        ]
    return entry


def floor_notes(entry: dict[str, Json], scenarios: int) -> tuple[str, ...]:
    """What the floor means for what is promised."""
    if not entry:
        return ()
    share, lost, raised = f"{entry['share']:g}", len(entry["lost"]), len(entry["raised"])
    notes: tuple[str, ...] = ()
    if lost:
        first = entry["worst"][0]
        values = ", ".join(f"{name} {value:.4g}" for name, value in first["parameters"].items())
        reaches = f", where |S| reaches {first['peak']:.4g}" if "peak" in first else ""
        notes = (
            f"at {lost} of {scenarios} plants, such as plant {first['scenario']} ({values}){reaches}, what "
            "is asked is missed even if the plant were known exactly: r_adm there is that of "
            f"uncertainty.floor ({share} of that of the plant of the spec), and no experiment makes "
            "this controller keep what is asked; ask for less, take another controller, or state the plant "
            "more tightly (floor in result.json)",
        )
    if raised > lost:
        notes = (
            *notes,
            f"at {raised - lost} of {scenarios} plants r_adm is somewhere less than {share} of that of the "
            "plant of the spec, and the design holds them to that (uncertainty.floor): what is asked is not "
            "promised there, though longer experiments may tell; a smaller floor holds them to their own",
        )
    return notes
