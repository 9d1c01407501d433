"""What to say of an output that shifts and stays, as after a change of load that no input shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.identification import Estimate, LevelShift, chance_of_shifts
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.runs.units import Units
from inputdesign_cli.tasks.build.data import Data
from inputdesign_cli.tasks.build.log import Log
from inputdesign_cli.tasks.result.faults import file_of, output_named, without_option
from inputdesign_cli.tasks.result.refutations import chance


def shifted_levels(units: Units, estimate: Estimate, data: Data) -> list[str]:
    """A sentence where outputs shift, if that explains more than what else tests found."""
    if not estimate.shifted or data.recorded is None:
        return []
    shifts = sorted(estimate.shifted, key=lambda one: one.sample)
    rows, told, runs = data.recorded.rows, [], []
    for shift in shifts:
        name = file_of(data, shift.sample)
        when = f"{data.time[shift.sample]:.6g} {units.time_unit}"
        told.append(_told(shift, output_named(units, shift.output), rows[shift.sample], when, name))
        runs.append((name, rows[shift.begins], rows[shift.ends - 1]))
    return [
        f"{_together(shifts, told)}: did a load change, or the gain? The model takes it for what the inputs "
        f"do. Leave it out, which gives each part a level of its own: {without_option(runs)}; or log what "
        "changed as one more input"
    ]


def left_out(log: Log, shifts: Sequence[LevelShift], samples: NDArray[np.int64]) -> str:
    """What is said of shifts that are left out of a log.

    Args:
        samples: where those that the shifts count stand in the log.
    """
    rows, told, runs = log.recorded.rows, [], []
    ends = np.cumsum([count for _, count in log.files])
    shifts = sorted(shifts, key=lambda one: one.sample)
    for shift in shifts:
        at, first, last = samples[[shift.sample, shift.begins, shift.ends - 1]].tolist()
        name = log.files[int(np.searchsorted(ends, at, side="right"))][0] if len(log.files) > 1 else ""
        when = f"{log.time[at]:.6g} {log.time_unit}"
        told.append(_told(shift, signal_name("y", shift.output, log.y.shape[1]), rows[at], when, name))
        runs.append((name, rows[first], rows[last]))
    listed = " and ".join(f"{first} to {last}{f' of {name}' if name else ''}" for name, first, last in runs)
    return (
        f"{_together(shifts, told)} (a change of load, or of the gain?): rows {listed} were left out, and "
        f"each part has a level of its own; identify and assess need {without_option(runs)} for that"
    )


def _told(shift: LevelShift, output: str, row: int, when: str, name: str) -> str:
    moves = "rises" if shift.rises else "falls"
    return f"{output} {moves} about row {row}{f' of {name}' if name else ''} ({when})"


def _together(shifts: Sequence[LevelShift], told: Sequence[str]) -> str:
    """What is told of each, and how probable all are by chance."""
    return (
        f"{' and '.join(told)}, and stays so, though no input does that (probability "
        f"{chance(chance_of_shifts(shifts)[0])} by chance)"
    )
