"""A top-up varies about other levels than the data, or does not count on the prior."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, doubt, note
from inputdesign_cli.findings.other_systems import PRIOR_LEFT_OUT

# Times its own deviation: an input whose mean is farther from zero has a level.
_AWAY = 0.5

ABOUT_LEVELS = note(
    "about-an-operating-point",
    "The record varies about the operating point. `signal.csv` includes the levels that were subtracted "
    "from the data.",
    "Apply `signal.csv` unchanged.",
)
ABOUT_ZERO = doubt(
    "record-about-zero",
    "The data vary about a level, the record about zero. The recorded inputs have a mean far from zero, but "
    "the spec has no `signal.offset` for the top-up.",
    "Write `signal.offset` with these levels and assess again, or add them to `signal.csv`.",
)


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
    found = []
    if point is not None and levels:
        about = ", ".join(f"u{j + 1} = {level:g}" for j, level in enumerate(point))
        message = f"signal.csv varies about the operating point, {about}"
        found.append(ABOUT_LEVELS.found(message, where="signal.csv", levels=list(point)))
    if means is None or (point is not None and not levels):  # the spec states it
        return found
    unknown = {
        j: float(f"{mean:.4g}")
        for j, (mean, spread) in enumerate(zip(means, deviations, strict=True))
        if f"u{j + 1}" not in levels and abs(mean) > _AWAY * spread
    }
    if unknown:
        at = " and ".join(f"u{j + 1} = {level:g}" for j, level in unknown.items())
        offsets = [unknown.get(j, 0.0 if point is None else point[j]) for j in range(len(means))]
        offset = f"{offsets[0]:g}" if len(offsets) == 1 else f"[{', '.join(f'{x:g}' for x in offsets)}]"
        message = (
            f"the data lie about {at} (their mean), and signal.csv varies about zero there, since the spec "
            f"has no signal.offset: to apply it where the data were taken, write signal.offset: {offset} "
            "and assess again, or add that to signal.csv"
        )
        found.append(ABOUT_ZERO.found(message, where="signal.offset", offset=offsets))
    return found


def prior_left_out() -> Finding:
    """Return the finding that a prior without parameters does not count for a top-up either."""
    message = (
        "experiment.prior does not count for the experiment below either, since no verdict after it could "
        "rest on that: spec.yaml has the information of the data in its place"
    )
    return PRIOR_LEFT_OUT.found(message, where="experiment.prior")
