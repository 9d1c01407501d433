"""That a record is too short for what the plant delays: of what it causes too little comes before its end."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.information import Experiment
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.signal import Record

# The cost beyond that of the design, relative to it: the design tells nothing of such a record.
_HOPELESS = 1e3
# The share of the record from which on the dead time is the reason.
_SHARE = 0.8


def refuse_too_short(request: RecordRequest, experiment: Experiment, record: Record) -> None:
    """Raise `InfeasibleError` (`record-too-short`) for a record that is none of the design any more.

    Args:
        request: what was asked of the record.
        experiment: the one that was designed.
        record: the best that was found.
    """
    size = len(record.samples)
    late = experiment.memory > _SHARE * size * request.step
    untold = not np.isfinite(record.worst_ratio)
    if not (request.meets and late and (untold or record.extra_power > _HOPELESS)):
        return
    message = (
        f"no record of {size} samples tells all parameters apart: the dead time leaves too few of them"
        if untold
        else f"a record of {size} samples that meets the accuracy would cost {1.0 + record.extra_power:.2g} "
        "times what the designed spectrum does: the dead time leaves too little of it, and most of what it "
        "causes comes after the last one"
    )
    key = "experiment.samples" if request.samples is None else "signal.samples"
    section = key.partition(".")[0]
    hint = f"take more samples, {request.units.length(2 * size, section)} or more; or look at time_unit"
    raise InfeasibleError.because("record-too-short", message, hint, key)
