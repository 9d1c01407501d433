"""No record was found that meets the accuracy: how near one came, and what would do."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.response_lines import UnreachableError
from inputdesign_cli.errors import Diagnostic, InfeasibleError
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome.shares import rounded_up
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.infeasible import contradictory, named
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.signal.selection import Record

# The cost beyond that of the design, relative to it, from which on a record has nothing to do with it.
_HOPELESS = 1e3
# The share of the record from which on the dead time is the reason.
_SHARE = 0.8


def refuse_too_short(request: RecordRequest, experiment: Experiment, record: Record) -> None:
    """Raise `InfeasibleError` (`record-too-short`) if dead times take nearly all of a record."""
    size = len(record.samples)
    late = experiment.memory > _SHARE * size * request.step
    undetermined = not np.isfinite(record.worst_ratio)
    if not (request.meets and late and (undetermined or record.extra_power > _HOPELESS)):
        return
    message = (
        f"no record of {size} samples determines all parameters: the dead time takes too many of them"
        if undetermined
        else f"a record of {size} samples that meets the accuracy would cost {1.0 + record.extra_power:.2g} "
        "times what the designed spectrum does: the dead time takes too much of it, and most of what it "
        "causes comes after its last sample"
    )
    key = "experiment.samples" if request.samples is None else "signal.samples"
    section = key.partition(".")[0]
    hint = f"take more samples, {request.units.length(2 * size, section)} or more; or look at time_unit"
    raise InfeasibleError.because("record-too-short", message, hint, key)


def no_record(request: RecordRequest, samples: int, best: str, hint: str) -> InfeasibleError:
    """Return the error `limits-too-tight`: what the best record of this length that was tried reaches."""
    keys = request.limit_keys
    message = f"no record of {samples} samples within {' and '.join(keys)} was found that {best}"
    return InfeasibleError.because("limits-too-tight", message, hint, keys[0])


def unreachable(units: Units, error: UnreachableError, samples: int) -> InfeasibleError:
    """Return the error that limits exclude the accuracy, with the numbers of the spec that would do."""
    factor, limits = error.factor, tuple(dict.fromkeys(error.limits))
    if not np.isfinite(factor):
        return contradictory(limits, "contradict each other: no powers of these lines keep all of them")
    exhausted = " and ".join(dict.fromkeys(map(named, limits)))
    needed = (f"{limit.key} to {rounded_up(_raised(limit, factor))}" for limit in limits)
    more, times = int(np.ceil(samples * factor**2)), rounded_up(factor, 4)
    message = f"the limits buy standard deviations {times} times those admitted; the {exhausted} is exhausted"
    hint = (
        f"raise {' and '.join(needed)}, count {more} samples in place of {samples} "
        f"({units.length(more).split(':')[0]}), or admit {times} times as much"
    )
    details = {"factor": factor}
    return InfeasibleError(Diagnostic("infeasible", message, hint, limits[0].key, details=details))


def _raised(limit: PowerLimit, factor: float) -> float:
    """Return the number of the spec at which deviations are smaller by `factor`."""
    return factor * limit.bound**0.5 if limit.implied else factor**2 * limit.bound


def too_long(units: Units, length: int, most: int) -> InfeasibleError:
    """Return the error that the shortest record is longer than limits allow."""
    limit = units.length(length, "limits")
    return InfeasibleError.because(
        "too-long",
        f"the shortest record of whole periods takes {length} samples, transient included, and {most} "
        "are allowed",
        f"write {limit}, allow more power, or ask for less accuracy",
        limit.split(":")[0],
    )
