"""How the times of a record were read."""

from __future__ import annotations

from collections.abc import Sequence

from inputdesign_cli.finding import Finding, FindingKind, Severity

TIMES_READ = FindingKind(
    "times-read",
    Severity.NOTE,
    "times were made from what the file holds",
    "A column of dates and one of times of day are joined. A time of day that falls by more than half a day "
    "belongs to the next day. Milli-, micro- and nanoseconds since 1970 are known by their size.",
    "Nothing, if that is right. Otherwise name the column of times: `--columns time=NAME`.",
)
TIMES_ASSUMED = FindingKind(
    "times-assumed",
    Severity.NOTE,
    "the sample time is not known",
    "Without times in the file or `--sample-time`, the sample time is taken for 1.",
    "Give `--sample-time`, or name the column of times: `--columns time=NAME`.",
)


def times_assumed(why: str, likely: Sequence[str]) -> Finding:
    """Say that the sample time was taken for 1, and which columns are likely to hold times."""
    hint = f" Perhaps times stand in {', '.join(likely)}." if likely else ""
    said = f"{why} and there is no --sample-time: the sample time is taken for 1.{hint}"
    return TIMES_ASSUMED.found(said, columns=list(likely))


def times_disagree(stated: float, step: float) -> Finding:
    """Say that a file states another sample time than its times have."""
    said = f"The file states the sample time {stated:g}, and its times advance by {step:g}: the times count."
    return TIMES_READ.found(said, stated=stated, step=step)
