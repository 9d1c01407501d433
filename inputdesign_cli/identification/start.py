"""Describe the unknown past of a record: its level, the states of the plant, the noise before it.

Level and states are unknown numbers. The noise before a record is as random as the noise in it. For
stationary noise C/D e, its later effect has a covariance that C and D determine ([ljung-1999], Section 10.5,
on initial conditions; [brockwell-davis-1991], Chapter 8, on the exact likelihood).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.plant.filtering import filtered

# Roots on the circle, which may be known, are taken for some so far inside: noise would have no stationary
# start, and its zeros no density.
_INSIDE = 1e-5


class Start(NamedTuple):
    """Effect of the past on the N prediction errors of one output; each row belongs to one unknown.

    Attributes:
        free: (m, N), by the level and states, of which nothing is known.
        disturbance: (m, N), `free` before the inverse of the noise model.
        noise: (n, N), by independent unknowns of the variance of e.
        zeros: -2 log of a density of the zeros of the noise model, see `density`; a scalar.
    """

    free: NDArray[np.float64]
    disturbance: NDArray[np.float64]
    noise: NDArray[np.float64]
    zeros: NDArray[np.float64]

    @classmethod
    def white(cls, free: NDArray[np.float64]) -> Start:
        """Return the start under white noise, which has no past."""
        return cls(free, free, np.zeros((0, free.shape[1])), np.zeros(()))

    @property
    def is_white(self) -> bool:
        """Return whether the start is known to be under white noise."""
        return self.free is self.disturbance and not len(self.noise)

    def and_free(self, free: NDArray[np.float64], disturbance: NDArray[np.float64]) -> Start:
        """Return the start with further free unknowns, (m, N) each."""
        return self._replace(
            free=np.concatenate([self.free, free]),
            disturbance=np.concatenate([self.disturbance, disturbance]),
        )

    def cropped(self, samples: int) -> Start:
        """Return the start of a shorter record."""
        if self.is_white:
            return Start.white(self.free[:, :samples])
        free, disturbance, noise = (block[:, :samples] for block in self[:3])
        return Start(free, disturbance, noise, self.zeros)

    @property
    def finite(self) -> bool:
        """Return whether all numbers are finite."""
        return all(bool(np.all(np.isfinite(block))) for block in self)


def central_differences(
    starts: Callable[[Array], Sequence[Start]], theta: Array, indices: Sequence[int], sizes: Sequence[float]
) -> list[tuple[Start, ...]]:
    """Return the derivatives of the `starts` of parameters (k,) by some of these, moved by these `sizes`."""
    found = []
    for index, size in zip(indices, sizes, strict=True):
        step = size * np.eye(theta.size)[index]
        ends = zip(starts(theta + step), starts(theta - step), strict=True)
        found.append(
            tuple(Start(*((a - b) / (2.0 * size) for a, b in zip(*pair, strict=True))) for pair in ends)
        )
    return found


def noise_before(C: Array, D: Array, samples: int) -> NDArray[np.float64]:
    """Return what stationary noise C/D e before a record adds to (D/C) of the record, (n, samples).

    With n the larger order, C (errors - e) is off by r(t) = sum_k>t (c_k e(t - k) - d_k v(t - k)) in the
    first n samples. Both e = D q and v = C q follow from q = e / D, an autoregression, whose last n values
    are made of independent ones by the predictors of every order. Real and complex coefficients alike.
    """
    n = max(C.size, D.size) - 1
    if n == 0:
        return np.zeros((0, samples))
    i, j = np.indices((n, n))
    (above, c), (below, d) = _padded(C, n), _padded(D, n)
    past = c[1 + i + j] @ below[n + j - i] - d[1 + i + j] @ above[n + j - i]
    r = past @ _autoregression(d[: n + 1])[::-1]
    return np.asarray(r.T @ each_later(filtered([1.0], C, np.eye(1, samples, dtype=r.dtype)[0]), n))


def each_later(response: Array, count: int) -> NDArray:
    """Return a response (N,) begun at once, and one sample later than the row before, (count, N)."""
    padded = np.concatenate([np.zeros(max(count - 1, 0), dtype=response.dtype), response])
    return np.lib.stride_tricks.sliding_window_view(padded, response.size)[:count][::-1]


def _padded(p: Array, n: int) -> tuple[Array, Array]:
    """p_k, zero outside of its coefficients, for k of -n to n, and for k of 0 to 2 n."""
    before, after = np.zeros(2 * n + 1, dtype=p.dtype), np.zeros(2 * n + 1, dtype=p.dtype)
    before[n : n + p.size], after[: p.size] = p, p
    return before, after


def density(C: Array) -> NDArray[np.float64]:
    """-2 log of a density of the zeros of C, up to a constant: 2 log of the variance of e / C.

    It vanishes on the unit circle and is all but flat elsewhere, 1 - c_1^2 for one zero. The likelihood has
    no slope across the circle, and in short records it is often largest there: noise seems to vanish at a
    frequency, and the model to be exact ([sargan-bhargava-1983]). [chung-2013] treat variances that come out
    zero alike. A zero z moves by about 2 z / N.
    """
    return np.asarray(2.0 * np.log(_step_down(_inside(C))[1][0]))


def _autoregression(d: Array) -> NDArray:
    """(n, n): n values in a row of e / D, oldest first, made of independent ones of the variance of e."""
    predictors, variances = _step_down(_inside(d))
    n = d.size - 1
    onto = np.eye(n, dtype=d.dtype)
    for order, predictor in enumerate(predictors):
        onto[order, :order] = predictor[:0:-1]
    return np.asarray(np.linalg.solve(onto, np.diag(np.sqrt(variances))))


def _inside(d: Array) -> Array:
    return d * (1.0 - _INSIDE) ** np.arange(d.size)


def _step_down(d: Array) -> tuple[list[Array], NDArray]:
    """Return the predictors of the orders 0 to n - 1 of e / D, and the variances (n,) of their errors.

    By the recursion of [brockwell-davis-1991], Section 5.2, from the predictor of order n, which is D.
    """
    predictor, variance = d, np.ones((), dtype=d.dtype)
    found = []
    while predictor.size > 1:
        last = predictor[-1]
        left = 1.0 - last**2
        predictor, variance = ((predictor - last * predictor[::-1]) / left)[:-1], variance / left
        found.append((predictor, variance))
    return [p for p, _ in found[::-1]], np.array([v for _, v in found[::-1]])
