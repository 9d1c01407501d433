"""Detect an output that shifts and stays there without a cause in the inputs, as after a change of load.

The shift is a step, or a step smoothed by a lag, from any sample on until the record ends ([tsay-1988]).
Scores of all of them are correlations of the residuals with one response: a test for every sample costs no
more than a few transforms. A test of trends shares its power among many signals, and hardly notices a single
event. The estimate takes the shift for another gain and slower dynamics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.adequacy import ScoreTest, score
from inputdesign_cli.identification.records import Point, Records
from inputdesign_cli.identification.white import White
from inputdesign_cli.levels import level

# Time constants of the lags: the shortest in samples, their ratio, the longest as a share of the record.
_SHORTEST, _GROWTH, _SHARE = 4.0, 4.0, 0.125
# The largest number of shifts that are reported.
_MOST = 6
# A shift within this number of samples of an end of a record is its start, or a few wrong samples.
_FEWEST = 5
# A shift of which the estimate explains all but this share cannot be seen.
_EXPLAINED = 1e-3
# The largest share of the squares that a shift explains, so that the rest stays positive.
_MOST_EXPLAINED = 1.0 - 1e-9
# Time constants until a lag has settled, and by which its beginning is uncertain.
_SETTLED, _UNSURE = 3.0, 0.5


@dataclass(frozen=True)
class LevelShift:
    """The likeliest shift of an output."""

    output: int  # from zero
    sample: int  # its likeliest first sample, counted through all records
    lag: float  # the time constant of its lag, in samples; zero for a step
    begins: int  # it likely begins no earlier than this sample
    ends: int  # it has likely settled from this sample on
    rises: bool  # whether the output is larger after it
    test: ScoreTest  # likelihood-ratio test, corrected for every sample, lag and output that was tried
    score: float  # the score statistic, which is smaller; it is the largest of `looks` statistics
    looks: int
    alone: bool  # whether it explains more than a line through its record, or single samples next to it

    @property
    def refutes(self) -> bool:
        """Return whether a model without it is refuted."""
        return self.alone and self.test.probability < level("level shift")


def level_shifts(
    records: Records, point: Point, white: White
) -> tuple[LevelShift | None, tuple[LevelShift, ...], White]:
    """Return the likeliest shift, all shifts that refute the model, and the estimate with these removed.

    The first is None in records that are too short for any.
    """
    first, found = level_shift(records, point, white), list[LevelShift]()
    shift = first
    while shift is not None and shift.refutes and len(found) < _MOST:
        found.append(shift)
        begin, length = next(one for one in _stretches(records) if shift.sample < sum(one))
        after = _smooth(begin + length - shift.sample, shift.lag)
        white = white.without(_column(records, point.theta, white, shift.sample, after, shift.output))
        shift = level_shift(records, point, white)
    return first, tuple(found), white


def chance_of_shifts(shifts: Sequence[LevelShift]) -> tuple[float, float]:
    """Return the probability that all these shifts are chance, by the likelihood ratio and by the score."""
    ratios, looks = [shift.test.statistic for shift in shifts], shifts[0].looks
    return _by_chance(ratios, looks), _by_chance([shift.score for shift in shifts], looks)


def _by_chance(statistics: Sequence[float], looks: int) -> float:
    """Return the probability of a sum of statistics as large by chance, each the largest of `looks`."""
    size = len(statistics)
    return min(float(looks) ** size * float(scipy.special.chdtrc(size, sum(statistics))), 1.0)


def level_shift(records: Records, point: Point, white: White) -> LevelShift | None:
    """Return the likeliest shift; None in records that are too short for any."""
    found: list[tuple[float, int, int, float, bool, bool]] = []
    # A step, then ever longer lags.
    lags = [0.0, *(x for k in range(12) if (x := _SHORTEST * _GROWTH**k) <= _SHARE * records.longest)]
    stretches, outputs = _stretches(records), records.y.shape[1]
    through = _responses(records, point.theta, lags, white)
    for (begin, length), output in product(stretches, range(outputs)):
        inner = slice(_FEWEST, length - _FEWEST)
        of_sample, _ = _scores(white, begin, output, through[output, :length, -1])
        straight = _column(records, point.theta, white, begin, np.linspace(-1.0, 1.0, length), output)
        line = score(white, straight, np.zeros(1)).statistic
        for lag, response in zip(lags, through[output, :length, :-1].T, strict=True):
            scores, rises = _scores(white, begin, output, response)
            at = _FEWEST + int(np.argmax(scores[inner]))
            near = slice(max(at - int(lag) - _FEWEST, 0), at + int(lag) + _FEWEST)
            alone = scores[at] > max(line, float(np.max(of_sample[near])))
            found.append((float(scores[at]), output, begin + at, lag, bool(rises[at] > 0.0), bool(alone)))
    if not found:
        return None
    largest, output, sample, lag, rising, alone = max(found)
    # The likelihood ratio of one linear regressor. A large shift has made the noise look larger in the score.
    power = float(white.residuals @ white.residuals) / outputs
    share = min(largest * white.variance / power, _MOST_EXPLAINED)
    statistic = -float(np.log1p(-share)) * point.freedom / outputs
    looks = sum(length for _, length in stretches) * outputs * len(lags)
    test = ScoreTest("level_shift", "shift", statistic, 1, _by_chance([statistic], looks), None, output)
    begin, length = next(one for one in stretches if sample < sum(one))
    begins = max(sample - 1 - round(_UNSURE * lag), begin)
    ends = min(sample + 2 + round(_SETTLED * lag), begin + length)
    return LevelShift(output, sample, lag, begins, ends, rising, test, largest, looks, alone)


def _stretches(records: Records) -> list[tuple[int, int]]:
    """Return the first sample and the number of samples of each record; too short ones are passed over."""
    begins = np.cumsum([0, *records.lengths])[:-1].tolist()
    return [one for one in zip(begins, records.lengths, strict=True) if one[1] > 2 * _FEWEST]


def _smooth(samples: int, lag: float) -> Array:
    """Return the response (samples,) of a lag to a step at the first sample."""
    return -np.expm1(-np.arange(1.0, samples + 1.0) / lag) if lag else np.ones(samples)


def _responses(records: Records, theta: Array, lags: Sequence[float], white: White) -> Array:
    """Return the responses (p, n, m) to lagged steps and to a pulse, in errors of the longest record."""
    at, length = int(np.argmax(records.lengths)), records.longest
    begin = sum(records.lengths[:at])
    every = np.zeros((records.samples, len(lags) + 1))
    signals = [*(_smooth(length, lag) for lag in lags), np.eye(1, length)[0]]
    every[begin : begin + length] = np.column_stack(signals)
    through = records.whitened(theta, every)
    if white.whitening is not None:
        through = white.whitening.through(through.transpose(2, 1, 0)).transpose(2, 1, 0)
    return through[:, begin : begin + length]


def _scores(white: White, begin: int, output: int, response: Array) -> tuple[Array, Array]:
    """Return score statistics (n,) of a response (n,) begun at every sample of a record, and their signs.

    A score is the correlation of residuals and response, which is in the errors of one output. Its power
    counts without the part that the estimate explains.
    """
    size, outputs = len(response), len(white.root)
    rows = slice(begin * outputs, (begin + size) * outputs)

    def common(signals: Array) -> Array:
        """Return products (n, m) of the response, begun at every sample, with signals (n p, m)."""
        own = np.einsum("npm,p->nm", signals.reshape(size, outputs, -1), white.root[:, output])
        return np.asarray(scipy.signal.fftconvolve(own[::-1], response[:, None], axes=0)[:size][::-1])

    power = np.cumsum(response**2)[::-1] * float(white.root[:, output] @ white.root[:, output])
    explained = common(white.basis[rows])
    left = power - np.sum(explained**2, axis=1)
    # If a search ends at a kink, residuals are not orthogonal to all gradients.
    along = common(white.residuals[rows, None])[:, 0] - explained @ (white.basis.T @ white.residuals)
    seen = left > _EXPLAINED * power
    return np.where(seen, along**2 / np.where(seen, left, 1.0), 0.0) / white.variance, along


def _column(records: Records, theta: Array, white: White, begin: int, signal: Array, output: int) -> Array:
    """Return the errors ((N + M) p, 1) due to a signal (n,) in one output, in units of the noise."""
    every, own = np.zeros((records.samples, 1)), np.zeros((1, *records.y.shape))
    every[begin : begin + len(signal), 0] = signal
    own[0, :, output] = records.whitened(theta, every)[output, :, 0]
    return white.columns(own)
