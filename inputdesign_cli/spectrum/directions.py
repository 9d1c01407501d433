"""Spectra over frequency: prices per direction of the channels, and integrals against tables of functions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant import local_maxima
from inputdesign_cli.spectrum.basis import Functional

_SINGULAR = 1e-13
# A price below this counts as zero: its inverse would leave the range of double precision.
_FREE = 1e-140
_EQUAL = 1e-10  # relative difference up to which two ratios are equal
_BETWEEN = 200  # frequencies searched between two points of a grid


def matrices(density: NDArray) -> NDArray:
    """Return values (n,) of a density for one input as (n, 1, 1), and values (n, r, r) unchanged."""
    return density[:, None, None] if density.ndim == 1 else density


def every_direction(price: NDArray, value: NDArray) -> tuple[Array, ComplexArray]:
    """Return the stationary ratios of v^* value v to v^* price v at each frequency, with their directions.

    Args:
        price, value: densities, (n,) or Hermitian (n, r, r), `price` positive.

    Returns:
        The ratios (n, r), ascending, and for each a unit direction, (n, r, r): [n, a] belongs to ratio a.
    """
    if price.ndim == 1:
        with np.errstate(divide="ignore", invalid="ignore"):
            quotient = value / price
        # Where the price vanishes (S at DC under integral action) only the neighbouring ratios count.
        ratios = np.where(price > 0, quotient, -np.inf)
        return ratios[:, None], np.ones((price.size, 1, 1), dtype=complex)
    each = np.einsum("naa->na", price).real
    size = each.sum(axis=1)
    free = size <= _FREE
    # Channel by channel: a small share of the largest price may exceed the price of a cheap channel.
    little = _SINGULAR * np.where(each > 0.0, each, size[:, None]) + free[:, None]
    P = price + little[:, :, None] * np.eye(price.shape[-1])
    inverse = np.linalg.inv(np.linalg.cholesky(P))
    ratios, vectors = np.linalg.eigh(inverse @ value @ inverse.conj().swapaxes(1, 2))
    directions = (inverse.conj().swapaxes(1, 2) @ vectors).swapaxes(1, 2)
    length = np.linalg.norm(directions, axis=2, keepdims=True)
    return np.where(free[:, None], -np.inf, ratios), directions / length


def best_directions(price: NDArray, value: NDArray) -> tuple[Array, ComplexArray]:
    """Return the largest of the stationary ratios at each frequency, (n,), and its direction (n, r)."""
    ratios, directions = every_direction(price, value)
    return ratios[:, -1], directions[:, -1]


def directed_scale(price: Functional, value: Functional, grid: Array) -> tuple[float, Array]:
    """Return the largest s for which price(w) - s value(w) >= 0 as matrices at every frequency.

    It is valid for every spectrum on [grid[0], grid[-1]]: each is a mixture of sinusoids, each of some
    direction across the channels. The part of a price at single frequencies only adds to it and is ignored; a
    value concentrated at single frequencies proves nothing (s = 0).

    Returns:
        s, and the frequencies of the local maxima of the largest generalised eigenvalue.
    """

    def ratio(w: Array) -> Array:
        return best_directions(price.density(w), value.density(w))[0]

    over_grid = ratio(grid)
    peaks, heights = local_maxima(ratio, grid, over_grid)
    if over_grid[0] == -np.inf and peaks.size:
        peaks = np.maximum(peaks, _beside_free(ratio, grid, over_grid, peaks[0], heights[0]))
    if value.concentrated:
        return 0.0, peaks
    return inverse_of(heights), peaks


def _beside_free(
    ratio: Callable[[Array], Array], grid: Array, over_grid: Array, first: float, top: float
) -> float:
    """Return the largest frequency at which a `ratio` is as large as beside grid[0], which costs nothing.

    Below that frequency the ratio hardly changes while the price vanishes, and sinusoids could not be scaled
    by their price. The grid may be coarse there, so that the interval in which the ratio falls is searched.

    Args:
        over_grid: the ratios on the grid.
        first, top: the first local maximum and its ratio.
    """

    def same(ratios: Array) -> NDArray[np.bool_]:
        return np.abs(ratios - top) <= _EQUAL * np.abs(top)

    beyond = int(np.searchsorted(grid, first, side="right"))
    fallen = np.flatnonzero(~same(over_grid[beyond:]))
    if not np.all(same(over_grid[1 : beyond - 1])):
        return first
    between = np.geomspace(first, grid[beyond + fallen[0]] if fallen.size else grid[-1], _BETWEEN)
    return float(between[same(ratio(between))].max(initial=first))


def inverse_of(heights: Array) -> float:
    """Return one over the largest of some ratios, infinite where none is positive."""
    top = float(heights.max(initial=0.0))
    return np.inf if top <= 0 else 1.0 / top


def first_directions(units: Array) -> ComplexArray:
    """Return directions (number, r) along each channel, and along pairs in phase and in counterphase.

    The channels of a pair take part in proportion to their units (r,); directions have length one.
    """
    axes = np.diag(units)
    both = [axes[i] + sign * axes[j] for i in range(len(units)) for j in range(i) for sign in (1.0, -1.0)]
    found = np.array([*axes, *both], dtype=complex)
    return found / np.linalg.norm(found, axis=1, keepdims=True)
