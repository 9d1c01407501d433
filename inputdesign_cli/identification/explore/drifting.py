"""Outputs that drift along a line: its slope is found beside the plant, before structures are compared.

Taking lines away from u and y, each by itself, would not do: what the plant makes of the input has a line of
its own.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.errors import SpecError
from inputdesign_cli.identification.estimate import Estimate
from inputdesign_cli.identification.explore.fits import Parts, output_error_form
from inputdesign_cli.identification.explore.joint import Found, explored, moving_in
from inputdesign_cli.identification.explore.regression import best_delays, output_error
from inputdesign_cli.plant.polynomial import Array

_ORDERS, _ROUNDS, _MOST_DELAY = (1, 2, 3, 4, 5), 3, 150
# Of longer records means over stretches tell a slope as well: a line is slow.
# Records with fewer such means tell none beside their own start.
_MOST_SAMPLES, _FEWEST = 4000, 10
# A record so long is dear to explain without a line that rises by so many times what is left beside it.
_LONG, _PLAIN = 20_000, 4.0
# A mode that decays by fewer nepers than that over the longest record is like a line.
_DECAYS = 3.0


@dataclass(frozen=True)
class Lines:
    """What outputs rise by whatever inputs do.

    Attributes:
        slopes: (p,), from sample to sample; zero where none can be told.
        scatter: (p,), root mean square of what output-error models with these lines leave.
    """

    slopes: Array
    scatter: Array

    def beyond(self, least: Array, longest: int) -> Lines:
        """Those lines that rise by more than `least` (p,) within so many samples; the others are level."""
        return replace(self, slopes=np.where(np.abs(self.slopes) * longest > least, self.slopes, 0.0))


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
    longest, samples = max(len(y) for _, y in moved), sum(len(y) for _, y in moved)
    if ramp or samples > _LONG:
        lines = lines_of(moved)
        lines = lines.beyond(lines.scatter * (1.0 if ramp else _PLAIN), longest)
        if ramp:
            return _even(parts, lines, feedback=feedback, step=step)
        with suppress(SpecError):
            if np.any(lines.slopes):
                even = _even(parts, lines, feedback=feedback, step=step)
                if not _drifts(even.estimate):
                    return even
    level = explored(parts, feedback=feedback, step=step, ramp=False)
    if not (_drifts(level.estimate) or _hardly_decays(level)):
        return level
    lines = lines_of(moved).beyond(np.sqrt(np.diag(level.estimate.noise)), longest)
    if not np.any(lines.slopes):
        return level
    try:
        even = _even(parts, lines, feedback=feedback, step=step)
    except SpecError:
        return level
    better = _criterion(even, lines=1) < _criterion(level)
    return even if better and not _drifts(even.estimate) else level


def _even(parts: Parts, lines: Lines, *, feedback: bool, step: float) -> Found:
    """What records without these lines tell; what is left of lines is estimated along."""
    found = explored(levelled(parts, lines.slopes), feedback=feedback, step=step, ramp=True)
    return replace(found, slopes=lines.slopes)


def _drifts(estimate: Estimate) -> bool:
    return any(test.fault == "drift" for test in estimate.failed)


def _hardly_decays(found: Found) -> bool:
    """Whether the plant has a mode that lasts as long as a record, as a line of its own would look."""
    longest = max(len(y) for _, y in found.used)
    return output_error_form(found.model).radius > 1.0 - _DECAYS / longest


def _criterion(found: Found, *, lines: int = 0) -> float:
    """BIC of the estimate from the whole record, with so many lines of each output."""
    samples, outputs = found.estimate.errors.shape
    unknowns = found.estimate.theta.size + lines * outputs * len(found.used)
    return float(samples * np.linalg.slogdet(found.estimate.noise)[1] + unknowns * np.log(samples))


def lines_of(parts: Parts) -> Lines:
    """The line that every output drifts along, whatever inputs do.

    By output-error models of several orders with a line; where it is gone, delays are looked for again.

    Args:
        parts: records u (n, r), y (n, p).
    """
    outputs = parts[0][1].shape[1]
    stretch = -(-sum(len(y) for _, y in parts) // _MOST_SAMPLES)
    if stretch > 1:
        short = [_means(*part, stretch) for part in parts if len(part[1]) >= _FEWEST * stretch]
        if not short:
            return Lines(np.zeros(outputs), np.full(outputs, np.inf))
        found = lines_of(short)
        return replace(found, slopes=found.slopes / stretch)
    longest = max(len(y) for _, y in parts)
    most = max(min(_MOST_DELAY, longest // 6), 1)
    slopes, scatter = np.zeros((2, outputs))
    for i in range(outputs):
        own = [(u, y[:, i : i + 1]) for u, y in parts]
        # A line that goes beyond what the output does is that of a plant which integrates.
        reach = max(float(np.ptp(y)) for _, y in own)
        for _ in range(_ROUNDS):
            even = levelled(own, slopes[i : i + 1])
            delays = best_delays(even, 1, 2, most, (1,) * even[0][0].shape[1]).delays
            tried = [output_error(even, n, max(n, 2), delays, line=True) for n in _ORDERS]
            # A pole next to one takes the place of the line at some order, seldom at most of them.
            found = slopes[i] + float(np.median([model.slope for model in tried]))
            slopes[i] = found if np.isfinite(found) and abs(found) * longest < reach else 0.0
            scatter[i] = np.sqrt(np.median([model.loss for model in tried]))
    return Lines(slopes, scatter)


def _means(u: Array, y: Array, stretch: int) -> tuple[Array, Array]:
    """Over stretches of so many samples, the last samples left out that do not make one."""
    whole = len(y) // stretch * stretch
    means = (x[:whole].reshape(-1, stretch, x.shape[1]).mean(axis=1) for x in (u, y))
    return next(means), next(means)


def levelled(parts: Parts, slopes: Array) -> list[tuple[Array, Array]]:
    """The records without lines of these slopes (p,), which leave the middle of every record as it is."""
    return [(u, y - np.outer(np.arange(len(y)) - 0.5 * (len(y) - 1), slopes)) for u, y in parts]
