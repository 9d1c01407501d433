"""See whether the inputs move the outputs at all, and whether the plant is unstable, by regressions.

Two signals that wander, drift, or follow one cycle agree over long stretches though neither moves the other,
and a model of the one by the other simulates unseen data, too ([granger-newbold-1974]). What is new in the
output from sample to sample then answers nothing that the input does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts, output_error_form
from inputdesign_cli.explore.regressors import past, residuals
from inputdesign_cli.plant import Model

_LAGS, _PER_LAG = 20, 12
_CERTAIN = 1e-3
# In -2 log likelihood: what the choice among some thousands of structures and delays gains by chance.
_BY_CHOICE = 25.0
_HIGHEST = 5
# Standard deviations beyond the circle, and the step, in deviations, for the derivative of a pole.
_BEYOND, _STEP = 5.0, 0.01
# What would grow by less over the whole record may be drift, or several integrators, without a loop.
_GROWN = 1e4
_DEPENDENT = 1e-9


def unhelpful(model: Model, parts: Parts) -> list[int]:
    """Return the outputs (from zero) whose prediction the simulated effect of the inputs does not improve.

    An output is predicted from its own past, a level and a line, and besides from what the model simulates
    (F-test). With no parameter more, the error of the simulation is predicted from its own past as well.

    Args:
        parts: records u (n, r), y (n, p).
    """
    lags = min(_LAGS, sum(len(y) for _, y in parts) // _PER_LAG)
    long = [part for part in parts if len(part[1]) > 3 * lags]
    if lags < 1 or not long:
        return []
    form = output_error_form(model)
    with np.errstate(over="ignore", invalid="ignore"):
        caused = [form.simulate(u - u.mean(axis=0), np.zeros(y.shape), 1.0)[0] for u, y in long]
    if not all(np.all(np.isfinite(x)) for x in caused):
        return []
    pairs = [(y, x) for (_, y), x in zip(long, caused, strict=True)]
    return [i for i in range(model.outputs) if _idle([(y[:, i], x[:, i]) for y, x in pairs], lags)]


def _idle(signals: Sequence[tuple[Array, Array]], lags: int) -> bool:
    """Return whether neither x (n,) nor y - x helps to predict y (n,) beyond its own past."""
    own, more, left = list[Array](), list[Array](), list[Array]()
    for y, x in signals:
        level = np.column_stack([np.ones(len(y)), np.linspace(-1.0, 1.0, len(y))])[lags:]
        own.append(np.column_stack([level, past(y[:, None], lags)]))
        more.append(np.column_stack([own[-1], x[lags:], past(x[:, None], lags)]))
        left.append(np.column_stack([level, past((y - x)[:, None], lags)]))
    targets, others = [y[lags:] for y, _ in signals], [(y - x)[lags:] for y, x in signals]
    alone, along, simulated = (
        max(sum(float(e @ e) for e in residuals(rows, those)), 1e-300)
        for rows, those in ((own, targets), (more, targets), (left, others))
    )
    samples = sum(map(len, targets))
    free = samples - more[0].shape[1]
    if free < 1:
        return False
    statistic = (alone - along) / (lags + 1) / (along / free)
    probability = float(scipy.special.fdtrc(lags + 1, free, max(statistic, 0.0)))
    return probability > _CERTAIN and samples * float(np.log(simulated / alone)) > -_BY_CHOICE


@dataclass(frozen=True)
class UnstablePole:
    """The pole farthest from the origin, and the standard deviation of its radius."""

    pole: complex
    deviation: float

    @property
    def denominator(self) -> Array:
        """(2,), or (3,) with its conjugate: in q^-1, ascending."""
        both = [self.pole] if self.pole.imag == 0.0 else [self.pole, self.pole.conjugate()]
        return np.asarray(np.poly(both).real)


def unstable_pole(parts: Parts, output: int) -> UnstablePole | None:
    """Return the unstable pole of one output y (n, p), at the order that BIC prefers; None: it has none.

    A loop that holds an unstable plant excites it, and what ARX models predict does not care where their
    poles are ([ljung-1999], Section 13.4).
    """
    own = [(u - u.mean(axis=0), y[:, output : output + 1] - y[:, output].mean()) for u, y in parts]
    long = [part for part in own if len(part[1]) > 4 * _HIGHEST]
    best, found = np.inf, None
    for n in range(1, _HIGHEST + 1) if long else ():
        rows = [np.column_stack([past(y, n), past(u, n)])[_HIGHEST - n :] for u, y in long]
        columns, target = np.concatenate(rows), np.concatenate([y[_HIGHEST:, 0] for _, y in long])
        left, sizes, right = np.linalg.svd(columns, full_matrices=False)
        if sizes[-1] <= _DEPENDENT * sizes[0] or len(target) <= 2 * sizes.size:
            continue
        theta = (target @ left / sizes) @ right
        variance = max(float(np.mean((target - columns @ theta) ** 2)), 1e-300)
        criterion = np.log(variance) + theta.size * np.log(len(target)) / len(target)
        if criterion < best:
            best, pole = criterion, _farthest(theta[:n])
            spread = np.sqrt(variance) * right / sizes[:, None]
            moved = [abs(_farthest((theta + _STEP * way)[:n])) - abs(pole) for way in spread]
            found = UnstablePole(pole, float(np.linalg.norm(moved)) / _STEP)
    if found is None:
        return None
    samples = sum(len(y) for _, y in long)
    beyond = max(1.0 + _BEYOND * found.deviation, _GROWN ** (1.0 / samples))
    return found if abs(found.pole) > beyond else None


def _farthest(regressed: Array) -> complex:
    """Return the pole farthest from the origin of y(t) = sum_k a_k y(t - k)."""
    roots = np.roots(np.concatenate([[1.0], -regressed]))
    return complex(roots[np.argmax(np.abs(roots))])
