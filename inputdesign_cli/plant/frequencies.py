"""Frequency grids that resolve every resonance, and the peaks of functions on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray

_REFINEMENT = 6
# Points and repeats that narrow a bracket about ten thousandfold: repeats cost most for few peaks, points for
# many peaks.
_ZOOM_FEW, _ZOOM_MANY, _FEW = (40, 3), (8, 6), 64
# Next to a kink the value falls in proportion to the width of its bracket. It is narrowed until the fall is
# at most this share of the value, or this number of times.
_KINK, _MOST_ZOOMS = 1e-9, 16
SLACK = 0.05
"""A peak between two grid points may stand this much higher than both, as a share of itself."""
# A function is flat if its values differ by less than this share.
_FLAT = 1e-12


def logarithmic_distance(roots: ArrayLike) -> ComplexArray:
    """Return roots z = exp(j s) as points s of the frequency plane: angle + j damping."""
    z = np.asarray(roots, dtype=complex)
    z = z[np.abs(z) > 1e-6]
    return np.abs(np.angle(z)) + 1j * np.abs(np.log(np.abs(z)))


def frequency_plane(roots: ArrayLike) -> ComplexArray:
    """Return roots in s as frequency + j damping."""
    s = np.asarray(roots, dtype=complex)
    return np.abs(s.imag) + 1j * np.abs(s.real)


def graded_grid(
    singularities: ArrayLike, lo: float, hi: float, *, points: int = 1000, knots: ArrayLike = ()
) -> Array:
    """Return a grid on [lo, hi] in rad/sample that resolves every pole and zero near the axis.

    Linear and logarithmic spacing are joined. Around each of the `singularities` (complex points of the
    frequency plane, see `logarithmic_distance`) come even steps of a fortieth of its distance to the axis.
    Beyond these offsets grow geometrically. `knots` (breakpoints of tables) are grid points too.
    """
    span = hi - lo
    parts = [_spaced(float(lo), float(hi), points), np.asarray(knots, dtype=float)]
    near = np.linspace(0.0, 2.0, 81)
    for s in np.unique(np.round(np.asarray(singularities, dtype=complex), 12)):
        width = max(s.imag, 1e-8)
        if width < span:
            reach = max(span / width, 2.5)
            steps = np.arange(1, int(np.ceil(20 * np.log10(reach))))
            far = 2.0 * (0.5 * reach) ** (steps / steps[-1])
            offsets = width * np.concatenate([near, far])
            parts += [s.real + offsets, s.real - offsets]
    grid = np.unique(np.concatenate(parts))
    return grid[(grid >= lo) & (grid <= hi)]


# All plants of a design have the same band.
@lru_cache(maxsize=64)
def _spaced(lo: float, hi: float, points: int) -> Array:
    grid = np.concatenate([np.linspace(lo, hi, points), np.geomspace(max(lo, hi * 1e-6), hi, points // 3)])
    grid.setflags(write=False)
    return grid


def common_grid(plants: Sequence[ComplexArray], lo: float, hi: float) -> Array:
    """Return one grid for several plants, everywhere about as fine as the finest of their own grids.

    Poles that lie side by side share their points, so that many plants need few more points than one.
    """
    parts = [np.empty(0), *(graded_grid(singularities, lo, hi) for singularities in plants)]
    grid = np.unique(np.concatenate(parts))
    finest = np.full(grid.size - 1, np.inf)
    for own in parts[1:]:
        steps = np.diff(own)
        middle = np.clip(np.searchsorted(own, 0.5 * (grid[1:] + grid[:-1])) - 1, 0, steps.size - 1)
        finest = np.minimum(finest, steps[middle])
    # A point for each unit of the cumulative sum of gap / finest step; no gap is wider than that step.
    passed = np.floor(np.concatenate([[0.0], np.cumsum(np.diff(grid) / finest)]) * (1.0 - _FLAT))
    kept = np.concatenate([[True], np.diff(passed) > 0.0])
    kept[-1] = True
    return grid[kept]


def local_maxima(
    function: Callable[[Array], Array], grid: Array, values: Array, *, above: float = -np.inf
) -> tuple[Array, Array]:
    """Return frequencies and values of the local maxima of `function` over [grid[0], grid[-1]], ascending.

    It maps frequencies (n,) to values (n,), and `values` are those on the grid. Around every grid maximum the
    grid is refined once, which separates twin peaks in one bracket; then each bracket is narrowed by repeated
    sampling. The function need only be continuous (tables have kinks). Values <= `above` are left out.

    Where maxima differ only by rounding the function is flat, and the highest stands for all. A maximum that
    differs only by rounding from the value at an end of the grid is at that end.
    """
    least = above - SLACK * abs(above) if np.isfinite(above) else above
    finer, beside = grid, np.zeros(0, dtype=bool)  # whether the cell before each point is refined
    for refined in (False, True):
        padded = np.concatenate([[-np.inf], values, [-np.inf]])
        index = np.flatnonzero((values >= padded[:-2]) & (values > padded[2:]) & (values > least))
        index = _distinct(values, index) if index.size > 1 else index
        if refined and np.isfinite(above):
            # In a refined cell a peak exceeds the grid points by less, at least in proportion to the step.
            slack = np.where(beside[index] & beside[index + 1], SLACK / (_REFINEMENT + 1), SLACK)
            index = index[values[index] > above - slack * abs(above)]
        if index.size == 0:
            return np.zeros(0), np.zeros(0)
        if refined:
            break
        around = np.unique(np.clip(index[:, None] + np.arange(-2, 2), 0, grid.size - 2))
        inside = grid[around, None] + (grid[around + 1] - grid[around])[:, None] * _fractions(_REFINEMENT)
        places = np.repeat(around + 1, _REFINEMENT)
        finer = np.insert(grid, places, inside.ravel())
        values = np.insert(values, places, function(inside.ravel()))
        first = around + _REFINEMENT * np.arange(around.size)
        beside = np.zeros(finer.size + 1, dtype=bool)
        beside[first[:, None] + np.arange(1, _REFINEMENT + 2)] = True
        beside[[0, -1]] = True  # there is no cell beyond the ends
    left, right = finer[np.maximum(index - 1, 0)], finer[np.minimum(index + 1, finer.size - 1)]
    best, best_value = finer[index], values[index]
    points, repeats = _ZOOM_FEW if index.size <= _FEW else _ZOOM_MANY
    steps, rows = _fractions(points), np.arange(index.size)
    for zoom in range(_MOST_ZOOMS):
        samples = left[:, None] + (right - left)[:, None] * steps
        found = function(samples.ravel()).reshape(samples.shape)
        top = np.argmax(found, axis=1)
        better = found[rows, top] > best_value
        best = np.where(better, samples[rows, top], best)
        best_value = np.where(better, found[rows, top], best_value)
        inside_grid = (grid[0] < best) & (best < grid[-1])
        lowest = np.minimum(found[rows, np.maximum(top - 1, 0)], found[rows, np.minimum(top + 1, points - 1)])
        kinked = inside_grid & (best_value - lowest > _KINK * np.abs(best_value))
        if zoom + 1 >= repeats and not np.any(kinked):
            break
        width = (right - left) / (points + 1)
        left, right = np.maximum(left, best - width), np.minimum(right, best + width)
    for end, inner in ((0, 1), (-1, -2)):
        level = float(values[end])
        beside = np.abs(best - grid[end]) < np.abs(grid[inner] - grid[end])
        flat = beside & (np.abs(best_value - level) <= _FLAT * np.abs(best_value))
        best, best_value = np.where(flat, grid[end], best), np.where(flat, level, best_value)
    kept = best_value > above
    return best[kept], best_value[kept]


def _distinct(values: Array, index: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the highest peak of each group between which the values fall by no more than rounding."""
    dips, heights = np.minimum.reduceat(values, index)[:-1], values[index]
    lower = np.minimum(heights[:-1], heights[1:])
    if np.all(lower - dips > _FLAT * np.abs(lower)):
        return index
    kept, least = [0], np.inf
    for after, dip in enumerate(dips.tolist(), start=1):
        least = min(least, dip)
        last, height = heights[kept[-1]], heights[after]
        if min(last, height) - least > _FLAT * abs(min(last, height)):
            kept.append(after)
        elif height > last:
            kept[-1] = after
        else:
            continue  # the lowest value since the last kept peak still counts
        least = np.inf
    return index[kept]


@cache
def _fractions(number: int) -> Array:
    return np.linspace(0.0, 1.0, number + 2)[1:-1]
