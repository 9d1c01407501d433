"""An output shifts and stays, as after a change of load that no input shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.finding import Finding, refuted
from inputdesign_cli.findings.places import Samples, file_of, of_file, without_option
from inputdesign_cli.identification import Estimate, LevelShift, chance_of_shifts
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.outcome.shares import chance

LEVEL_SHIFT = refuted(
    "level-shift",
    "An output shifts without an input. An output rises or falls at one time and stays there, though no "
    "input causes it. The model takes the shift for an effect of the inputs.",
    "Leave the shift out with `--without`, which gives each part its own level, or log what changed as one "
    "more input.",
)


def shifted_levels(estimate: Estimate, data: Samples, time_unit: str) -> list[Finding]:
    """Return a finding where outputs shift, if that explains more than what other tests found."""
    if not estimate.tests.shifted or data.recorded is None:
        return []
    every = np.arange(len(data.y))
    what, runs = _described(estimate.tests.shifted, data, data.recorded.rows, every, time_unit)
    message = (
        f"{what}: did a load change, or the gain? The model takes it for what the inputs do. Leave it out, "
        f"which gives each part a level of its own: {without_option(runs)}; or log what changed as one more "
        "input"
    )
    rows = [[first, last] for _, first, last in runs]
    return [LEVEL_SHIFT.found(message, probability=chance_of_shifts(estimate.tests.shifted)[0], rows=rows)]


def left_out(
    log: Samples, shifts: Sequence[LevelShift], samples: NDArray[np.int64], time_unit: str, *, short: int
) -> str:
    """Return the step of preparation that leaves shifts out of a log.

    Args:
        samples: positions in the log of the samples by which the shifts are numbered.
        short: how many more samples were left out, since the parts next to the shifts were too short.
    """
    rows = np.arange(len(log.y)) if log.recorded is None else log.recorded.rows
    what, runs = _described(shifts, log, rows, samples, time_unit)
    listed = " and ".join(f"{first} to {last}{f' of {name}' if name else ''}" for name, first, last in runs)
    besides = f", with {short} samples beside them that are too few for a segment" if short else ""
    return (
        f"{what} (a change of load, or of the gain?): rows {listed} were left out{besides}, and each part "
        f"has a level of its own; identify and assess need {without_option(runs)} for that"
    )


def _described(
    shifts: Sequence[LevelShift],
    record: Samples,
    rows: NDArray[np.int64],
    samples: NDArray[np.int64],
    time_unit: str,
) -> tuple[str, list[tuple[str, int, int]]]:
    """Return what shifts when, and the file and rows of each shift."""
    events, runs = [], []
    for shift in sorted(shifts, key=lambda one: one.sample):
        at, first, last = samples[[shift.sample, shift.begins, shift.ends - 1]].tolist()
        output = signal_name("y", shift.output, record.y.shape[1])
        events.append(
            f"{output} {'rises' if shift.rises else 'falls'} about row {rows[at]}{of_file(record, at)} "
            f"({record.time[at]:.6g} {time_unit})"
        )
        runs.append((file_of(record.files, at), int(rows[first]), int(rows[last])))
    return (
        f"{' and '.join(events)}, and stays so, though no input does that (probability "
        f"{chance(chance_of_shifts(shifts)[0])} by chance)",
        runs,
    )
