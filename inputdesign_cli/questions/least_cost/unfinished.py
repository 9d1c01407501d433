"""What is told of a design that was delivered without all that is computed by default."""

from __future__ import annotations

from inputdesign_cli.compute.time_limit import more_time, what_ended
from inputdesign_cli.outcome.results import Json, Result
from inputdesign_cli.outcome.shares import per_cent


def unfinished_notes(result: Result) -> list[str]:
    """How far the best design so far may be from the optimum, and what was not computed.

    Args:
        result: of the design.
    """
    found, notes = result["objective"], list[str]()
    if result["status"] == "gap_open":
        notes.append(
            f"{what_ended()} ended the design: it meets all that is required, and {_how_far(found)}; "
            f"{more_time()} to close the gap"
        )
    elif "any_spectrum_bound" not in found:
        notes.append(
            f"{what_ended()} came before the bound over every spectrum; solver.any_spectrum_tolerance: 0.01 "
            "would take less time"
        )
    return notes


def _how_far(found: Json) -> str:
    gap = found.get("relative_gap", 1.0)
    if not any(found.get(bound) for bound in ("lower_bound", "upper_bound")):
        return "nothing is proved yet of what others reach"
    if "upper_bound" in found:
        return f"no other gets above {found['upper_bound']:.6g}"
    return f"no other gets below {found['lower_bound']:.6g} ({per_cent(gap, 2)} lower)"


def no_other_spectra() -> str:
    """That the bound over every spectrum was left out."""
    return (
        "the design is the best of its spectrum type; what other spectra reach was not computed "
        "(solver.any_spectrum: false, or --fast)"
    )


def no_record_in_time(candidates: int) -> str:
    """That a design has no record, of so many candidates, because its time was over, and what to do."""
    fewer = "fewer records (signal.candidates: 1) or shorter ones" if candidates > 1 else "a shorter one"
    return (
        f"there is no record: {what_ended()} came before one was found; the spectrum is that of the design. "
        f"To have one, {more_time()}, or try {fewer} (signal.samples)"
    )
