"""A log in which an output shifts, whatever the inputs do, is explored without the samples in which it does.

Each part then has a level of its own, so that nothing need be known of what happened.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.errors import SpecError
from inputdesign_cli.explore import Found, explore_records
from inputdesign_cli.findings.level_shifts import left_out
from inputdesign_cli.records import Record

# Where more appear, once these are left out so often, the plant is another than any that is looked for.
_MOST = 2


def explored_beside_shifts(log: Record, *, loop: bool) -> tuple[Record, Found]:
    """The model that a log speaks for, and the log without the samples in which outputs shift.

    Nothing is left out where the rest does not tell a model, and judge it.

    Args:
        loop: whether inputs answer the outputs.

    Raises:
        SpecError: see `explore_records`.
    """

    def found_in(part: Record, *, unless_shifted: bool) -> Found:
        return explore_records(
            part.parts, feedback=loop, step=part.step, ramp=part.lined, unless_shifted=unless_shifted
        )

    rest, found = log, found_in(log, unless_shifted=True)
    for _ in range(_MOST):
        shifts = found.estimate.shifted
        if not shifts:
            return rest, found
        shifting = np.unique(np.concatenate([found.samples[one.begins : one.ends] for one in shifts]))
        less = rest.without(shifting)
        try:
            another = found_in(less, unless_shifted=True)
        except SpecError:
            break
        if another.split == "none" != found.split:
            break
        short = len(rest.y) - len(less.y) - len(shifting)
        told = left_out(rest, shifts, found.samples, rest.time_unit, short=short)
        rest, found = replace(less, remarks=(*rest.remarks, told)), another
    else:
        if not found.estimate.shifted:
            return rest, found
        rest = log
    return rest, found_in(rest, unless_shifted=False)
