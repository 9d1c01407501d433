"""Samples were not taken at even times, or not all at the same times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from inputdesign_cli.finding import Finding, FindingKind, Severity
from inputdesign_cli.outcome.shares import per_cent

JITTER_EVENED = FindingKind(
    "jitter-evened-out",
    Severity.NOTE,
    "times were made even",
    "A model in discrete time needs even steps. Outputs are interpolated linearly. Of inputs, which "
    "are held, the nearest sample counts. Steps may differ by 25 % of the sample "
    "time, with `--resample` by more.",
    "Nothing. An estimate from a logger with less jitter is more accurate.",
)
INPUTS_MOVE_BETWEEN = FindingKind(
    "inputs-move-between-samples",
    Severity.DOUBT,
    "inputs are not held between resampled times",
    "The model takes inputs as constant from one sample to the next. After resampling to a longer step they "
    "move in between, so the estimate is biased.",
    "Resample to a step over which inputs are held, or estimate at the steps of the file.",
)
COLUMNS_JOINED = FindingKind(
    "columns-joined",
    Severity.NOTE,
    "columns were written at different times",
    "The times of the output that was written most often count, or all rows if it misses only some. Inputs "
    "are held until they are written again. If they move in between, their means count. Other outputs are "
    "interpolated.",
    "Log all channels in one row, if the logger can.",
)


def jitter_evened(step: float, unit: str, largest: float) -> Finding:
    """Say that times were made even, where steps differ from `step` by this `largest` share of it."""
    said = f"Steps of time differ from {step:.6g} {unit} by up to {per_cent(largest, 2)}."
    done = "They were made even: outputs by interpolation, inputs from the nearest sample."
    return JITTER_EVENED.found(f"{said} {done}", step=step, largest=largest)


def inputs_move_between(moved: int) -> list[Finding]:
    """Say after how many of the even times an input moves before the next one."""
    if not moved:
        return []
    said = f"Inputs move between {moved} of the even times, where the model takes them as held."
    return [INPUTS_MOVE_BETWEEN.found(said, instants=moved)]


def columns_joined(counts: Mapping[str, int], rows: int, moved: int, kept: int) -> Iterator[Finding]:
    """Say that columns of different times were joined.

    Args:
        counts: rows with a value, by column.
        rows: of the file.
        moved: times between which inputs move.
        kept: times that are kept.
    """
    each = ", ".join(f"{name} in {count}" for name, count in counts.items())
    said = (
        f"Columns were written at different times ({each} of {rows} rows). They were joined at {kept} times."
    )
    between = f" Inputs move between {moved} of these times: their means count." if moved else ""
    yield COLUMNS_JOINED.found(f"{said}{between}", counts=dict(counts), rows=rows, moved=moved, kept=kept)
