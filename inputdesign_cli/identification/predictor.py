"""Prediction errors of the five-polynomial model and their exact gradient, for many runs at once.

epsilon = (D/C)(A y - (B/F) u) and psi = -d epsilon / d theta; Ljung, System Identification (1999),
Section 10.3. Signals are (samples, runs) and start from rest. They stream through in blocks of a few
samples, so that all that is made on the way stays in the cache.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.identification.filters import FEW, Stream
from inputdesign_cli.identification.structure import Polynomials, Structure
from inputdesign_cli.plant.polynomial import Array

_BLOCK = 32


def stream(
    structure: Structure, theta: Array, u: Array, y: Array, *, gradient: bool = True
) -> Iterator[tuple[slice, Array, list[Array]]]:
    """Block by block: which samples, epsilon (n, runs), and k columns of psi (n, runs) each.

    The arrays are views that hold until the next block.
    """
    p = structure.polynomials(theta)
    samples, runs = y.shape
    order = max(c.shape[1] for c in (p.A, p.B, p.C, p.D, p.F)) - 1
    rows = samples if runs < FEW else max(_BLOCK, order)
    flow = Stream(rows, order, runs)
    for start in range(0, samples, rows):
        flow.advance(min(rows, samples - start))
        part = slice(start, start + flow.length)
        flow.enter("u", u[part])
        flow.enter("y", y[part])
        flow.divide("u/F", "u", p.F)
        flow.multiply("G u", "u/F", p.B)
        flow.multiply("v", "y", p.A)
        flow.now("v")[:] -= flow.now("G u")
        flow.divide("v/C", "v", p.C)
        flow.multiply("errors", "v/C", p.D)
        if not gradient:
            yield part, flow.now("errors"), []
            continue
        _sources(structure, flow, p)
        columns = [flow.delayed(letter, lag) for letter, lags in structure.lags.items() for lag in lags]
        yield part, flow.now("errors"), columns


def _sources(structure: Structure, flow: Stream, p: Polynomials) -> None:
    """The signals a, b, c, d, f of which the columns of psi are delays."""
    flow.divide("u/CF", "u/F", p.C)
    flow.multiply("b", "u/CF", p.D)
    if structure.a:
        flow.divide("y/C", "y", p.C)
        flow.multiply("a", "y/C", -p.D)
    if structure.c:
        flow.divide("c", "errors", p.C)
    if structure.d:
        flow.multiply("d", "v/C", -np.ones((p.C.shape[0], 1)))
    if structure.f:
        flow.divide("b/F", "b", p.F)
        flow.multiply("f", "b/F", -p.B)


def prediction_errors(structure: Structure, theta: Array, u: Array, y: Array) -> Array:
    """epsilon (samples, runs) for theta (runs, k)."""
    out = np.empty(y.shape)
    for part, errors, _ in stream(structure, theta, u, y, gradient=False):
        out[part] = errors
    return out


def errors_and_gradient(
    structure: Structure, theta: Array, u: Array, y: Array
) -> tuple[Array, NDArray[np.float64]]:
    """epsilon (samples, runs) and psi (k, samples, runs)."""
    out, psi = np.empty(y.shape), np.empty((structure.size, *y.shape))
    for part, errors, columns in stream(structure, theta, u, y):
        out[part] = errors
        psi[:, part] = columns
    return out, psi


def moments(
    structure: Structure, theta: Array, u: Array, y: Array
) -> tuple[Array, NDArray[np.float64], Array]:
    """Sums over the samples: epsilon^2 (runs,), psi psi^T (runs, k, k), psi epsilon (runs, k)."""
    k, runs = structure.size, y.shape[1]
    cost, hessian, slope = np.zeros(runs), np.zeros((k, k, runs)), np.zeros((k, runs))
    for _, errors, columns in stream(structure, theta, u, y):
        cost += _dot(errors, errors)
        for i, left in enumerate(columns):
            slope[i] += _dot(left, errors)
            for j, right in enumerate(columns[: i + 1]):
                hessian[i, j] += _dot(left, right)
    lower = np.ascontiguousarray(np.moveaxis(hessian, -1, 0))
    full = lower + np.swapaxes(np.tril(lower, -1), 1, 2)
    return cost, full, np.ascontiguousarray(slope.T)


def _dot(left: Array, right: Array) -> Array:
    return np.einsum("tr,tr->r", left, right)
