"""Where to begin a prediction-error search: estimates that need no search.

A long ARX model gives an estimate of the noise and of the noise-free output. With the first, A, B and C
follow by linear regression (Hannan and Rissanen, Biometrika 69 (1982) 81-94); with the second, B and F by
Steiglitz and McBride's iteration (IEEE Trans. Automatic Control 10 (1965) 461-464) and C and D from what is
left.
"""

from __future__ import annotations

import numpy as np
import scipy.signal

from inputdesign_cli.identification.stability import reflected
from inputdesign_cli.identification.structure import Structure
from inputdesign_cli.plant.polynomial import Array

_ITERATIONS = 15
_LONGEST = 40


def starting_points(structure: Structure, u: Array, y: Array) -> Array:
    """(points, k): several starts for one record u, y (samples,)."""
    noise, noise_free = _long_model(structure, u, y)
    first = _equation_error(structure, u, y, noise)
    second = _output_error(structure, u, y, noise_free, coloured=True)
    third = _output_error(structure, u, y, y, coloured=False)
    points = np.array([first, second, third])
    return points[np.all(np.isfinite(points), axis=1)]


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


def _long_model(structure: Structure, u: Array, y: Array) -> tuple[Array, Array]:
    """Residuals of a long ARX model, and what it says that the input alone causes."""
    order = max(structure.a, structure.b, structure.c, structure.d, structure.f)
    order = max(1, min(max(4 * order, 10), y.size // 6, _LONGEST))
    (a, b), residual = regress(y, [(-y, range(1, order + 1)), (u, range(structure.delay, order + 1))])
    A = reflected(np.concatenate([[1.0], a]))
    B = np.concatenate([np.zeros(structure.delay), b])
    return residual, scipy.signal.lfilter(B, A, u)


def _equation_error(structure: Structure, u: Array, y: Array, noise: Array) -> Array:
    """A, B, C by regression; an output-error denominator F takes the place of a missing A."""
    lags = structure.lags
    in_f = structure.f > 0 and structure.a == 0
    left = lags["f"] if in_f else lags["a"]
    (a, b, c), _ = regress(y, [(-y, left), (u, lags["b"]), (noise, lags["c"])])
    parts = {"f" if in_f else "a": a, "b": b, "c": c}
    return _theta(structure, parts)


def _output_error(structure: Structure, u: Array, y: Array, target: Array, *, coloured: bool) -> Array:
    """B and F (or A) by Steiglitz and McBride on `target`, then C and D from the residual."""
    lags = structure.lags
    letter = "f" if structure.f else "a"
    F = np.ones(1)
    b = f = np.zeros(0)
    for _ in range(_ITERATIONS if lags[letter] else 1):
        filtered_u, filtered_y = scipy.signal.lfilter([1.0], F, u), scipy.signal.lfilter([1.0], F, target)
        (f, b), _ = regress(filtered_y, [(-filtered_y, lags[letter]), (filtered_u, lags["b"])])
        F = reflected(np.concatenate([[1.0], f]))
    parts = {"b": b, letter: F[1:]}
    if coloured and (structure.c or structure.d):
        B = np.concatenate([np.zeros(structure.delay), b])
        v = y - scipy.signal.lfilter(B, F, u)
        if letter == "a":
            v = scipy.signal.lfilter(F, [1.0], v)
        long = max(1, min(10 + 2 * (structure.c + structure.d), y.size // 6))
        _, noise = regress(v, [(-v, range(1, long + 1))])
        (parts["d"], parts["c"]), _ = regress(v, [(-v, lags["d"]), (noise, lags["c"])])
    return _theta(structure, parts)


def _theta(structure: Structure, parts: dict[str, Array]) -> Array:
    theta = np.zeros(structure.size)
    for letter, values in parts.items():
        theta[structure.columns[letter]] = values
    return theta
