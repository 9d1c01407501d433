"""The cheapest lines for a nonparametric frequency response of given accuracy.

Over N samples of steady state, sinusoids of power p at w_k in each of r inputs, with orthogonal phases over
r blocks, give every entry of G_hat = Y U^-1 the variance 2 Phi_v(w_k) / (N p) ([pintelon-schoukens-2012],
Section 2.5: |U_k|^2 is N p / 2). A bound r_adm at a line is therefore a least power of it. Without lower
limits on powers the best design has every line in proportion to that; with them it is a linear program.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.errors import IdesignError, InaccurateError, bad_spec

Goal = Literal["cost", "factor", "samples", "given"]
_ROUNDING = 1e-9


class UnreachableError(IdesignError):
    """Raised when the limits exclude the accuracy; deviations are at least `factor` times the allowed ones.

    The factor is infinite where the limits contradict each other.
    """

    def __init__(self, factor: float, limits: Sequence[PowerLimit]) -> None:
        super().__init__([])
        self.factor, self.limits = factor, tuple(limits)


@dataclass(frozen=True)
class ResponseLines:
    """Holds G (L, p, r), the noise spectrum Phi_v (L, p) and r_adm (L, p, r) at L lines.

    `share` is r_adm over |G|; None if r_adm does not depend on G.
    """

    G: ComplexArray
    noise: Array
    admitted: NDArray[np.float64]
    share: float | None = None

    def at(self, G: ComplexArray) -> ResponseLines:
        """Return the lines with another G (L, p, r); an unbounded error stays unbounded."""
        if self.share is None:
            return replace(self, G=G)
        return replace(self, G=G, admitted=np.where(np.isinf(self.admitted), np.inf, self.share * np.abs(G)))

    def where(self, kept: NDArray[np.bool_]) -> ResponseLines:
        """Return only the lines that are kept (L,)."""
        return replace(self, G=self.G[kept], noise=self.noise[kept], admitted=self.admitted[kept])

    def needed(self, samples: int) -> NDArray[np.float64]:
        """Return the least powers (L, r) whose deviations over `samples` samples are within r_adm."""
        return np.asarray(np.max(2.0 * self.noise[:, :, None] / self.admitted**2, axis=1) / samples)

    def deviations(
        self, powers: NDArray[np.float64], samples: float, noise: Array | None = None
    ) -> NDArray[np.float64]:
        """Return standard deviations, roots of E|G_hat - G|^2, by powers (L, r), as (L, p, r).

        Args:
            noise: (L, p) in place of Phi_v.
        """
        level = self.noise if noise is None else noise
        return np.asarray(np.sqrt(2.0 * level[:, :, None] / (samples * powers[:, None, :])))

    def ratios(self, deviations: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the largest ratio of deviation to r_adm at each line, (L,)."""
        return np.asarray(np.max(deviations / self.admitted, axis=(1, 2)))


@dataclass(frozen=True)
class ResponseProblem:
    """The powers x of n lines (each of one input) with x >= 1, where x = 1 just meets r_adm in N samples.

    Attributes:
        needed: (n,) the power that just meets r_adm.
        price: (n,) the cost of a unit of power.
        limits: limits on powers of inputs and outputs.
        rows: (limits, n) the part of a unit of power in each limited power.
    """

    needed: Array
    price: Array
    limits: tuple[PowerLimit, ...]
    rows: NDArray[np.float64]

    @cached_property
    def costs(self) -> Array:
        """Return the costs (n,) of the units of x."""
        return self.price * self.needed

    @cached_property
    def upper(self) -> tuple[NDArray[np.float64], Array]:
        """Return the rows and bounds of limits from above, in the units of x."""
        return self._limited(True)

    @cached_property
    def lower(self) -> tuple[NDArray[np.float64], Array]:
        """Return the rows and bounds of limits from below, in the units of x."""
        return self._limited(False)

    def _limited(self, upper: bool) -> tuple[NDArray[np.float64], Array]:
        kept = [limit.upper == upper for limit in self.limits]
        bounds = np.array([limit.bound for limit in self.limits if limit.upper == upper], dtype=float)
        return self.rows[kept] * self.needed, bounds

    def alike(self, x: Array) -> float:
        """Return the largest s with s x within the limits from above; infinite without any."""
        rows, bounds = self.upper
        used = rows @ x
        return float(np.min(bounds[used > 0] / used[used > 0], initial=np.inf))


@dataclass(frozen=True)
class ResponseDesign:
    """Holds powers (n,), and a value with the bound that multipliers of the limits prove for it.

    The value is a cost, or s. With s, variances are 1 / s of the admissible ones, or 1 / s of the samples is
    enough.
    """

    powers: Array
    value: float
    bound: float

    @property
    def gap(self) -> float:
        """Return the relative distance of value and bound."""
        return abs(self.value - self.bound) / max(abs(self.value), np.finfo(float).tiny)


