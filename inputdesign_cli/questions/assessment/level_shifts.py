"""What to say of an output that shifts and stays, as after a change of load that no input shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.identification import Estimate, LevelShift, chance_of_shifts
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.questions.assessment.faults import file_of, without_option
from inputdesign_cli.questions.assessment.refutations import chance
from inputdesign_cli.tasks.build.data import Data
from inputdesign_cli.tasks.build.log import Log


def shifted_levels(estimate: Estimate, data: Data, time_unit: str) -> list[str]:
    """A sentence where outputs shift, if that explains more than what else tests found."""
    if not estimate.shifted or data.recorded is None:
        return []
    told, runs = _told(estimate.shifted, data, data.recorded.rows, np.arange(len(data.y)), time_unit)
    return [
        f"{told}: did a load change, or the gain? The model takes it for what the inputs do. Leave it out, "
        f"which gives each part a level of its own: {without_option(runs)}; or log what changed as one more "
        "input"
    ]


def left_out(log: Log, shifts: Sequence[LevelShift], samples: NDArray[np.int64], *, short: int) -> str:
    """What is said of shifts that are left out of a log.

    Args:
        samples: where those that the shifts count stand in the log.
        short: how many samples went with them, since what was left beside them was too short.
    """
    told, runs = _told(shifts, log, log.recorded.rows, samples, log.time_unit)
    listed = " and ".join(f"{first} to {last}{f' of {name}' if name else ''}" for name, first, last in runs)
    besides = f", with {short} samples beside them that are too few for a segment" if short else ""
    return (
        f"{told} (a change of load, or of the gain?): rows {listed} were left out{besides}, and each part "
        f"has a level of its own; identify and assess need {without_option(runs)} for that"
    )


def _told(
    shifts: Sequence[LevelShift],
    record: Data | Log,
    rows: NDArray[np.int64],
    samples: NDArray[np.int64],
    time_unit: str,
) -> tuple[str, list[tuple[str, int, int]]]:
    """What shifts when, and the file and rows of each.

    Args:
        rows: of all samples of the record.
        samples: where those that the shifts count stand in it.
    """
    events, runs = [], []
    for shift in sorted(shifts, key=lambda one: one.sample):
        at, first, last = samples[[shift.sample, shift.begins, shift.ends - 1]].tolist()
        name = file_of(record.files, at)
        output = signal_name("y", shift.output, record.y.shape[1])
        events.append(
            f"{output} {'rises' if shift.rises else 'falls'} about row {rows[at]}"
            f"{f' of {name}' if name else ''} ({record.time[at]:.6g} {time_unit})"
        )
        runs.append((name, int(rows[first]), int(rows[last])))
    return (
        f"{' and '.join(events)}, and stays so, though no input does that (probability "
        f"{chance(chance_of_shifts(shifts)[0])} by chance)",
        runs,
    )
