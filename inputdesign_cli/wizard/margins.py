"""Which margin the loop will keep, and the plants at which no experiment makes it keep that."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from inputdesign_cli.outcome.results import Json, Result
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.accuracy import DEFAULT_CONFIDENCE


def margins_kept(spec: Spec, result: Result, *, enough: bool) -> list[str]:
    """What is promised of the loop, and where it is not.

    Args:
        enough: whether the record meets what is asked.
    """
    kept = spec.accuracy.loop
    loop = next((item["loop"] for item in result.get("requirements", []) if "loop" in item), None)
    if kept is None or not loop:
        return []
    robust, wished = result.get("robust", {}), f"{_decibels(kept.peak):.3g} dB"
    lost, barely, said = some_are_lost(robust), _barely(robust), list[str]()
    if enough:
        sure = 100.0 * (kept.confidence or DEFAULT_CONFIDENCE)
        where = "At the other plants that were tried the" if lost or barely else "The"
        said.append(
            f"{where} peak of |S| of the loop stays below {wished} for every plant within the error of the "
            f"model (r_u, to first order, {sure:.3g} % confidence): a gain margin of "
            f"{loop['gain_margin']:.3g} and a phase margin of {loop['phase_margin']:.3g} degrees are kept."
        )
    if barely:
        said.append(
            f"At {barely} of the plants that were tried the controller has hardly any room left. There the "
            "error is held against a share of the room at the plant as you stated it, and whether the margin "
            "is kept this experiment may leave open."
        )
    return ([_lost(robust, wished)] if lost else []) + said


def has_room_everywhere(robust: Mapping[str, Json]) -> bool:
    """Whether the controller has the margin with some room at every plant that was tried."""
    return not some_are_lost(robust) and not _barely(robust)


def _barely(robust: Mapping[str, Json]) -> int:
    """Plants that were tried at which r_adm is the floor, though it is positive."""
    floor, fresh = robust.get("floor", {"raised": [], "lost": []}), robust.get("fresh", {})
    others = int(fresh.get("raised", 0)) - int(fresh.get("lost", 0))
    return len(floor["raised"]) - len(floor["lost"]) + others


def some_are_lost(robust: Mapping[str, Json]) -> bool:
    """Whether, at a plant that was tried, the controller has no margin even if that plant were known."""
    return bool(_counted(robust)) or "lost" in robust.get("searched", {})


def _counted(robust: Mapping[str, Json]) -> list[str]:
    """At how many plants of which."""
    said, scenarios = list[str](), len(robust.get("floor", {}).get("lost", []))
    if scenarios:
        said.append(f"{scenarios} of the {robust['scenarios']} other plants that were tried")
    fresh = robust.get("fresh", {})
    return [*said, *([f"{fresh['lost']} of {fresh['draws']} more"] if "lost" in fresh else [])]


def _lost(robust: Mapping[str, Json], wished: str) -> str:
    known = [*robust.get("floor", {}).get("worst", []), robust.get("searched", {})]
    worst = max((one for one in known if "peak" in one), key=lambda one: one["peak"], default=None)
    such = ""
    if worst is not None:
        values = ", ".join(f"{name} {value:.3g}" for name, value in worst["parameters"].items())
        such = f", such as {values}, where |S| reaches {_decibels(worst['peak']):.3g} dB"
    at = " and at ".join(_counted(robust)) or "a plant within what you said"
    return (
        f"But at {at} this controller does not keep {wished} even if the plant were known exactly{such}. No "
        "experiment changes that: if the true plant is one of these, the verdict of assess will be "
        "undecided. A slower controller (a smaller Kp), one that is tuned to the plant, or a smaller "
        "margin helps."
    )


def _decibels(peak: float) -> float:
    return float(20.0 * np.log10(peak))
