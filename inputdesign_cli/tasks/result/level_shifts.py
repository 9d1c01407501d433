"""What to say of an output that shifts and stays, as after a change of load that no input shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.identification import Estimate, LevelShift
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.runs.units import Units
from inputdesign_cli.tasks.build.data import Data
from inputdesign_cli.tasks.build.log import Log
from inputdesign_cli.tasks.result.faults import file_of, output_named, without_option
from inputdesign_cli.tasks.result.refutations import chance


def shifted_levels(units: Units, estimate: Estimate, data: Data) -> list[str]:
    """A sentence where an output shifts, if that explains more than what else tests found."""
    shift = estimate.shifted
    if shift is None or data.recorded is None:
        return []
    at, first, last = data.recorded.rows[[shift.sample, shift.begins, shift.ends - 1]].tolist()
    when = f"{data.time[shift.sample]:.6g} {units.time_unit}"
    name = file_of(data, shift.sample)
    return [
        f"{_told(shift, output_named(units, shift.output), at, when, name)}: did a load change? The model "
        "takes it for what the inputs do. Leave it out, which gives each part a level of its own: "
        f"{without_option([(name, first, last)])}; or log what changed as one more input"
    ]


def left_out(log: Log, shift: LevelShift, samples: NDArray[np.int64]) -> str:
    """What is said of a shift that is left out of a log.

    Args:
        samples: where those that the shift counts stand in the log.
    """
    at, first, last = samples[[shift.sample, shift.begins, shift.ends - 1]].tolist()
    rows = log.recorded.rows
    when = f"{log.time[at]:.6g} {log.time_unit}"
    ends = np.cumsum([count for _, count in log.files])
    name = log.files[int(np.searchsorted(ends, at, side="right"))][0] if len(log.files) > 1 else ""
    output = signal_name("y", shift.output, log.y.shape[1])
    return (
        f"{_told(shift, output, int(rows[at]), when, name)} (a change of load?): rows {rows[first]} to "
        f"{rows[last]} were left out, and each part has a level of its own; identify and assess need "
        f"{without_option([(name, rows[first], rows[last])])} for that"
    )


def _told(shift: LevelShift, output: str, row: int, when: str, name: str) -> str:
    return (
        f"{output} {'rises' if shift.rises else 'falls'} about row {row}{f' of {name}' if name else ''} "
        f"({when}), and stays so, though no input does that (probability "
        f"{chance(shift.test.probability)} by chance)"
    )
