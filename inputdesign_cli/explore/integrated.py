"""Noise that integrates: outputs that wander as random walks do, whatever the inputs do.

Differences of such records have noise about a level, and the same plant ([ljung-1999], Section 14.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import singledispatch

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.explore.inputs import past, untold
from inputdesign_cli.plant import Coloured, Model, PolynomialModel, Reparametrised, SampledModel

_ONE = (np.ones(1),)
_LAGS, _PER_LAG = 5, 12
# A level that gains no more than this in BIC over a random walk leaves the question open.
_OPEN = 10.0


def differenced(parts: Parts) -> list[tuple[Array, Array]]:
    """What changes from sample to sample; a record of one sample has none."""
    return [(np.diff(u, axis=0), np.diff(y, axis=0)) for u, y in parts if len(y) > 1]


def integrating(model: Model, which: Sequence[bool]) -> Model:
    """The same plant and parameters, the noise of these outputs integrated.

    Args:
        model: of polynomials, or of transfer functions that are sampled, its parameters renamed or not.
        which: (p,).

    Raises:
        TypeError: the model is of another kind.
    """
    return _integrating(model, tuple(map(bool, which))) if any(which) else model


@singledispatch
def _integrating(model: Model, drift: tuple[bool, ...]) -> Model:
    raise TypeError(f"{type(model).__name__} has no noise that integrates")


@_integrating.register(PolynomialModel)
@_integrating.register(SampledModel)
def _(model: PolynomialModel | SampledModel, drift: tuple[bool, ...]) -> Model:
    one = _ONE * len(drift)
    return Coloured(model, one, one, (False,) * len(drift), drift)


@_integrating.register
def _(model: Coloured, drift: tuple[bool, ...]) -> Model:
    return replace(model, drift=drift)


@_integrating.register
def _(model: Reparametrised, drift: tuple[bool, ...]) -> Model:
    return replace(model, coefficients=_integrating(model.coefficients, drift))


def like_random_walks(left: Sequence[Array]) -> list[bool]:
    """Of each output whether what is left of it (n, p) may be a random walk, record by record.

    Autoregressions of orders up to five about a level, and of differences, are compared by BIC.
    """
    most = min(_LAGS, sum(len(v) for v in left) // _PER_LAG)
    long = [v for v in left if len(v) > most + 1]
    if most < 1 or not long:
        return [False] * left[0].shape[1]
    found = []
    for i in range(left[0].shape[1]):
        own = [v[:, [i]] for v in long]
        level, walk = (
            min(_criterion(own, order, most, walks=walks) for order in range(1, most + 1))
            for walks in (False, True)
        )
        found.append(walk < level + _OPEN)
    return found


def _criterion(left: Sequence[Array], order: int, most: int, *, walks: bool) -> float:
    """BIC of an autoregression of signals (n, 1), of their differences or about a level, past `most` samples.

    Each signal has a level of its own.
    """
    rows, targets = [], []
    for k, v in enumerate(left):
        signal = np.diff(v, axis=0) if walks else v
        counted = len(v) - most - 1
        own = past(signal, order)[-counted:]
        levels = np.zeros((counted, 0 if walks else len(left)))
        levels[:, k : k + 1] = 1.0
        rows.append(np.hstack([own, levels]))
        targets.append(signal[-counted:, 0])
    errors = np.concatenate(untold(rows, targets))
    variance = max(float(np.mean(errors**2)), 1e-300)
    return float(errors.size * np.log(variance) + rows[0].shape[1] * np.log(errors.size))
