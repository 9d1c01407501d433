"""Where to begin a prediction-error search: estimates that need no search.

A long ARX model gives an estimate of the noise and of the noise-free output. With the first, A, B and C
follow by linear regression ([hannan-rissanen-1982]); with the second, B and F by the iteration of
[steiglitz-mcbride-1965], and C and D from what is left. With several inputs the iteration takes one at a
time, on the output less what the others cause.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.orders import Block, OutputOrders
from inputdesign_cli.identification.stability import reflected
from inputdesign_cli.plant.filtering import filtered

_ITERATIONS = 15
_LONGEST = 40


def starting_points(row: OutputOrders, u: Sequence[Array], y: Array) -> Array:
    """(points, k): several starts for one output y (samples,) and all inputs u, (samples,) each."""
    inputs = [u[entry.input] for entry in row.entries]
    noise, responses = _long_model(row, inputs, y)
    first = _equation_error(row, inputs, y, noise)
    second = _output_error(row, inputs, y, responses, coloured=True)
    left = y - sum(responses, np.zeros_like(y))
    third = _output_error(row, inputs, y, [left + x for x in responses], coloured=False)
    points = np.array([first, second, third, *_nearly_cancelling(row, second)])
    return points[np.all(np.isfinite(points), axis=1)]


def _nearly_cancelling(row: OutputOrders, theta: Array) -> list[Array]:
    """Return `theta` with C and D that nearly cancel, at low and at high frequency: often separate minima."""
    C, D = (row.by_letter[letter][0] for letter in "cd")
    points = []
    for sign in (1.0, -1.0) if row.c and row.d else ():
        point = theta.copy()
        for block, root in ((C, 0.85), (D, 0.95)):
            point[block.columns] = 0.0
            point[block.columns.start] = -sign * root
        points.append(point)
    return points


def regress(y: Array, regressors: list[tuple[Array, range]]) -> tuple[list[Array], Array]:
    """Least squares of y(t) on x(t - lag): one array of coefficients for each regressor, and the residual."""
    columns = [_shifted(x, lag) for x, lags in regressors for lag in lags]
    if not columns:
        return [np.zeros(0) for _ in regressors], y
    matrix = np.stack(columns, axis=1)
    solution = np.linalg.lstsq(matrix, y, rcond=None)[0]
    ends = np.cumsum([len(lags) for _, lags in regressors])[:-1]
    return list(np.split(solution, ends)), y - matrix @ solution


def _shifted(x: Array, lag: int) -> Array:
    return np.concatenate([np.zeros(min(lag, x.size)), x[: max(x.size - lag, 0)]])


def _long_model(row: OutputOrders, inputs: list[Array], y: Array) -> tuple[Array, list[Array]]:
    """Return residuals of a long ARX model, and what it says that each input alone causes."""
    highest = max([row.a, row.c, row.d, *(max(entry.b, entry.f) for entry in row.entries)])
    order = max(1, min(max(4 * highest, 10), y.size // (3 * (len(inputs) + 1)), _LONGEST))
    regressors = [(x, range(entry.delay, order + 1)) for x, entry in zip(inputs, row.entries, strict=True)]
    (a, *bs), residual = regress(y, [(-y, range(1, order + 1)), *regressors])
    A = reflected(np.concatenate([[1.0], a]))
    responses = [
        filtered(np.concatenate([np.zeros(entry.delay), b]), A, x)
        for b, x, entry in zip(bs, inputs, row.entries, strict=True)
    ]
    return residual, responses


def _equation_error(row: OutputOrders, inputs: list[Array], y: Array, noise: Array) -> Array:
    """A, B, C by regression; output-error denominators F take the place of a missing A."""
    A, C = row.by_letter["a"][0], row.by_letter["c"][0]
    Bs, Fs = row.by_letter["b"], row.by_letter["f"]
    longest = max((block.lags for block in Fs), key=len, default=range(1, 1))
    in_f = len(longest) > 0 and row.a == 0
    regressors = [(x, block.lags) for x, block in zip(inputs, Bs, strict=True)]
    (a, *bs, c), _ = regress(y, [(-y, longest if in_f else A.lags), *regressors, (noise, C.lags)])
    denominators = [(block, a[: len(block.lags)]) for block in Fs] if in_f else [(A, a)]
    return _theta(row, [*denominators, *zip(Bs, bs, strict=True), (C, c)])


def _output_error(
    row: OutputOrders, inputs: list[Array], y: Array, targets: list[Array], *, coloured: bool
) -> Array:
    """B and F (or A) by Steiglitz and McBride on `targets`, then C and D from the residual."""
    A, C, D = (row.by_letter[letter][0] for letter in "acd")
    Bs, Fs = row.by_letter["b"], row.by_letter["f"]
    if any(block.lags for block in Fs) or row.a == 0:
        found = [
            _iterated(x, F.lags, [(x_in, B.lags)])
            for x, x_in, F, B in zip(targets, inputs, Fs, Bs, strict=True)
        ]
        bs, denominators = [b for _, (b,) in found], [f for f, _ in found]
        parts = [*zip(Bs, bs, strict=True), *((F, f[1:]) for F, f in zip(Fs, denominators, strict=True))]
        shaped = np.ones(1)
    else:
        regressors = [(x, B.lags) for x, B in zip(inputs, Bs, strict=True)]
        shaped, bs = _iterated(sum(targets, np.zeros_like(y)) if coloured else y, A.lags, regressors)
        denominators = [shaped] * len(bs)
        parts = [*zip(Bs, bs, strict=True), (A, shaped[1:])]
    if coloured and (row.c or row.d):
        v = y.copy()
        for b, f, x, entry in zip(bs, denominators, inputs, row.entries, strict=True):
            v -= filtered(np.concatenate([np.zeros(entry.delay), b]), f, x)
        v = filtered(shaped, [1.0], v)
        parts += zip((C, D), noise_polynomials(v, row.c, row.d), strict=True)
    return _theta(row, parts)


def noise_polynomials(v: Array, c: int, d: int) -> tuple[Array, Array]:
    """Return the coefficients after the first of C (c,) and D (d,), from samples v of C/D e."""
    long = max(1, min(10 + 2 * (c + d), v.size // 6))
    _, noise = regress(v, [(-v, range(1, long + 1))])
    (below, above), _ = regress(v, [(-v, range(1, d + 1)), (noise, range(1, c + 1))])
    return above, below


def _iterated(target: Array, below: range, above: list[tuple[Array, range]]) -> tuple[Array, list[Array]]:
    """A common denominator with these lags `below`, monic, and the numerators by Steiglitz and McBride."""
    F = np.ones(1)
    numerators: list[Array] = []
    for _ in range(_ITERATIONS if below else 1):
        y = filtered([1.0], F, target)
        smoothed = [(filtered([1.0], F, x), lags) for x, lags in above]
        (f, *numerators), _ = regress(y, [(-y, below), *smoothed])
        F = reflected(np.concatenate([[1.0], f]))
    return F, numerators


def _theta(row: OutputOrders, parts: Iterable[tuple[Block, Array]]) -> Array:
    theta = np.zeros(row.size)
    for block, values in parts:
        theta[block.columns] = values
    return theta
