"""A promise at several plants is limited: by draws, by time, or by plants that need more than is asked."""

from __future__ import annotations

from inputdesign_cli.compute.time_limit import what_ended
from inputdesign_cli.finding import Finding, doubt, note
from inputdesign_cli.outcome.robust import FloorUse

FRESH_PLANTS_CUT = note(
    "fresh-plants-cut-short",
    "The trial on fresh plants was cut short. Fewer plants were tried than `uncertainty.fresh` asks for. "
    "The 95 % limits count the ones tried.",
    "Allow more time.",
)
DRAWS_UNSTABLE = doubt(
    "draws-unstable",
    "Most of the draws are no plants that could be in operation. Draws from `uncertainty` that are unstable "
    "are drawn again. Every statement is about the stable ones.",
    "State what the plant can be in operation, or check the controller.",
)
LOST_PLANTS = doubt(
    "plants-lost",
    "At some plants no experiment is enough. The controller misses what is asked at these plants even if "
    "they are known exactly. Their r_adm is that of `uncertainty.floor`.",
    "Ask for less, take another controller, or state the plant more tightly.",
)
RAISED_PLANTS = doubt(
    "plants-at-floor",
    "Some plants are held to less than what is asked. At these plants r_adm is somewhere below "
    "`uncertainty.floor`, which the design keeps in its place.",
    "Lower `uncertainty.floor` to hold them to their own r_adm.",
)


def fewer_plants(tried: int, asked: int) -> list[Finding]:
    """Return a finding if fewer fresh plants were tried than were asked for."""
    message = f"{what_ended()} ended the trial on fresh plants after {tried} of {asked} (uncertainty.fresh)"
    found = FRESH_PLANTS_CUT.found(message, where="uncertainty.fresh", tried=tried, asked=asked)
    return [found] if tried < asked else []


def unstable_draws(rejected: int, drawn: int) -> list[Finding]:
    """Return a finding if most of the draws were no plants that could be in operation."""
    message = (
        f"{rejected} of {drawn} draws were unstable, or no plants, and were drawn again: results hold for "
        "the others alone; state what the plant can be in operation (uncertainty), or check the controller"
    )
    found = DRAWS_UNSTABLE.found(message, where="uncertainty", rejected=rejected, drawn=drawn)
    return [found] if 2 * rejected > drawn else []


def floor_findings(floor: FloorUse | None, scenarios: int) -> list[Finding]:
    """Return what `uncertainty.floor` means for what is promised at a number of plants."""
    found: list[Finding] = []
    if floor is None:
        return found
    share, lost, raised = f"{floor.share:g}", len(floor.lost), len(floor.raised)
    if floor.worst:
        first = floor.worst[0]
        values = ", ".join(f"{name} {value:.4g}" for name, value in first.parameters.items())
        reaches = "" if first.peak is None else f" (|S| reaches {first.peak:.4g})"
        message = (
            f"{lost} of {scenarios} plants miss what is asked even if they are known exactly, such as plant "
            f"{first.scenario}{reaches}: {values}. Their r_adm is that of uncertainty.floor, {share} of "
            "that of the plant of the spec. No experiment makes this controller keep what is asked there: "
            "ask for less, take another controller, or state the plant more tightly (floor in result.json)"
        )
        found.append(LOST_PLANTS.found(message, where="uncertainty.floor", lost=list(floor.lost)))
    if raised > lost:
        message = (
            f"at {raised - lost} of {scenarios} plants r_adm is somewhere less than {share} of that of the "
            "plant of the spec. The design holds them to that share (uncertainty.floor): what is asked is "
            "not promised there; a smaller floor holds them to their own r_adm"
        )
        at = [number for number in floor.raised if number not in floor.lost]
        found.append(RAISED_PLANTS.found(message, where="uncertainty.floor", raised=at))
    return found
