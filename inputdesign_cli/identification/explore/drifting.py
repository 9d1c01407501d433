"""Outputs that drift along a line: its slope is found beside the plant, before structures are compared.

Taking lines away from u and y, each by itself, would not do: what the plant makes of the input has a line of
its own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.errors import SpecError
from inputdesign_cli.identification.estimate import Estimate
from inputdesign_cli.identification.explore.fits import Parts, output_error_form
from inputdesign_cli.identification.explore.joint import Found, explored, moving_in
from inputdesign_cli.identification.explore.regression import best_delays, output_error
from inputdesign_cli.plant.polynomial import Array

_ORDERS, _ROUNDS, _MOST_DELAY = (1, 2, 3, 4, 5), 3, 150
# A mode that decays by fewer nepers than that over the longest record is like a line.
_DECAYS = 3.0


def explore_records(parts: Parts, *, feedback: bool = False, step: float = 1.0, ramp: bool = False) -> Found:
    """The model that records u (n, r), y (n, p) speak for, samples `step` apart.

    Where tests say that what is left drifts, lines are taken away from the outputs, if that helps.

    Args:
        feedback: whether u(t) may answer y(t).
        ramp: whether the outputs are known to drift along lines.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output` or `no-structure`.
    """
    _, moved = moving_in(parts)
    level = None if ramp else explored(parts, feedback=feedback, step=step, ramp=False)
    if level is not None and not (_drifts(level.estimate) or _hardly_decays(level)):
        return level
    slopes = slopes_of(moved)
    if level is not None and not _stand_out(slopes, level):
        return level
    try:
        even = explored(levelled(parts, slopes), feedback=feedback, step=step, ramp=True)
    except SpecError:
        if level is None:
            raise
        return level
    if level is None or (not _drifts(even.estimate) and _criterion(even, lines=1) < _criterion(level)):
        return replace(even, slopes=slopes)
    return level


def _drifts(estimate: Estimate) -> bool:
    return any(test.fault == "drift" for test in estimate.failed)


def _hardly_decays(found: Found) -> bool:
    """Whether the plant has a mode that lasts as long as a record, as a line of its own would look."""
    longest = max(len(y) for _, y in found.used)
    return output_error_form(found.model).radius > 1.0 - _DECAYS / longest


def _stand_out(slopes: Array, found: Found) -> bool:
    """Whether some line rises by more than the noise scatters, over the longest record."""
    longest = max(len(y) for _, y in found.used)
    return bool(np.any(np.abs(slopes) * longest > np.sqrt(np.diag(found.estimate.noise))))


def _criterion(found: Found, *, lines: int = 0) -> float:
    """BIC of the estimate from the whole record, with so many lines of each output."""
    samples, outputs = found.estimate.errors.shape
    unknowns = found.estimate.theta.size + lines * outputs * len(found.used)
    return float(samples * np.linalg.slogdet(found.estimate.noise)[1] + unknowns * np.log(samples))


def slopes_of(parts: Parts) -> Array:
    """(p,): what every output rises by from sample to sample whatever inputs do; zero if none can be told.

    By output-error models of several orders with a line; where it is gone, delays are looked for again.

    Args:
        parts: records u (n, r), y (n, p).
    """
    longest = max(len(y) for _, y in parts)
    most = max(min(_MOST_DELAY, longest // 6), 1)
    slopes = np.zeros(parts[0][1].shape[1])
    for i in range(slopes.size):
        own = [(u, y[:, i : i + 1]) for u, y in parts]
        # A line that goes beyond what the output does is that of a plant which integrates.
        reach = max(float(np.ptp(y)) for _, y in own)
        for _ in range(_ROUNDS):
            even = levelled(own, slopes[i : i + 1])
            delays = best_delays(even, 1, 2, most, (1,) * even[0][0].shape[1]).delays
            rises = [output_error(even, n, max(n, 2), delays, line=True).slope for n in _ORDERS]
            # A pole next to one takes the place of the line at some order, seldom at most of them.
            found = slopes[i] + float(np.median(rises))
            slopes[i] = found if np.isfinite(found) and abs(found) * longest < reach else 0.0
    return slopes


def levelled(parts: Parts, slopes: Array) -> list[tuple[Array, Array]]:
    """The records without lines of these slopes (p,), which leave the middle of every record as it is."""
    return [(u, y - np.outer(np.arange(len(y)) - 0.5 * (len(y) - 1), slopes)) for u, y in parts]
