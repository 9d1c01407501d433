"""Integrals over frequency, exact to rounding: Gauss-Legendre panels graded towards the poles.

Every integrand here is analytic except at poles near the axis. A panel no longer than its distance
to the nearest pole is integrated to full precision by a fixed rule, so the number of panels grows
only with the logarithm of the damping: a pole at radius 0.999999 costs some forty panels more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.errors import InaccurateError

NODES = 20
RELATIVE_ERROR = 1e-11
# Twenty nodes integrate cos(a x) over [-1, 1] to rounding up to about a = 10.
_PHASE_PER_PANEL = 16.0
_MAX_REFINEMENTS = 4
_ROUNDING = 1e-7  # a smaller change, relative, that halving does not reduce is rounding
_NEGLIGIBLE = 1e-15  # gradients up to this share of the largest of their output count as zero
_ON_AXIS = 1e-6
_NONE = np.zeros(0)
_AT_ONCE, _AT_ONCE_OF_SEVERAL = 2048, 256  # nodes computed together, the second for large values
_NUMBERS_AT_ONCE = 2**14  # entries of large values computed together: they stay in the cache

Values = Callable[[Array], NDArray]
"""Values (n, ...) of an integrand at frequencies (n,)."""


@dataclass(frozen=True)
class Quadrature:
    """Holds nodes and weights: (1 / 2 pi) integral over [-hi, hi] of an even f = sum weights f(nodes)."""

    nodes: Array
    weights: Array


Sums = Callable[[NDArray, NDArray], NDArray]
"""Sums over nodes of functions (n, f), with their weights, times values (n, ...): (f, ...)."""
PRODUCTS: Sums = partial(np.tensordot, axes=(0, 0))


def _edges(
    lo: float, hi: float, singularities: ComplexArray, longest: float, grading: float, knots: Array
) -> Array:
    panels = np.linspace(lo, hi, max(int(np.ceil((hi - lo) / longest)), 1) + 1)
    panels = np.union1d(panels, knots[(knots > lo) & (knots < hi)])
    left, right = panels[:-1], panels[1:]
    done: list[Array] = []
    near = singularities
    while left.size and near.size:
        nearest = np.clip(near.real[None, :], left[:, None], right[:, None])
        distance = np.hypot(nearest - near.real, np.maximum(near.imag, 1e-12)).min(axis=1)
        split = right - left > grading * distance
        done.append(left[~split])
        middle = 0.5 * (left[split] + right[split])
        left, right = np.concatenate([left[split], middle]), np.concatenate([middle, right[split]])
    starts = np.concatenate([*done, left])
    return np.append(np.sort(starts), hi)


@cache
def _rule() -> tuple[Array, Array]:
    return leggauss(NODES)


def graded_quadrature(
    singularities: ComplexArray,
    *,
    lo: float = 0.0,
    hi: float = np.pi,
    highest_lag: int = 0,
    refine: int = 0,
    knots: Array = _NONE,
) -> Quadrature:
    """Return panels on [lo, hi] for integrands with the given singularities times cos(highest_lag w).

    Args:
        singularities: complex points (angle + j damping) of the frequency plane, see
            `plant.frequencies.logarithmic_distance`.
        refine: how often every panel is halved, for the check by doubling.
        knots: frequencies at which the integrand has a kink; panels end there.
    """
    near = np.asarray(singularities, dtype=complex)
    longest = min(0.5, _PHASE_PER_PANEL / max(highest_lag, 1)) / 2**refine
    return _panels(
        near.tobytes(), np.asarray(knots, dtype=float).tobytes(), float(lo), float(hi), longest, refine
    )


# The integrals of one design need the same few rules many times, at each of its plants.
@lru_cache(maxsize=512)
def _panels(
    singularities: bytes, knots: bytes, lo: float, hi: float, longest: float, refine: int
) -> Quadrature:
    near, ends = np.frombuffer(singularities, dtype=complex), np.frombuffer(knots)
    edges = _edges(lo, hi, near, longest, 1.0 / 2**refine, ends)
    x, weight = _rule()
    half = 0.5 * np.diff(edges)[:, None]
    middle = 0.5 * (edges[:-1] + edges[1:])[:, None]
    rule = Quadrature((middle + half * x).ravel(), (half * weight / np.pi).ravel())
    for shared in (rule.nodes, rule.weights):
        shared.setflags(write=False)
    return rule


def integrand(density: Values, factor: Values | None, inputs: int) -> tuple[Values, Sums]:
    """Return the values to compute at the nodes of a rule, and how to sum them against functions.

    The sums, of weighted functions (n, f) and of the values at n nodes, are sum_n weighted[n, f] D(node_n):
    (f, ...), or (f, ..., r, r) for several inputs. These take values of the `factor` F, D = F^* F, if given.
    """
    return (factor, _summed_products) if factor is not None and inputs > 1 else (density, PRODUCTS)


def _summed_products(weighted: NDArray, F: NDArray) -> NDArray:
    """Return the sums of (F_m^* F_l + F_l^* F_m) / 2, (functions, k, k, r, r): one output after the other.

    Only the parameters and inputs that matter to an output enter its products.
    """
    n, k, p, r = F.shape
    half = np.zeros((weighted.shape[1], k * r, k * r), dtype=complex)
    for output in range(p):
        rows = F[:, :, output].reshape(n, k * r)
        size = np.abs(rows).max(axis=0)
        used = np.flatnonzero(size > _NEGLIGIBLE * size.max(initial=0.0))
        rows = rows[:, used]
        for sums, weight in zip(half, weighted.T, strict=True):
            sums[np.ix_(used, used)] += (rows.conj() * weight[:, None]).T @ rows
    both = half.reshape(-1, k, r, k, r).transpose(0, 1, 3, 2, 4)
    return 0.5 * (both + both.swapaxes(1, 2))


def integrate(
    values: Values,
    functions: Values | None,
    singularities: ComplexArray,
    *,
    sums: Sums = PRODUCTS,
    lo: float = 0.0,
    hi: float = np.pi,
    highest_lag: int = 0,
    knots: Array = _NONE,
    several: bool = False,
    unit: float = 1.0,
) -> NDArray:
    """Return `sums` of `values` times `functions` on a rule that is proved fine enough by halving its panels.

    Halving gains twelve digits or none. Where it gains none and the change is already small, only rounding of
    the integrand remains, which no rule can mend. It occurs in whitened coordinates of a plant whose
    parameters are nearly indistinguishable.

    Args:
        functions: the functions (n, f) at frequencies (n,) that multiply the values; None: the constant one.
        several: values may be large, as for several channels: these are computed at few nodes at a time.
        unit: unit of the frequencies of `values` and `functions`; all other frequencies are divided by it.

    Raises:
        InaccurateError: when refinement does not settle the integrals to 1e-11 of the largest entry:
            `integral-inaccurate` for a pole on the axis itself, `numerically-singular` where there is none.
    """

    def rule_of(refine: int) -> Quadrature:
        return graded_quadrature(
            singularities, lo=lo, hi=hi, highest_lag=highest_lag, refine=refine, knots=knots
        )

    at_once = _AT_ONCE_OF_SEVERAL if several else _AT_ONCE
    # The first rule never stands alone: one call computes its values and the next rule's.
    coarse, fine = _summed(values, functions, sums, [rule_of(0), rule_of(1)], at_once, unit)
    earlier = np.inf
    for refine in range(1, _MAX_REFINEMENTS + 1):
        if refine > 1:
            (fine,) = _summed(values, functions, sums, [rule_of(refine)], at_once, unit)
        scale = np.abs(fine).max(initial=0.0)
        change = np.abs(fine - coarse).max(initial=0.0)
        if change <= RELATIVE_ERROR * scale or 0.1 * earlier < change <= _ROUNDING * scale:
            return fine
        coarse, earlier = fine, change
    off = np.hypot(singularities.real - np.clip(singularities.real, lo, hi), singularities.imag)
    raise _unsettled(on_axis=bool(off.min(initial=np.inf) <= _ON_AXIS))


def _unsettled(*, on_axis: bool) -> InaccurateError:
    """Return the error that an integral does not settle, with a pole on the axis or without."""
    if not on_axis:
        return InaccurateError.because(
            "numerically-singular",
            "an integral of the information matrix did not settle: parameters have so nearly the same effect "
            "on the samples that the difference between them is rounding",
            hint="look for dynamics much faster than the sampling, for orders too high, or for poles and "
            "zeros that nearly cancel; plant.known takes what need not be estimated",
            key="plant",
        )
    return InaccurateError.because(
        "integral-inaccurate",
        "an integral of the information matrix did not settle: the integrand has a pole on, "
        "or within rounding of, the unit circle",
        hint="move the pole inside the unit circle (integrators belong into a stable closed loop)",
    )


def _summed(
    values: Values,
    functions: Values | None,
    sums: Sums,
    rules: Sequence[Quadrature],
    at_once: int,
    unit: float,
) -> list[NDArray]:
    """Return the sums on each of the rules."""
    nodes = np.concatenate([rule.nodes for rule in rules])
    ends = np.cumsum([rule.nodes.size for rule in rules]).tolist()
    found: list[list[NDArray]] = [[] for _ in rules]
    start = 0
    while start < nodes.size:
        w = nodes[start : start + at_once] * unit
        here, table = values(w), np.ones((w.size, 1)) if functions is None else functions(w)
        for rule, end, parts in zip(rules, ends, found, strict=True):
            first = end - rule.nodes.size
            lo, hi = max(start, first), min(start + len(here), end)
            if lo < hi:
                weights, part = rule.weights[lo - first : hi - first] * unit, slice(lo - start, hi - start)
                parts.append(sums(table[part] * weights[:, None], here[part]))
        start += len(here)
        at_once = max(at_once, min(_AT_ONCE, _NUMBERS_AT_ONCE // max(here[0].size, 1)))
    return [np.asarray(sum(parts[1:], start=parts[0])) for parts in found]


def integrate_band(
    values: Values,
    functions: Values | None,
    singularities: ComplexArray,
    band: tuple[float, float],
    *,
    sums: Sums = PRODUCTS,
    highest_lag: int = 0,
    knots: Array = _NONE,
) -> NDArray:
    """Integrate over [lo, hi] and its mirror image, in any unit of frequency: (1 / 2 pi) integral.

    The band is stretched to the length of the half circle, for which the panels are laid out.
    """
    unit = (band[1] - band[0]) / np.pi
    near: ComplexArray = np.asarray(singularities, dtype=complex) * (1.0 / unit + 0j)
    return integrate(
        values,
        functions,
        near,
        sums=sums,
        lo=band[0] / unit,
        hi=band[1] / unit,
        highest_lag=highest_lag,
        knots=knots / unit,
        several=True,
        unit=unit,
    )


def band_quadrature(singularities: ComplexArray, band: tuple[float, float]) -> Quadrature:
    """Return one graded rule on the band in any unit of frequency."""
    unit = (band[1] - band[0]) / np.pi
    near: ComplexArray = np.asarray(singularities, dtype=complex) * (1.0 / unit + 0j)
    rule = graded_quadrature(near, lo=band[0] / unit, hi=band[1] / unit)
    return Quadrature(rule.nodes * unit, rule.weights * unit)
