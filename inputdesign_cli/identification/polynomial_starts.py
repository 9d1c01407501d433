"""Where to begin a prediction-error search: estimates that need no search.

A long ARX model gives an estimate of the noise and of the noise-free output. With the first, A, B and C
follow by linear regression ([hannan-rissanen-1982]); with the second, B and F by the iteration of
[steiglitz-mcbride-1965], and C and D from the residual. With several inputs the iteration takes one at a
time, on the output less the responses to the others.
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.polynomial_rows import Coefficients, Row
from inputdesign_cli.identification.records import shifted
from inputdesign_cli.identification.stability import reflected
from inputdesign_cli.plant.filtering import filtered

Parts = list[tuple[Coefficients, Array]]
"""Coefficients and their values."""

_ITERATIONS = 15
_LONGEST = 40  # the highest order of the long ARX model


def starting_points(row: Row, size: int, u: Array, y: Array) -> Array:
    """Return starting points (points, k) for one output y (N,) and all inputs u (N, r); k is the `size`."""
    inputs = [u[:, j] for j in row.inputs]
    highest = max(one.lags.stop for one in row.all) - 1
    order = max(1, min(max(4 * highest, 10), y.size // (3 * (len(inputs) + 1)), _LONGEST))
    lags = [range(b.lags.start, order + 1) for b in row.b]
    (a, *bs), noise = regress(y, [(-y, range(1, order + 1)), *zip(inputs, lags, strict=True)])
    A = reflected(np.append(1.0, a))
    # The response of this long ARX model to each input alone.
    responses = [_caused(b, A, of.start, x) for b, x, of in zip(bs, inputs, lags, strict=True)]
    left = y - sum(responses, np.zeros_like(y))
    found = [
        _equation_error(row, inputs, y, noise),
        _output_error(row, inputs, y, responses, coloured=True),
        _output_error(row, inputs, y, [left + x for x in responses], coloured=False),
    ]
    points = np.zeros((len(found), size))
    for point, parts in zip(points, found, strict=True):
        for one, values in parts:
            point[one.columns] = values
    # C and D that nearly cancel, at low and at high frequency, are often separate minima.
    for sign in (1.0, -1.0) if row.c.lags and row.d.lags else ():
        point = points[1].copy()
        for one, root in ((row.c, 0.85), (row.d, 0.95)):
            point[one.columns] = -sign * root * np.eye(1, len(one.lags))[0]
        points = np.vstack([points, point])
    return points[np.all(np.isfinite(points), axis=1)]


def regress(y: Array, regressors: list[tuple[Array, range]]) -> tuple[list[Array], Array]:
    """Estimate y(t) from x(t - lag) by least squares; return coefficients by regressor, and the residual."""
    columns = [shifted(x, lag, (x.size,)) for x, lags in regressors for lag in lags]
    if not columns:
        return [np.zeros(0) for _ in regressors], y
    matrix = np.stack(columns, axis=1)
    solution = np.linalg.lstsq(matrix, y, rcond=None)[0]
    ends = np.cumsum([len(lags) for _, lags in regressors])[:-1]
    return list(np.split(solution, ends)), y - matrix @ solution


def _caused(b: Array, F: Array, delay: int, x: Array) -> Array:
    return filtered(np.concatenate([np.zeros(delay), b]), F, x)


def _equation_error(row: Row, inputs: list[Array], y: Array, noise: Array) -> Parts:
    """Estimate A, B, C by regression; output-error denominators F take the place of a missing A."""
    longest = max((f.lags for f in row.f), key=len, default=range(1, 1))
    in_f = len(longest) > 0 and not row.a.lags
    regressors = [(x, b.lags) for x, b in zip(inputs, row.b, strict=True)]
    (a, *bs, c), _ = regress(y, [(-y, longest if in_f else row.a.lags), *regressors, (noise, row.c.lags)])
    denominators = [(f, a[: len(f.lags)]) for f in row.f] if in_f else [(row.a, a)]
    return [*denominators, *zip(row.b, bs, strict=True), (row.c, c)]


def _output_error(row: Row, inputs: list[Array], y: Array, targets: list[Array], *, coloured: bool) -> Parts:
    """Estimate B and F (or A) by Steiglitz and McBride on `targets`, then C and D from the residual."""
    if any(f.lags for f in row.f) or not row.a.lags:
        found = [
            _iterated(target, f.lags, [(x, b.lags)])
            for target, x, f, b in zip(targets, inputs, row.f, row.b, strict=True)
        ]
        bs, denominators = [b for _, (b,) in found], [f for f, _ in found]
        parts = [
            *zip(row.b, bs, strict=True),
            *((of, f[1:]) for of, f in zip(row.f, denominators, strict=True)),
        ]
        shaped = np.ones(1)
    else:
        regressors = [(x, b.lags) for x, b in zip(inputs, row.b, strict=True)]
        shaped, bs = _iterated(sum(targets, np.zeros_like(y)) if coloured else y, row.a.lags, regressors)
        denominators = [shaped] * len(bs)
        parts = [*zip(row.b, bs, strict=True), (row.a, shaped[1:])]
    if coloured and (row.c.lags or row.d.lags):
        v = y.copy()
        for b, f, x, of in zip(bs, denominators, inputs, row.b, strict=True):
            v -= _caused(b, f, of.lags.start, x)
        v = filtered(shaped, [1.0], v)
        parts += zip((row.c, row.d), noise_polynomials(v, len(row.c.lags), len(row.d.lags)), strict=True)
    return parts


def noise_polynomials(v: Array, c: int, d: int) -> tuple[Array, Array]:
    """Return the coefficients after the first of C (c,) and D (d,), from samples v of C/D e."""
    long = max(1, min(10 + 2 * (c + d), v.size // 6))
    _, noise = regress(v, [(-v, range(1, long + 1))])
    (below, above), _ = regress(v, [(-v, range(1, d + 1)), (noise, range(1, c + 1))])
    return above, below


def _iterated(target: Array, below: range, above: list[tuple[Array, range]]) -> tuple[Array, list[Array]]:
    """Estimate a common monic denominator at lags `below`, and numerators, by Steiglitz and McBride."""
    F = np.ones(1)
    numerators: list[Array] = []
    for _ in range(_ITERATIONS if below else 1):
        y = filtered([1.0], F, target)
        smoothed = [(filtered([1.0], F, x), lags) for x, lags in above]
        (f, *numerators), _ = regress(y, [(-y, below), *smoothed])
        F = reflected(np.concatenate([[1.0], f]))
    return F, numerators
