"""A promise is limited: by time, by draws, or by plants that need more than is asked."""

from __future__ import annotations

from inputdesign_cli.compute.time_limit import more_time, what_ended
from inputdesign_cli.finding import DOUBT, NOTE, Finding, FindingKind, doubt, finding, note
from inputdesign_cli.outcome import Objective
from inputdesign_cli.outcome.robust import FloorUse
from inputdesign_cli.outcome.shares import per_cent

DESIGN_UNFINISHED = doubt(
    "design-unfinished",
    "The design ended before its proof closed. It meets all requirements. The gap "
    "bounds how much better another design could be.",
    "Allow more time.",
)
OTHER_SPECTRA_LEFT_OUT = note(
    "other-spectra-left-out",
    "There is no bound over every spectrum yet. The design is proved the best of its type of spectrum. "
    "Other types were not compared (no time, or not requested).",
    "Allow more time, leave out `--fast`, or write `solver.any_spectrum: true`.",
)
NO_BOUND_EXISTS = note(
    "no-bound-over-spectra",
    "There is no bound over every spectrum. Some excitation gives information without cost or limit. Ever "
    "better spectra approach it.",
    "Give this excitation a cost or a limit, or exclude its frequency by `limits.band`.",
)
ONLY_APPROACHED = doubt(
    "optimum-only-approached",
    "The optimum is only approached. Better spectra have power ever nearer to a frequency, but none has "
    "power there. No record reaches this limit.",
    "Give this excitation a cost or a limit, or exclude its frequency by `limits.band`.",
)
LOST_PLANTS = doubt(
    "plants-lost",
    "For some plants no experiment is enough. The controller misses the requirement at these plants even if "
    "they are known exactly. Their r_adm is that of `uncertainty.floor`.",
    "Ask for less, take another controller, or narrow `uncertainty`.",
)
RAISED_PLANTS = doubt(
    "plants-at-floor",
    "The requirement is weaker for some plants. At these plants r_adm is somewhere below "
    "`uncertainty.floor`, which replaces it.",
    "Lower `uncertainty.floor` to keep their own r_adm.",
)


def ended_early(status: str, objective: Objective) -> list[Finding]:
    """Return what the end of the time left open: the proof, or the bound over every spectrum."""
    if status == "gap_open":
        bound = objective.upper_bound or objective.lower_bound
        gap = 1.0 if objective.relative_gap is None else objective.relative_gap
        side, far = "above" if objective.upper_bound else "below", "nothing is proved yet of other designs"
        if bound:
            far = f"no other design gets {side} {bound:.6g} (a gap of {per_cent(gap, 2)})"
        remedy, share = f"To close the gap, {more_time()}.", objective.relative_gap
        fact = f"{what_ended()} ended the design, and {far}"
        return [DESIGN_UNFINISHED.found(fact, where="solver", remedy=remedy, relative_gap=share)]
    remedy = f"To have it, {more_time()}, or write solver.any_spectrum_tolerance: 0.01."
    fact = f"{what_ended()} came before it"
    return OTHER_SPECTRA_LEFT_OUT.when(
        objective.any_spectrum_bound is None, fact, where="solver", remedy=remedy
    )


def other_spectra_left_out() -> Finding:
    """Return the finding that the bound over every spectrum was not asked for."""
    return OTHER_SPECTRA_LEFT_OUT.found("it was not requested", where="solver.any_spectrum")


def uncounted_excitation(message: str, *, bounded: bool) -> Finding:
    """Return the finding that spectra come ever nearer to excitation that nothing counts.

    Args:
        message: the excitation that is not counted, and what to do.
        bounded: whether the objective of these spectra has a bound.
    """
    return (ONLY_APPROACHED if bounded else NO_BOUND_EXISTS).found(message, remedy="Nothing")


@finding(
    DOUBT,
    "no-record-in-time",
    "Allow more time, or try fewer records (`signal.candidates`) or shorter ones (`signal.samples`).",
)
def no_record_in_time(kind: FindingKind, candidates: int) -> Finding:
    """There was no time for a record. The spectrum is complete, but no record of it was found."""
    return kind.found(f"{what_ended()} came before one was found", where="signal", candidates=candidates)


@finding(DOUBT, "accuracy-on-grid", "Use `solver.method: exchange`, which keeps it at every frequency.")
def on_grid(kind: FindingKind, lines: int, ratio: float) -> Finding:
    """The accuracy holds only on a grid of frequencies. Between them it may be missed."""
    fact = f"on the grid of {lines} frequencies; over the whole band r_u / r_adm is at most {ratio:.6g}"
    return kind.found(fact, where="solver.method", grid=lines, worst_ratio=ratio)


@finding(NOTE, "fresh-plants-cut-short", "Allow more time.")
def fewer_plants(kind: FindingKind, tried: int, asked: int) -> list[Finding]:
    """The trial on new plants was cut short. The 95 % limits hold for the plants that were tried."""
    fact = f"{what_ended()} ended it after {tried} of {asked}"
    return kind.when(tried < asked, fact, where="uncertainty.fresh", tried=tried, asked=asked)


@finding(DOUBT, "draws-unstable", "Restrict `uncertainty` to possible plants, or check the controller.")
def unstable_draws(kind: FindingKind, rejected: int, drawn: int) -> list[Finding]:
    """Most draws are unstable plants. They are drawn again; statements concern stable plants only."""
    fact = f"{rejected} of {drawn}"
    return kind.when(2 * rejected > drawn, fact, where="uncertainty", rejected=rejected, drawn=drawn)


def floor_findings(floor: FloorUse | None, scenarios: int) -> list[Finding]:
    """Return what `uncertainty.floor` means for what is promised at a number of plants."""
    if floor is None:
        return []
    lost, where = list(floor.lost), "uncertainty.floor"
    raised = [number for number in floor.raised if number not in lost]
    of_spec = f"of {scenarios} plants, with {floor.share:g} of r_adm at the plant of the spec"
    first = floor.worst[0].parameters if floor.worst else {}
    like = f". One has {', '.join(f'{name} {value:.4g}' for name, value in first.items())}"
    return [
        *LOST_PLANTS.when(floor.worst, f"{len(lost)} {of_spec}{like}", where=where, lost=lost),
        *RAISED_PLANTS.when(raised, f"{len(raised)} {of_spec}", where=where, raised=raised),
    ]
