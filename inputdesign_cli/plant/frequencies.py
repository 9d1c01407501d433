"""Frequency grids that see every resonance, and the peaks of functions on them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.plant.polynomial import Array, ComplexArray

_ZOOM_POINTS = 8
_ZOOM_STEPS = 7


def logarithmic_distance(roots: ArrayLike) -> ComplexArray:
    """Roots z = exp(j s) as points s of the frequency plane: real part the angle, imaginary the damping."""
    z = np.asarray(roots, dtype=complex)
    z = z[np.abs(z) > 1e-6]
    return np.abs(np.angle(z)) + 1j * np.abs(np.log(np.abs(z)))


def graded_grid(
    singularities: ArrayLike, lo: float, hi: float, *, points: int = 600, knots: ArrayLike = ()
) -> Array:
    """A grid on [lo, hi] in rad/sample that resolves every pole and zero near the axis.

    Linear and logarithmic spacing together, and around each of the `singularities` (complex points
    of the frequency plane, see `logarithmic_distance`) offsets that grow geometrically from a
    fraction of its distance to the axis. `knots` (breakpoints of tables) are included as they are.
    """
    span = hi - lo
    floor = max(lo, hi * 1e-6)
    parts = [np.linspace(lo, hi, points), np.geomspace(floor, hi, points // 3), np.asarray(knots, dtype=float)]
    for s in np.unique(np.round(np.asarray(singularities, dtype=complex), 12)):
        width = max(s.imag, 1e-8)
        if width < span:
            offsets = width * np.concatenate([[0.0], np.geomspace(0.1, span / width, 8 + 6 * _decades(span / width))])
            parts += [s.real + offsets, s.real - offsets]
    grid = np.unique(np.concatenate(parts))
    return grid[(grid >= lo) & (grid <= hi)]


def _decades(ratio: float) -> int:
    return int(np.ceil(np.log10(ratio)))


def local_maxima(
    function: Callable[[Array], Array], grid: Array, values: Array, *, above: float = -np.inf
) -> tuple[Array, Array]:
    """Local maxima of `function` over [grid[0], grid[-1]], polished between the grid points.

    `function` maps frequencies (n,) to values (n,) and `values` are its values on `grid`. Only grid
    maxima with values > `above` are polished: each bracket between neighbours is narrowed by
    repeated sampling, which asks for continuity only (tables have kinks), all brackets at once.

    Returns:
        Frequencies and values of the maxima, both (number of maxima,), in ascending frequency.
    """
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    peak = (values >= padded[:-2]) & (values > padded[2:]) & (values > above)
    index = np.flatnonzero(peak)
    if index.size == 0:
        return np.zeros(0), np.zeros(0)
    left = grid[np.maximum(index - 1, 0)]
    right = grid[np.minimum(index + 1, grid.size - 1)]
    best, best_value = grid[index], values[index]
    steps = np.linspace(0.0, 1.0, _ZOOM_POINTS + 2)[1:-1]
    for _ in range(_ZOOM_STEPS):
        samples = left[:, None] + (right - left)[:, None] * steps
        found = function(samples.ravel()).reshape(samples.shape)
        top = np.argmax(found, axis=1)
        rows = np.arange(index.size)
        better = found[rows, top] > best_value
        best = np.where(better, samples[rows, top], best)
        best_value = np.where(better, found[rows, top], best_value)
        width = (right - left) / (_ZOOM_POINTS + 1)
        left, right = np.maximum(left, best - width), np.minimum(right, best + width)
    return best, best_value