def cheapest(problem: ResponseProblem) -> ResponseDesign:
    """Solve for the least cost that meets r_adm at every line.

    Raises:
        UnreachableError: the limits exclude that.
    """
    rows, floors = problem.lower
    least = np.ones(problem.needed.size)
    if problem.alike(least) < 1.0 - _ROUNDING:
        factor = most_accurate(problem).value ** -0.5
        raise UnreachableError(factor, _exhausted(problem, least))
    if np.all(rows @ least >= floors):
        value = float(np.sum(problem.costs))
        return ResponseDesign(problem.needed, value, value)
    caps, bounds = problem.upper
    scale = max(float(np.max(problem.costs)), np.finfo(float).tiny)
    x, over, under = _program(problem, problem.costs / scale, 1.0)
    under = under * _share(problem.costs / scale + over @ caps, under @ rows)
    reduced = problem.costs / scale + over @ caps - under @ rows
    bound = scale * float(np.sum(np.maximum(reduced, 0.0)) - over @ bounds + under @ floors)
    return ResponseDesign(x * problem.needed, float(problem.costs @ x), bound)


def most_accurate(problem: ResponseProblem) -> ResponseDesign:
    """Return the powers of the largest s; variances are 1 / s of the admissible ones.

    At least one limit must be from above.

    Raises:
        UnreachableError: the limits contradict each other.
        SpecError: `needs-limits`, no limit bounds the power of these lines.
    """
    rows, floors = problem.lower
    caps, bounds = problem.upper
    ones = np.ones(problem.needed.size)
    s = problem.alike(ones)
    if not np.isfinite(s):
        raise bad_spec(
            "needs-limits",
            "no limit bounds the power of these lines: what is limited is not reached by them",
            hint="limit input_power, or the power of an output that answers",
            key="limits",
        )
    if np.all(rows @ ones * s >= floors):
        return ResponseDesign(s * problem.needed, s, s)
    x, over, under = _program(problem, np.zeros(ones.size), 0.0, s)
    value = float(np.min(x))
    # With a reduced price r that is nowhere negative, s sum(r) <= r x <= over bounds - under floors.
    under = under * _share(over @ caps, under @ rows)
    reduced = np.maximum(over @ caps - under @ rows, 0.0)
    bound = float(over @ bounds - under @ floors) / max(float(np.sum(reduced)), np.finfo(float).tiny)
    return ResponseDesign(x * problem.needed, value, bound)


def _program(
    problem: ResponseProblem, costs: Array, least: float, unit: float = 0.0
) -> tuple[Array, Array, Array]:
    """Return x and the multipliers of upper and lower limits.

    Minimises costs x for x >= least, or maximises s for x >= s `unit`.

    Raises:
        UnreachableError: the limits contradict each other.
        InaccurateError: `solver-failed`.
    """
    caps, bounds = problem.upper
    rows, floors = problem.lower
    n = costs.size
    size = np.concatenate([bounds, floors])
    matrix = np.concatenate([caps, -rows]) / size[:, None]
    right = np.concatenate([np.ones(bounds.size), -np.ones(floors.size)])
    goal, variables = costs, [(least, None)] * n
    if unit:
        matrix = np.concatenate([matrix * unit, np.zeros((size.size, 1))], axis=1)
        rise = np.concatenate([-np.eye(n), np.ones((n, 1))], axis=1)
        matrix, right = np.concatenate([matrix, rise]), np.concatenate([right, np.zeros(n)])
        goal, variables = np.append(np.zeros(n), -1.0), [(0.0, None)] * (n + 1)
    found = scipy.optimize.linprog(goal, matrix, right, bounds=variables, method="highs")
    if found.status == 2:
        raise UnreachableError(np.inf, problem.limits)
    if found.status != 0:
        raise InaccurateError.because(
            "solver-failed",
            f"the linear program of the lines ended without an answer: {found.message}",
            hint="look at the sizes of the limits: they may be many powers of ten apart",
            key="limits",
        )
    multipliers = np.maximum(-found.ineqlin.marginals[: size.size], 0.0) / size
    x = found.x[:n] * (unit or 1.0)
    return x, multipliers[: bounds.size], multipliers[bounds.size :]


def _share(most: Array, taken: Array) -> float:
    """Return the largest share, at most one, for which no entry of most - share * taken is negative."""
    positive = taken > 0
    return float(min(1.0, np.min(most[positive] / taken[positive], initial=1.0)))


def _exhausted(problem: ResponseProblem, x: Array) -> list[PowerLimit]:
    """Return the limits from above that x breaks."""
    rows, bounds = problem.upper
    upper = [limit for limit in problem.limits if limit.upper]
    return [limit for limit, used, most in zip(upper, rows @ x, bounds, strict=True) if used > most]
