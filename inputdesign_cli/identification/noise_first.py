"""Noise of the residuals: the polynomials that the noise model of a spec lacks.

Tests of a model compare residuals with their own noise. Where the stated model of that noise is refuted,
slow noise looks like a drift, or like a plant that is not linear. So the noise is estimated first. Residuals
are C/D e, with C and D of small orders that BIC chooses.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.records import shifted
from inputdesign_cli.identification.stability import reflected
from inputdesign_cli.identification.starts import noise_polynomials
from inputdesign_cli.plant.filtering import filtered

_ORDERS = ((0, 1), (1, 0), (1, 1), (0, 2), (2, 2))
# Coefficients of the filter that whitens residuals: samples needed for each, and the most that are tried.
_SAMPLES_A_COEFFICIENT, _MOST = 20, 12

Noise = tuple[Array, Array]
"""C and D, monic."""


def noises_of_residuals(errors: Array, lengths: Sequence[int]) -> list[list[Noise]]:
    """Return C and D of every output's residuals (N, p): first as BIC prefers, then of the largest order.

    Args:
        lengths: of the records that follow each other; the longest determines the polynomials.
    """
    at = int(np.argmax(lengths))
    begin = sum(lengths[:at])
    tried = [[_fitted(v, c, d) for c, d in _ORDERS] for v in errors[begin : begin + lengths[at]].T]
    best = [int(np.argmin([value for value, _ in one])) for one in tried]
    chosen = [[own[k][1] for own, k in zip(tried, best, strict=True)], [own[-1][1] for own in tried]]
    return chosen[: 1 if all(k == len(_ORDERS) - 1 for k in best) else 2]


def _fitted(v: Array, c: int, d: int) -> tuple[float, Noise]:
    """Return BIC of noise (n,) of these orders, and its C and D."""
    C, D = (reflected(np.append(1.0, p)) for p in noise_polynomials(v, c, d))
    left = filtered(D, C, v)
    return float(v.size * np.log(np.mean(left**2)) + (c + d) * np.log(v.size)), (C, D)


@dataclass(frozen=True)
class Whitening:
    """Filters that make residuals of records white.

    Attributes:
        filters: of every output a monic polynomial, stable in its inverse.
        lengths: of the records that follow each other.
    """

    filters: tuple[Array, ...]
    lengths: tuple[int, ...]

    @classmethod
    def of(cls, errors: Array, lengths: tuple[int, ...]) -> Whitening:
        """Return the filters for residuals (N, p): autoregressions, of the orders that BIC prefers."""
        return cls(tuple(_autoregression(v, lengths) for v in errors.T), lengths)

    def through(self, signals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return signals (.., N + M, p) filtered record by record; the M errors before them stay.

        The first samples of a record, whose past is not known, are zero.
        """
        found, begin = np.array(signals), 0
        for length in self.lengths:
            own = slice(begin, begin + length)
            for i, filter in enumerate(self.filters):
                found[..., own, i] = filtered(filter, [1.0], signals[..., own, i])
                found[..., begin : begin + min(filter.size - 1, length), i] = 0.0
            begin += length
        return found

    def slopes(self, errors: Array) -> NDArray[np.float64]:
        """Return minus the derivative of filtered residuals by every coefficient, (m, N, p)."""
        found = []
        for i, lag in self._coefficients:
            own = np.zeros_like(errors)
            own[:, i] = -shifted(errors[:, i], lag, self.lengths)
            found.append(own)
        return np.array(found).reshape(-1, *errors.shape)

    def echoes(self) -> list[Callable[[Array], Array]]:
        """Return what past errors that are white add to each of these."""
        return [late_echo({i: (self.filters[i], -1.0)}, lag, self.lengths) for i, lag in self._coefficients]

    @property
    def _coefficients(self) -> list[tuple[int, int]]:
        return [(i, lag) for i, filter in enumerate(self.filters) for lag in range(1, filter.size)]


def late_echo(
    filters: Mapping[int, tuple[Array, float]], power: int, lengths: Sequence[int]
) -> Callable[[Array], Array]:
    """Errors `power` samples late, of each listed output by its sign through 1 / polynomial; others not."""

    def echo(errors: Array) -> Array:
        late = shifted(errors, power, lengths)
        found = np.zeros_like(errors)
        for i, (below, sign) in filters.items():
            pieces = np.split(late[:, i], np.cumsum(lengths)[:-1])
            found[:, i] = np.concatenate([filtered([sign], below, piece) for piece in pieces])
        return found

    return echo


def _autoregression(v: Array, lengths: Sequence[int]) -> Array:
    """Return the monic polynomial of the order that BIC prefers, by least squares over all records."""
    most = max(min(_MOST, v.size // _SAMPLES_A_COEFFICIENT), 1)
    past = np.stack([shifted(v, lag, lengths) for lag in range(1, most + 1)], axis=1)
    # Squares of orders that nest, from one triangle.
    triangle = np.linalg.qr(np.column_stack([past, v]))[1]
    left = np.cumsum(triangle[::-1, -1] ** 2)[::-1]
    orders = np.arange(most + 1)
    order = int(np.argmin(v.size * np.log(left[: most + 1]) + orders * np.log(v.size)))
    ahead = scipy.linalg.solve_triangular(triangle[:order, :order], triangle[:order, -1])
    return reflected(np.append(1.0, -ahead))
