"""Whether the plant is unstable, and so in a loop: a pole that the samples put outside the circle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.explore.inputs import past

_HIGHEST = 5
# So many standard deviations beyond the circle, and steps of one by which it is told how a pole moves.
_BEYOND, _STEP = 5.0, 0.01
# What would grow by less over the whole record may be drift, or several integrators, without a loop.
_GROWN = 1e4
_DEPENDENT = 1e-9


@dataclass(frozen=True)
class UnstablePole:
    """The pole farthest from the origin, and the standard deviation of its radius."""

    pole: complex
    deviation: float

    @property
    def radius(self) -> float:
        """Its distance from the origin."""
        return abs(self.pole)

    @property
    def denominator(self) -> Array:
        """(2,), or (3,) with its conjugate: in q^-1, ascending."""
        both = [self.pole] if self.pole.imag == 0.0 else [self.pole, self.pole.conjugate()]
        return np.asarray(np.poly(both).real)


def unstable_pole(parts: Parts, output: int) -> UnstablePole | None:
    """That of one output of records u (n, r), y (n, p), at the order that BIC prefers; None: it has none.

    A loop that holds an unstable plant excites it, and what ARX models predict does not care where their
    poles are ([ljung-1999], Section 13.4).
    """
    own = [(u - u.mean(axis=0), y[:, output : output + 1] - y[:, output].mean()) for u, y in parts]
    long = [(u, y) for u, y in own if len(y) > 4 * _HIGHEST]
    fits = [found for n in range(1, _HIGHEST + 1) if long and (found := _Regression.of(long, n)) is not None]
    if not fits:
        return None
    best = min(fits, key=lambda found: found.criterion)
    pole = best.pole(best.theta)
    moved = [abs(best.pole(best.theta + _STEP * direction)) - abs(pole) for direction in best.spread]
    deviation = float(np.linalg.norm(moved)) / _STEP
    samples = sum(len(y) for _, y in long)
    if not abs(pole) > max(1.0 + _BEYOND * deviation, _GROWN ** (1.0 / samples)):
        return None
    return UnstablePole(pole, deviation)


@dataclass(frozen=True)
class _Regression:
    """A and B by least squares: theta (k,), and rows of `spread` (k, k), a standard deviation long each."""

    order: int
    theta: Array
    spread: Array
    criterion: float

    @classmethod
    def of(cls, parts: Parts, order: int) -> _Regression | None:
        """Of records u (n, r), y (n, 1); None where they do not tell all parameters."""
        rows = [np.column_stack([past(y, order), past(u, order)])[_HIGHEST - order :] for u, y in parts]
        columns, target = np.concatenate(rows), np.concatenate([y[_HIGHEST:, 0] for _, y in parts])
        left, sizes, right = np.linalg.svd(columns, full_matrices=False)
        if sizes[-1] <= _DEPENDENT * sizes[0] or len(target) <= 2 * sizes.size:
            return None
        theta = (target @ left / sizes) @ right
        variance = float(np.mean((target - columns @ theta) ** 2))
        criterion = float(np.log(max(variance, 1e-300))) + theta.size * np.log(len(target)) / len(target)
        return cls(order, theta, np.sqrt(variance) * right / sizes[:, None], criterion)

    def pole(self, theta: Array) -> complex:
        """The one farthest from the origin."""
        roots = np.roots(np.concatenate([[1.0], -theta[: self.order]]))
        return complex(roots[np.argmax(np.abs(roots))])
