"""Find outputs that drift along one line through all records, in addition to the response to the inputs.

To remove lines from u and y separately is no remedy. The response of the plant to the input contains a line
of its own.
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.explore.sweep import Regressed, sweep, whitened, whitening

_HIGHEST = 3  # the highest order of the plant
# Longer records are averaged over stretches, since a line is slow.
_MOST_SAMPLES = 1500
# A line counts if its slope is _CERTAIN deviations from zero, by the likelihood ratio, and it rises by _RISES
# times its scatter.
_CERTAIN, _RISES = 3.5, 1.0
# A root of the noise that decays by fewer time constants within the records may be that of a random walk:
# a fit of further terms makes the residuals of a random walk look stationary.
_WALKS = 40.0


def slopes_of(parts: Parts, *, known: bool = False) -> Array:
    """Return the slopes (p,), per sample, of the lines along which outputs y (n, p) drift; zero for no line.

    If they are `known` to drift, any slope counts.
    """
    stretch = -(-sum(len(y) for _, y in parts) // _MOST_SAMPLES)
    long = [part for part in parts if len(part[1]) >= 10 * stretch]
    # Means over blocks; the samples after the last whole block are left out.
    short = [
        tuple(x[: len(x) // stretch * stretch].reshape(-1, stretch, x.shape[1]).mean(axis=1) for x in part)
        for part in long
    ]
    slopes = np.zeros(parts[0][1].shape[1])
    for i in range(slopes.size if short else 0):
        slopes[i] = _line([(u, y[:, i : i + 1]) for u, y in short], known) / stretch
    return slopes


def _line(parts: Parts, known: bool) -> float:
    """Return the slope of one output; zero unless it is far from none in noise of any colour.

    The residual of an output-error model with a line is whitened by an autoregression. A likelihood ratio of
    the whitened records decides. Its other model has a level without a line and a plant that is estimated
    anew: a plant that is slower than the record, or leaks, may explain an apparent line.
    """
    samples, longest = sum(len(y) for _, y in parts), max(len(y) for _, y in parts)
    highest = max(min(_HIGHEST, samples // 12), 1)
    best = sweep(parts, highest, line=True).best
    # A line that exceeds the range of the output is the response of a plant that integrates.
    reach = max(float(np.ptp(y)) for _, y in parts)
    if not np.isfinite(best.slope) or abs(best.slope) * longest >= reach:
        return 0.0
    if known:
        return best.slope
    if abs(best.slope) * samples < _RISES * float(np.sqrt(best.loss)):
        return 0.0
    errors = Regressed(parts, best.order, line=True).errors(best)
    A = whitening(errors)
    if float(np.max(np.roots(A).real, initial=0.0)) > 1.0 - _WALKS / samples:
        return 0.0
    white = whitened(parts, A) or parts  # all records may be too short for the filter
    line = sweep(white, highest, line=True).best
    level = Regressed(white, line.order).output_error(line.delays, line.F)
    undriven = Regressed([(u[:, :0], y) for u, y in white], line.order).output_error((), level.F)
    count, flat = sum(len(y) for _, y in white), np.concatenate([y - y.mean() for _, y in white])
    # If the output responds to no input, a slow decay from an initial state would explain any line.
    answered = _gain(undriven.loss, level.loss, count) > _CERTAIN**2
    without = level.loss if answered else float(np.mean(flat**2))
    return best.slope if _gain(without, line.loss, count) > _CERTAIN**2 else 0.0


def _gain(loss: float, less: float, samples: int) -> float:
    """Return twice the log likelihood ratio of two mean squares of white residuals: chi-squared by chance."""
    return samples * float(np.log(max(loss, 1e-300) / max(less, 1e-300)))


def levelled(parts: Parts, slopes: Array) -> list[tuple[Array, Array]]:
    """Return the records without lines of these slopes (p,); the middle of every record stays as it is."""
    return [(u, y - np.outer(np.arange(len(y)) - 0.5 * (len(y) - 1), slopes)) for u, y in parts]
