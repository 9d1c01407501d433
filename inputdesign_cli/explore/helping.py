"""Whether what the inputs do, by a model, helps to predict the outputs beyond the outputs' own past.

Two signals that wander, drift, or follow one cycle agree over long stretches though neither moves the other,
and a model of the one by the other simulates unseen data, too ([granger-newbold-1974]). What is new in the
output from sample to sample then answers nothing that the input does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import output_error_form
from inputdesign_cli.explore.inputs import past, untold
from inputdesign_cli.explore.one_line import MOSTLY, cycle, is_held
from inputdesign_cli.plant import Model

_LAGS, _PER_LAG = 20, 12
_CERTAIN = 1e-3
# In -2 log likelihood: what the choice among some thousands of structures and delays gains by chance, and
# what a model loses that foretells moves which do not come.
_BY_CHOICE, _WORSE = 25.0, 5.0


def unhelpful(model: Model, parts: Sequence[tuple[Array, Array]]) -> list[int]:
    """The outputs (from zero) that what the inputs do by a model does not help to predict.

    An output is predicted from its own past, a level and a line, and besides from what the model simulates
    (F-test); and, with no parameter more, what the simulation leaves from its past. Where nine tenths of the
    power of a single input are a cycle with its harmonics, these stand beside the line, and the model must
    predict worse than none: then it says of the rest of the input what the output denies.

    Args:
        parts: records u (n, r), y (n, p).
    """
    samples = sum(len(y) for _, y in parts)
    lags = min(_LAGS, samples // _PER_LAG)
    long = [part for part in parts if len(part[1]) > 3 * lags]
    if lags < 1 or not long:
        return []
    form = output_error_form(model)
    with np.errstate(over="ignore", invalid="ignore"):
        caused = [form.simulate(u - u.mean(axis=0), np.zeros(y.shape), 1.0)[0] for u, y in long]
    if not all(np.all(np.isfinite(x)) for x in caused):
        return []
    levels = [_level(len(y)) for _, y in long]
    cycles = _cycles(long)
    found = []
    for i in range(model.outputs):
        signals = [(y[:, i], x[:, i]) for (_, y), x in zip(long, caused, strict=True)]
        idle = _idle(signals, levels, lags, -_BY_CHOICE)
        if idle or (cycles is not None and _idle(signals, cycles, lags, _WORSE)):
            found.append(i)
    return found


def _idle(signals: Sequence[tuple[Array, Array]], known: Sequence[Array], lags: int, least: float) -> bool:
    """Whether x (n,) does not help to predict y (n,), and y - x no more than `least` in -2 log likelihood."""
    own, more, left, targets, others = [], [], [], [], []
    for (y, x), columns in zip(signals, known, strict=True):
        own.append(np.column_stack([columns[lags:], past(y[:, None], lags)]))
        more.append(np.column_stack([own[-1], x[lags:], past(x[:, None], lags)]))
        left.append(np.column_stack([columns[lags:], past((y - x)[:, None], lags)]))
        targets.append(y[lags:])
        others.append((y - x)[lags:])
    alone, along, simulated = (
        max(sum(float(e @ e) for e in untold(rows, those)), 1e-300)
        for rows, those in ((own, targets), (more, targets), (left, others))
    )
    samples = sum(len(y) for y in targets)
    free = samples - more[0].shape[1]
    if free < 1:
        return False
    statistic = (alone - along) / (lags + 1) / (along / free)
    probability = float(scipy.special.fdtrc(lags + 1, free, max(statistic, 0.0)))
    return probability > _CERTAIN and samples * float(np.log(simulated / alone)) > least


def _level(samples: int) -> Array:
    """(n, 2): a level and a line."""
    return np.column_stack([np.ones(samples), np.linspace(-1.0, 1.0, samples)])


def _cycles(parts: Sequence[tuple[Array, Array]]) -> list[Array] | None:
    """Level, line, and the cycle of the only input in every record; None where there is none."""
    if parts[0][0].shape[1] > 1 or any(is_held(u) for u, _ in parts):
        return None
    found = [cycle(u[:, 0], _level(len(u))) for u, _ in parts]
    return [columns for columns, _ in found] if all(share > MOSTLY for _, share in found) else None
