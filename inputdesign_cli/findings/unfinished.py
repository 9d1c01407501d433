"""A promise is limited: by time, by draws, or by plants that need more than is asked."""

from __future__ import annotations

from inputdesign_cli.compute.time_limit import more_time, what_ended
from inputdesign_cli.finding import Finding, doubt, note
from inputdesign_cli.outcome import Objective
from inputdesign_cli.outcome.robust import FloorUse
from inputdesign_cli.outcome.shares import per_cent

DESIGN_UNFINISHED = doubt(
    "design-unfinished",
    "The time limit ended the design before its proof closed. The design meets all requirements. The gap "
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
NO_RECORD_IN_TIME = doubt(
    "no-record-in-time",
    "There was no time for a record. The spectrum is complete, but no record of it was found.",
    "Allow more time, or try fewer records (`signal.candidates`) or shorter ones (`signal.samples`).",
)
ON_GRID = doubt(
    "accuracy-on-grid",
    "The accuracy holds only on a grid of frequencies. `solver.method: lmi` is the program of the papers. "
    "Between the grid points the accuracy may be missed.",
    "Use `solver.method: exchange`, which keeps the accuracy at every frequency.",
)


def ended_early(status: str, objective: Objective) -> list[Finding]:
    """Return what the end of the time left open: the proof, or the bound over every spectrum."""
    if status == "gap_open":
        message = (
            f"{what_ended()} ended the design: it meets all that is required, and {_how_far(objective)}; "
            f"{more_time()} to close the gap"
        )
        return [DESIGN_UNFINISHED.found(message, where="solver", relative_gap=objective.relative_gap)]
    if objective.any_spectrum_bound is not None:
        return []
    message = (
        f"{what_ended()} came before the bound over every spectrum; solver.any_spectrum_tolerance: 0.01 "
        "would take less time"
    )
    return [OTHER_SPECTRA_LEFT_OUT.found(message, where="solver")]


def _how_far(objective: Objective) -> str:
    if objective.upper_bound:
        return f"no other gets above {objective.upper_bound:.6g}"
    if not objective.lower_bound:
        return "nothing is proved yet of others"
    gap = per_cent(1.0 if objective.relative_gap is None else objective.relative_gap, 2)
    return f"no other gets below {objective.lower_bound:.6g} ({gap} lower)"


def other_spectra_left_out() -> Finding:
    """Return the finding that the bound over every spectrum was not asked for."""
    message = (
        "the design is the best of its spectrum type; what other spectra reach was not computed "
        "(solver.any_spectrum: false, or --fast)"
    )
    return OTHER_SPECTRA_LEFT_OUT.found(message, where="solver.any_spectrum")


def uncounted_excitation(message: str, *, bounded: bool) -> Finding:
    """Return the finding that spectra come ever nearer to excitation that nothing counts.

    Args:
        message: what is not counted, and what to do.
        bounded: whether what they reach has a bound.
    """
    return (ONLY_APPROACHED if bounded else NO_BOUND_EXISTS).found(message)


def no_record_in_time(candidates: int) -> Finding:
    """Return the finding that the time was over before a record was found, of a number of candidates."""
    fewer = "fewer records (signal.candidates: 1) or shorter ones" if candidates > 1 else "a shorter one"
    message = (
        f"there is no record: {what_ended()} came before one was found; the spectrum is that of the design. "
        f"To have one, {more_time()}, or try {fewer} (signal.samples)"
    )
    return NO_RECORD_IN_TIME.found(message, where="signal", candidates=candidates)


def on_grid(lines: int, ratio: float) -> Finding:
    """Return the finding that the accuracy holds at a number of frequencies, with the largest ratio."""
    message = (
        f"the accuracy holds on the grid of {lines} frequencies; over the whole band r_u / r_adm is at most "
        f"{ratio:.6g} (solver.method: exchange keeps it at every frequency)"
    )
    return ON_GRID.found(message, where="solver.method", grid=lines, worst_ratio=ratio)


FRESH_PLANTS_CUT = note(
    "fresh-plants-cut-short",
    "The trial on new plants was cut short. It includes fewer plants than `uncertainty.fresh`. The 95 % "
    "limits hold for these.",
    "Allow more time.",
)
DRAWS_UNSTABLE = doubt(
    "draws-unstable",
    "Most draws are unstable plants. They could not be in operation, and are drawn again. Every statement "
    "concerns stable plants only.",
    "Restrict `uncertainty` to plants that can be in operation, or check the controller.",
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
            f"{lost} of {scenarios} plants miss what is asked even if they are known exactly, like plant "
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
