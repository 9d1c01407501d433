"""Outputs that drift: along a line, whose slope is found beside the plant, or as random walks do.

Taking lines away from u and y, each by itself, would not do: what the plant makes of the input has a line of
its own.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import SpecError
from inputdesign_cli.explore.fits import Parts, output_error_form
from inputdesign_cli.explore.integrated import like_random_walks
from inputdesign_cli.explore.joint import Found, criterion, explored
from inputdesign_cli.explore.moving import moving_in
from inputdesign_cli.explore.regression import best_delays, output_error

_ORDERS, _ROUNDS, _MOST_DELAY = (1, 2, 3, 4, 5), 3, 150
# Of longer records means over stretches tell a slope as well: a line is slow.
# Records with fewer such means tell none beside their own start.
_MOST_SAMPLES, _FEWEST = 4000, 10
# A record so long is dear to explain without a line that rises by so many times what is left beside it.
_LONG, _PLAIN = 20_000, 4.0
# A mode that decays by fewer nepers than that over the longest record is like a line.
_DECAYS = 3.0
# Noise about a level is believed where it is so much likelier, by BIC: twenty times.
_AS_LIKELY = 2.0 * float(np.log(20.0))


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


def explore_records(
    parts: Parts,
    *,
    feedback: bool = False,
    step: float = 1.0,
    ramp: bool = False,
    unless_shifted: bool = False,
) -> Found:
    """The model that records u (n, r), y (n, p) speak for, samples `step` apart.

    Where tests say that what is left drifts, lines are taken away from the outputs, if that helps. Where it
    may be a random walk, noise that integrates is tried as well ([ljung-1999], Section 14.1).

    Args:
        feedback: whether u(t) may answer y(t).
        ramp: whether the outputs are known to drift along lines.
        unless_shifted: whether to look for neither where an output shifts and stays: a model about levels
            tells where.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output` or `no-structure`.
    """
    level = _about_levels(parts, feedback=feedback, step=step, ramp=ramp, unless_shifted=unless_shifted)
    if unless_shifted and level.estimate.shifted:
        return level
    # In a loop the noise is estimated with every structure.
    which = [] if feedback else _may_wander(level)
    if not any(which):
        return level
    try:
        walk = explored(parts, feedback=False, step=step, ramp=ramp, wanders=which)
    except SpecError:
        return level
    more = _criterion(walk) - _criterion(level)
    # What a walk leaves of the gain at low frequencies is the less of the two, and the safer claim.
    if more >= _AS_LIKELY or not walk.steady:
        return level
    # A mode as slow as the record has taken the walk for its own, and says nothing of the plant.
    return replace(walk, rival=level.model if more > 0.0 and not _hardly_decays(level) else None)


def _about_levels(parts: Parts, *, feedback: bool, step: float, ramp: bool, unless_shifted: bool) -> Found:
    """The same, noise about levels and lines being the only one."""
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
                if not any(_drifting(even)):
                    return even
    level = explored(parts, feedback=feedback, step=step, ramp=False)
    shifted = unless_shifted and bool(level.estimate.shifted)
    if shifted or not (any(_drifting(level)) or _hardly_decays(level)):
        return level
    lines = lines_of(moved).beyond(np.sqrt(np.diag(level.estimate.noise)), longest)
    if not np.any(lines.slopes):
        return level
    try:
        even = _even(parts, lines, feedback=feedback, step=step)
    except SpecError:
        return level
    return even if _criterion(even) < _criterion(level) and not any(_drifting(even)) else level


def _even(parts: Parts, lines: Lines, *, feedback: bool, step: float) -> Found:
    """What records without these lines tell; what is left of lines is estimated along."""
    found = explored(levelled(parts, lines.slopes), feedback=feedback, step=step, ramp=True)
    return replace(found, slopes=lines.slopes)


def _drifting(found: Found) -> list[bool]:
    """Of each output whether tests say that its residuals drift."""
    outputs = {test.output for test in found.estimate.failed if test.fault == "drift"}
    return [i in outputs for i in range(found.model.outputs)]


def _may_wander(found: Found) -> list[bool]:
    """Of each output whether what is left of it may be a random walk, or may be hidden in lines and modes."""
    if _hardly_decays(found):
        return [True] * found.model.outputs
    slopes = np.zeros(found.model.outputs) if found.slopes is None else found.slopes
    y, ends = np.concatenate([y for _, y in found.used]), np.cumsum([len(y) for _, y in found.used])[:-1]
    left = np.split(y - found.estimate.simulated, ends)
    return [any(told) for told in zip(_drifting(found), slopes != 0.0, like_random_walks(left), strict=True)]


def _hardly_decays(found: Found) -> bool:
    """Whether the plant has a mode that lasts as long as a record, as a line of its own would look."""
    longest = max(len(y) for _, y in found.used)
    return output_error_form(found.model).radius > 1.0 - _DECAYS / longest


def _criterion(found: Found) -> float:
    lines = 0 if found.slopes is None else found.model.outputs * len(found.used)
    return criterion(found.taken, found.estimate, lines=lines)


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
