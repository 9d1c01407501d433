"""When the limits on single samples leave too little power: the shortest experiment that can, or why none."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.runs.units import Units
from inputdesign_cli.signal import Record

_LONGEST = 64  # times the length that was asked for
_CANDIDATES = 1
_GROWTH = 1.1
_FINE = 0.01


class MakeRecord(Protocol):
    """Makes the best record of a length, of so many candidates."""

    def __call__(self, samples: int, candidates: int | None = None) -> Record:
        """The best record of `samples`; `candidates` are as many as usual when not given."""


def shortest_record(
    missed: Record,
    block: int,
    made: MakeRecord,
    most_samples: int | None,
    longest: int,
    limit_keys: Sequence[str],
    units: Units,
) -> Record:
    """The longer record that does what `missed` does not, or the error that says how long it would be.

    The longer record has the shape of the designed spectrum at the lower power that it then needs.

    Args:
        block: its length is a multiple of this.
        most_samples: the longest that may be delivered; None for any, 0 when no other length is wanted.
        longest: samples of the longest record that is computed at all.
        limit_keys: of the spec, for what limits single samples.
        units: in which lengths are told.

    Raises:
        InfeasibleError: `limits-too-tight`.
    """
    found = _search(missed, block, made, min(_LONGEST * len(missed.samples), longest))
    if found is not None and (most_samples is None or len(found.samples) <= most_samples):
        return found
    raise _too_tight(missed, found, most_samples, limit_keys, units)


def _search(missed: Record, block: int, made: MakeRecord, longest: int) -> Record | None:
    """The shortest record that meets the target, to one per cent, by trying; None when none does.

    A record at its limits gathers information in proportion to its length: that is where the search begins.
    """
    start = len(missed.samples)
    low, high = start, _rounded(max(_expected(missed), _GROWTH * start), block)
    if high > longest:
        return None
    found = made(high, _CANDIDATES)
    while not found.met:
        low, high = high, _rounded(high * _GROWTH, block)
        if high > longest:
            return None
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


def _rounded(length: float, block: int) -> int:
    return int(np.ceil(length / block)) * block


def _too_tight(
    missed: Record, found: Record | None, most_samples: int | None, limit_keys: Sequence[str], units: Units
) -> InfeasibleError:
    names = " and ".join(limit_keys)
    size = len(missed.samples)
    message = (
        f"no record of {size} samples within {names} was found that meets the accuracy: the best of those "
        f"tried reaches r_u / r_adm = {missed.worst_ratio:.4g} with power {missed.power:.4g}"
        if np.isfinite(missed.worst_ratio)
        else f"no record of {size} samples within {names} was found that excites every parameter"
    )
    if found is None:
        hint = (
            f"raise the limits: about {_expected(missed):.3g} samples would be needed"
            if _expected(missed) > _LONGEST * size
            else f"raise the limits: {_LONGEST} times as many samples were not enough either"
        )
    else:
        samples = len(found.samples)
        set_to = units.length(samples, "limits") if most_samples else units.length(samples)
        hint = (
            f"{samples} samples can (power {found.power:.4g}): set {set_to} (and signal.samples, if stated), "
            "raise the limits, or loosen the accuracy"
        )
    return InfeasibleError.because("limits-too-tight", message, hint, limit_keys[0])
