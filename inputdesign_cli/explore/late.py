"""Answers that come later than delays are looked for: by what is new in u and y, or by the output error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.explore.inputs import past, untold
from inputdesign_cli.explore.regression import SharedDenominator, output_error
from inputdesign_cli.identification.late_inputs import behind

_ORDER = 20
# The probability of a correlation as large by chance, at all lags together.
_CERTAIN = 1e-6
# Inputs that move together, or again and again in the same way, are also answered late by half of the best.
_CLEARLY = 2.0
# How many late lags are tried, the samples that must be left behind them, and what they must gain in BIC.
_TRIED, _FEWEST, _BETTER = 80, 20, 15.0


def late_answers(parts: Parts, most: int) -> tuple[int, ...]:
    """Of each input the lag beyond `most` at which the output answers it; zero where it does so before.

    What their own past does not tell of input and output goes together at the dead time, and for a few
    samples more. Lags to two thirds of the longest record are looked at.

    Args:
        parts: records u (n, r), y (n, 1).
    """
    order = max(min(_ORDER, max(len(y) for _, y in parts) // 10), 1)
    long = [(u - u.mean(axis=0), y - y.mean(axis=0)) for u, y in parts if len(y) > 4 * order]
    if not long:
        return (0,) * parts[0][0].shape[1]
    u, y = (_new([part[i] for part in long], order) for i in (0, 1))
    lags = 2 * max(len(x) for x in y) // 3
    certain = scipy.special.ndtri(1.0 - 0.5 * _CERTAIN / (lags * u[0].shape[1]))
    found = []
    for j in range(u[0].shape[1]):
        together = np.zeros(lags)
        for own, answer in zip(u, y, strict=True):
            every = scipy.signal.correlate(answer[:, 0], own[:, j], method="fft")[len(own) - 1 :][:lags]
            together[: len(every)] += every
        pairs = np.array([sum(max(len(x) - lag, 0) for x in y) for lag in range(lags)])
        sizes = [np.sqrt(np.mean(np.concatenate(x)[:, i] ** 2)) for x, i in ((u, j), (y, 0))]
        z = np.abs(together) / np.maximum(np.sqrt(pairs) * sizes[0] * sizes[1], 1e-300)
        best = int(np.argmax(z))
        nearer = float(np.max(z[: most + 1]))
        found.append(best if best > most and z[best] > max(certain, _CLEARLY * nearer) else 0)
    return tuple(found)


def far_answers(parts: Parts, near: Sequence[SharedDenominator], most: int, furthest: int) -> tuple[int, ...]:
    """The same by the output error of a lag, which also tells few jumps in noise; zero where it tells none.

    An input that is held jumps in few samples, and noise hides what is new in a slow output there. What comes
    before a first answer is left out, since nobody knows the inputs that cause it. By BIC the lag must
    explain the rest better than plants with short delays do.

    Args:
        parts: records u (n, r), y (n, 1).
        near: the best of each order with delays to `most`.
        furthest: the lag up to which to look.
    """
    beyond = range(most + 1, furthest, max((furthest - most) // _TRIED, 1))
    return tuple(_far_answer(parts, near, j, beyond) for j in range(len(near[0].delays)))


def _far_answer(parts: Parts, near: Sequence[SharedDenominator], input: int, beyond: range) -> int:
    """The lag of one input; zero where none is told."""
    only = np.arange(len(near[0].delays)) == input
    # Beside a wrong delay of this input those of the others may be wrong, too, in most orders.
    others = {tuple(np.where(only, 0, one.delays).tolist()) for one in near}
    left = {lag: behind(parts, only * lag, lag, _FEWEST) for lag in beyond}
    unexplained = {
        (lag, delays): _unexplained(left[lag], delays) for delays in others for lag in beyond if left[lag]
    }
    if not unexplained:
        return 0
    best, delays = min(unexplained, key=lambda tried: unexplained[tried])
    cut = behind(parts, only * 0, best, _FEWEST)
    usual = min(_criterion(cut, one.F.size - 1, one.delays) for one in near)
    late = _criterion(left[best], 1, delays)
    return best if late < usual - _BETTER else 0


def _unexplained(parts: Parts, delays: Sequence[int]) -> float:
    """What a plant of order one leaves of the variance of y."""
    varying = float(np.mean(np.concatenate([y - y.mean() for _, y in parts]) ** 2))
    return output_error(parts, 1, 2, delays).loss / varying if varying > 0.0 else np.inf


def _criterion(parts: Parts, order: int, delays: Sequence[int]) -> float:
    """BIC of the output-error model."""
    samples, terms = sum(len(y) for _, y in parts), max(order, 2)
    loss = output_error(parts, order, terms, delays).loss
    return float(samples * np.log(max(loss, 1e-300)) + (order + terms * len(delays)) * np.log(samples))


def _new(signals: list[Array], order: int) -> list[Array]:
    """What the past of each channel does not tell of it: (n - order, channels) of every part."""
    alone = [
        untold([past(x[:, i : i + 1], order) for x in signals], [x[order:, i] for x in signals])
        for i in range(signals[0].shape[1])
    ]
    return [np.column_stack(channels) for channels in zip(*alone, strict=True)]
