"""That no record was found within the limits on single samples: how near one came, and what would do."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.signal import Record


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
    """The error `limits-too-tight`.

    Args:
        missed: the best record of the length that was asked for.
        longer: one that would do, where one was found.
        most_samples: the longest experiment, where one is looked for.
        tried: spectra by kind of signal, besides.
        remedy: what else would do.
        needed: samples that would do were information in proportion to them.
        searched: the longest that was looked for.
        longest_tried: the longest that was tried.
        ended: whether the search for longer ones ended for its time.
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
