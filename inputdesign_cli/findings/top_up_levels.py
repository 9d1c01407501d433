"""A top-up varies about other levels than the data, or does not count on the prior."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import DOUBT, NOTE, Finding, FindingKind, finding
from inputdesign_cli.findings.other_systems import PRIOR_LEFT_OUT

# Times its own deviation: an input whose mean is farther from zero has a level.
_AWAY = 0.5


def level_notes(
    levels: Mapping[str, float], point: Sequence[float] | None, means: Array | None, deviations: Array
) -> list[Finding]:
    """Return what the user should know before the record is applied.

    Args:
        levels: by channel, what was taken away from the data.
        point: what the record varies about by input; None for zero.
        means: (r,), of the inputs as they were recorded; None: not known.
        deviations: (r,), of the inputs.
    """
    found = _about_levels(point) if point is not None and levels else []
    if means is None or (point is not None and not levels):  # the spec states it
        return found
    unknown = {
        j: float(f"{mean:.4g}")
        for j, (mean, spread) in enumerate(zip(means, deviations, strict=True))
        if f"u{j + 1}" not in levels and abs(mean) > _AWAY * spread
    }
    offsets = [unknown.get(j, 0.0 if point is None else point[j]) for j in range(len(means))]
    return [*found, *_about_zero(unknown, offsets)]


@finding(NOTE, "about-an-operating-point", "Apply `signal.csv` unchanged.")
def _about_levels(kind: FindingKind, point: Sequence[float]) -> list[Finding]:
    """The record varies about the operating point. `signal.csv` includes the levels of the data."""
    about = ", ".join(f"u{j + 1} = {level:g}" for j, level in enumerate(point))
    return [kind.found(about, where="signal.csv", levels=list(point))]


@finding(
    DOUBT,
    "record-about-zero",
    "Write `signal.offset` with these levels and assess again, or add them to `signal.csv`.",
)
def _about_zero(kind: FindingKind, unknown: Mapping[int, float], offsets: Sequence[float]) -> list[Finding]:
    """The data vary about a level, the record about zero. The spec has no `signal.offset`."""
    at = " and ".join(f"u{j + 1} = {level:g}" for j, level in unknown.items())
    offset = f"{offsets[0]:g}" if len(offsets) == 1 else f"[{', '.join(f'{x:g}' for x in offsets)}]"
    remedy = f"Write signal.offset: {offset} and assess again, or add that to signal.csv."
    fact = f"the mean of the data is {at}"
    return kind.when(unknown, fact, where="signal.offset", remedy=remedy, offset=list(offsets))


def prior_left_out() -> Finding:
    """Return the finding that a prior without parameters does not count for a top-up either."""
    fact = "nor does the experiment below count on it: spec.yaml has the information of the data instead"
    return PRIOR_LEFT_OUT.found(fact, where="experiment.prior")
