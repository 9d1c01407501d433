"""Toeplitz designs that a periodic signal has exactly: nonnegative powers on the lines of its period.

Optimal R are singular, made of few lines anywhere between 0 and pi; a period only offers multiples of
2 pi / period. Where R is not among its Gram matrices the design is repeated on these lines.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.regression.model import Regression
from inputdesign_cli.design.regression.search import Search
from inputdesign_cli.design.regression.steps import Region
from inputdesign_cli.design.regression.toeplitz import Goal, ToeplitzProblem

_EXACT = 1e-10
_ALL_LINES = 400  # up to this many lines all of them take part
_COARSE = 100
_NEIGHBOURS = 3
_HEAVY = 1e3  # weight of the equation that the powers add up to one


def design_periodic(
    regression: Regression, rho: Array, energy: float, period: int, *, target: float | None
) -> tuple[Array, float, bool]:
    """Return the shape rho on the lines of a period, or the nearest good design on them.

    The results are shares of the energy (period // 2 + 1,) on the lines 2 pi l / period, the energy, and
    whether the Gram matrix is the requested one.

    Args:
        target: the error to be met with the least energy; None: the energy stays, the error follows.
            If the lines cannot meet the target, the energy stays, too.
    """
    problem, goal = ToeplitzProblem.of(regression), Goal.of(regression, target=target, energy=energy)
    lines = 2.0 * np.pi * np.arange(period // 2 + 1) / period
    shares = _fit(rho, lines)
    fitted = np.cos(np.arange(rho.size)[:, None] * lines) @ shares
    start = problem.evaluate(fitted)
    exact = bool(np.abs(fitted - rho).max() < _EXACT)
    if exact or start is None:
        return shares, energy, exact
    chosen = _candidates(shares)
    shape = Search(problem, goal, Region.of_lines(lines[chosen], problem.n)).descend(start)
    full = np.zeros(lines.size)
    full[chosen] = _fit(shape.rho, lines[chosen])
    value = goal.value(shape)
    met = target is not None and np.isfinite(value)
    return full, goal.stated(value) if met else energy, False


def _fit(rho: Array, lines: Array) -> Array:
    """Return nonnegative powers, one in sum, whose autocorrelations are nearest to rho."""
    A = np.vstack([np.cos(np.arange(rho.size)[:, None] * lines), np.full(lines.size, _HEAVY)])
    powers, _ = scipy.optimize.nnls(A, np.append(rho, _HEAVY))
    return powers / powers.sum()


def _candidates(shares: Array) -> NDArray[np.intp]:
    """Return indices of all lines if they are few; else around the used lines, and some everywhere."""
    count = shares.size
    if count <= _ALL_LINES:
        return np.arange(count)
    used = np.flatnonzero(shares > 0.0)
    around = (used[:, None] + np.arange(-_NEIGHBOURS, _NEIGHBOURS + 1)).ravel()
    coarse = np.linspace(0, count - 1, _COARSE).astype(int)
    return np.unique(np.clip(np.concatenate([around, coarse]), 0, count - 1))
