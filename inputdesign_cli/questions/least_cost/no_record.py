"""No record was found that meets the accuracy: how near one came, and what would do."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.information import Experiment
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.signal import Record

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


def too_tight(
    request: RecordRequest,
    missed: Record,
    longer: Record | None,
    most_samples: int | None,
    *,
    tried: Mapping[str, int],
    remedy: str = "",
    needed: float,
    searched: int,
    longest_tried: int,
    ended: bool = False,
) -> InfeasibleError:
    """Return the error `limits-too-tight`.

    Args:
        missed: the best record of the length that was asked for.
        longer: one that would do, if one was found.
        most_samples: the longest experiment, if the shortest is looked for.
        tried: the number of other spectra by kind of signal.
        remedy: what else would do.
        needed: samples that would do were information in proportion to them.
        searched: the longest that was looked for.
        longest_tried: the longest that was tried.
        ended: whether the time was over before longer ones were tried.
    """
    names = " and ".join(request.limit_keys)
    size = len(missed.samples)
    message = (
        f"no record of {size} samples within {names} was found that meets the accuracy: the best of those "
        f"tried reaches r_u / r_adm = {missed.worst_ratio:.4g} with power {missed.power:.4g}"
        if np.isfinite(missed.worst_ratio)
        else f"no record of {size} samples within {names} was found that excites every parameter"
    )
    kinds = [f"{kind} of {count} {'spectrum' if count == 1 else 'spectra'}" for kind, count in tried.items()]
    if kinds:
        message += f"; tried besides: {', '.join(kinds)}"
    if longer is not None:
        samples = len(longer.samples)
        length = request.units.length(samples, "limits") if most_samples else request.units.length(samples)
        hint = (
            f"{samples} samples can (power {longer.power:.4g}): set {length} (and signal.samples, if "
            "stated), raise the limits, or loosen the accuracy"
        )
    elif searched < needed < np.inf:
        hint = (
            f"raise the limits: a record of the kinds that were tried would take about {needed:.3g} samples"
        )
    else:
        hint = "raise the limits"
        if longest_tried > size:
            hint += f": none of those tried with up to {longest_tried} samples does either"
    if ended:
        hint += "; longer records were not looked for further"
    hint = "; or ".join(text for text in (hint, remedy) if text)
    return InfeasibleError.because("limits-too-tight", message, hint, request.limit_keys[0])
