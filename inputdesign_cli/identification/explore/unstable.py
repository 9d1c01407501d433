"""Whether the plant is unstable, and so in a loop: a pole that the samples put outside the circle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.identification.explore.fits import Parts
from inputdesign_cli.identification.explore.inputs import past
from inputdesign_cli.plant.polynomial import Array

_HIGHEST = 5
# So many standard deviations beyond the circle, and steps of one by which it is told how a pole moves.
_BEYOND, _STEP = 5.0, 0.01
# What would grow by less over the whole record may be drift, or several integrators, without a loop.
_GROWN = 1e4
_DEPENDENT = 1e-9


@dataclass(frozen=True)
class UnstablePole:
    """The radius of the largest pole with its standard deviation."""

    radius: float
    deviation: float


def unstable_pole(parts: Parts, output: int) -> UnstablePole | None:
    """That of one output of records u (n, r), y (n, p), at the order that BIC prefers; None: it has none.

    A loop that holds an unstable plant excites it, and what ARX models predict does not care where their
    poles are ([ljung-1999], Section 13.4).
    """
    own = [(u - u.mean(axis=0), y[:, output : output + 1] - y[:, output].mean()) for u, y in parts]
    long = [(u, y) for u, y in own if len(y) > 4 * _HIGHEST]
    best, least = None, np.inf
    for n in range(1, _HIGHEST + 1 if long else 1):
        columns = np.concatenate([np.column_stack([past(y, n), past(u, n)])[_HIGHEST - n :] for u, y in long])
        target = np.concatenate([y[_HIGHEST:, 0] for _, y in long])
        left, sizes, right = np.linalg.svd(columns, full_matrices=False)
        if sizes[-1] <= _DEPENDENT * sizes[0] or len(target) <= 2 * sizes.size:
            continue
        theta = (target @ left / sizes) @ right
        variance = float(np.mean((target - columns @ theta) ** 2))
        criterion = np.log(max(variance, 1e-300)) + theta.size * np.log(len(target)) / len(target)
        if criterion < least:
            best, least = (theta, np.sqrt(variance) * right / sizes[:, None], n), criterion
    if best is None:
        return None
    theta, spread, n = best
    radius = _radius(theta, n)
    slopes = [(_radius(theta + _STEP * direction, n) - radius) / _STEP for direction in spread]
    deviation = float(np.linalg.norm(slopes))
    samples = sum(len(y) for _, y in long)
    if not radius > max(1.0 + _BEYOND * deviation, _GROWN ** (1.0 / samples)):
        return None
    return UnstablePole(radius, deviation)


def _radius(theta: Array, n: int) -> float:
    return float(np.max(np.abs(np.roots(np.concatenate([[1.0], -theta[:n]])))))
