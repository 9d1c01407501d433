"""When the limits on single samples leave too little power: the shortest experiment that can, or why none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.errors import Diagnostic, InfeasibleError
from inputdesign_cli.signal import Record
from inputdesign_cli.specification import Spec

_LONGEST = 64  # times the length that was asked for
_CANDIDATES = 1
_GROWTH = 1.1
_FINE = 0.01


def shortest_record(
    spec: Spec, design: Design, missed: Record, block: int, made: Callable[..., Record]
) -> Record:
    """For `shortest_experiment` the longer record; otherwise the error that says how long it would be.

    The longer record has the shape of the designed spectrum at the lower power that it then needs.

    Raises:
        InfeasibleError: `limits-too-tight`.
    """
    found = _search(missed, block, made)
    seeking = design.problem.goal == "samples" and spec.signal.samples is None
    most = spec.limits.samples
    if seeking and found is not None and (most is None or len(found.samples) <= most):
        return found
    raise _complaint(spec, design, missed, found)


def _search(missed: Record, block: int, made: Callable[..., Record]) -> Record | None:
    """The shortest record that meets the demand, to one per cent, by trying; None when none does.

    A record at its limits gathers information in proportion to its length: that is where the search begins.
    """
    start = len(missed.samples)
    low, high = start, _rounded(max(_expected(missed), _GROWTH * start), block)
    if high > _LONGEST * start:
        return None
    found = made(high, _CANDIDATES)
    while not found.met:
        if high >= _LONGEST * start:
            return None
        low, high = high, _rounded(high * _GROWTH, block)
        found = made(high, _CANDIDATES)
    shorter = _rounded(high / _GROWTH, block)
    while low < shorter < high:
        tried = made(shorter, _CANDIDATES)
        if not tried.met:
            low = shorter
            break
        high, found, shorter = shorter, tried, _rounded(shorter / _GROWTH, block)
    while high - low > max(_FINE * high, block):
        middle = _rounded(0.5 * (low + high), block)
        if middle in (low, high):
            break
        tried = made(middle, _CANDIDATES)
        if tried.met:
            high, found = middle, tried
        else:
            low = middle
    return found


def _expected(missed: Record) -> float:
    """The length that the record needs, were its information in proportion to its length."""
    return len(missed.samples) * (missed.worst_ratio**2 if np.isfinite(missed.worst_ratio) else 1.0)


def _power(record: Record) -> float:
    """Of all inputs."""
    return float(np.sum(np.mean(record.samples**2, axis=0)))


def _rounded(length: float, block: int) -> int:
    return int(np.ceil(length / block)) * block


def _complaint(spec: Spec, design: Design, missed: Record, found: Record | None) -> InfeasibleError:
    limits = spec.limits
    keys = [f"limits.{name}" for name in ("amplitude", "rate") if getattr(limits, name) is not None]
    if spec.signal.quantisation is not None:
        keys.append("signal.quantisation")
    names = " and ".join(keys)
    size = len(missed.samples)
    message = (
        f"no record of {size} samples within {names} meets the accuracy: the best found reaches "
        f"r_u / r_adm = {missed.worst_ratio:.4g} with power {_power(missed):.4g}"
        if np.isfinite(missed.worst_ratio)
        else f"no record of {size} samples within {names} excites every parameter"
    )
    if found is None:
        hint = (
            f"raise the limits: about {_expected(missed):.3g} samples would be needed"
            if _expected(missed) > _LONGEST * size
            else f"raise the limits: {_LONGEST} times as many samples were not enough either"
        )
    else:
        hint = (
            f"{len(found.samples)} samples can (power {_power(found):.4g}): set "
            f"experiment.samples and signal.samples, raise the limits, or loosen the accuracy"
        )
        if limits.samples is not None and len(found.samples) > limits.samples:
            hint += f"; limits.samples is {limits.samples}"
    return InfeasibleError(Diagnostic("limits-too-tight", message, hint, keys[0], spec.locate(keys[0])))
