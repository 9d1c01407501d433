"""About what the record of a top-up varies, where the inputs of the data lie at a level."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from inputdesign_cli.arrays import Array

# Times its own deviation: an input whose mean is farther from zero has a level.
_AWAY = 0.5


def level_notes(
    levels: Mapping[str, float], point: Sequence[float] | None, means: Array | None, deviations: Array
) -> list[str]:
    """What the user should know before the record is applied.

    Args:
        levels: by channel, what was taken away from the data.
        point: what the record varies about by input; None for zero.
        means: (r,), of the inputs as they were recorded; None: not known.
        deviations: (r,), of the inputs.
    """
    notes = []
    if point is not None and levels:
        about = ", ".join(f"u{j + 1} = {level:g}" for j, level in enumerate(point))
        notes.append(f"signal.csv varies about the operating point, {about}")
    if means is None or (point is not None and not levels):  # the spec states it
        return notes
    unknown = {
        j: float(f"{mean:.4g}")
        for j, (mean, spread) in enumerate(zip(means, deviations, strict=True))
        if f"u{j + 1}" not in levels and abs(mean) > _AWAY * spread
    }
    if unknown:
        at = " and ".join(f"u{j + 1} = {level:g}" for j, level in unknown.items())
        offsets = [unknown.get(j, 0.0 if point is None else point[j]) for j in range(len(means))]
        offset = f"{offsets[0]:g}" if len(offsets) == 1 else f"[{', '.join(f'{x:g}' for x in offsets)}]"
        notes.append(
            f"the data lie about {at} (their mean), and signal.csv varies about zero there, since the spec "
            f"has no signal.offset: to apply it where the data were taken, write signal.offset: {offset} "
            "and assess again, or add that to signal.csv"
        )
    return notes
