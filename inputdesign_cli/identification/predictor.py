"""Prediction errors of one output of a polynomial model and their exact gradient, for many runs at once.

epsilon = (D/C)(A y - sum_j (B_j/F_j) u_j) and psi = -d epsilon / d theta ([ljung-1999], Section
10.3). Signals are (samples, runs) and start from rest. They stream through in blocks of a
few samples, so that all that is made on the way stays in the cache.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.filters import FEW, Stream
from inputdesign_cli.identification.orders import OutputOrders, Polynomials

_BLOCK = 32


def block_length(samples: int, runs: int, order: int) -> int:
    """Return how many samples pass at a time where filters have at most this `order`."""
    return samples if runs < FEW else max(_BLOCK, order)


def stream(
    row: OutputOrders, theta: Array, u: Sequence[Array], y: Array, length: int, *, gradient: bool = True
) -> Iterator[tuple[slice, Array, list[Array]]]:
    """Block by block: which samples, epsilon (n, runs), and k columns of psi (n, runs) each.

    The arrays are views that hold until the next block.

    Args:
        row: the orders of the output.
        theta: (runs, k), of this output alone.
        u: all inputs of the model, (samples, runs) each.
        y: the output (samples, runs).
        length: samples of a block, see `block_length`.
        gradient: whether psi is wanted.
    """
    p = row.polynomials(theta)
    samples, runs = y.shape
    flow = Stream(length, p.order, runs)
    for start in range(0, samples, length):
        flow.advance(min(length, samples - start))
        part = slice(start, start + flow.length)
        flow.enter("y", y[part])
        flow.multiply("v", "y", p.A)
        for e, entry in enumerate(row.entries):
            flow.enter(f"u{e}", u[entry.input][part])
            flow.divide(f"u/F{e}", f"u{e}", p.F[e])
            flow.multiply(f"G u{e}", f"u/F{e}", p.B[e])
            flow.now("v")[:] -= flow.now(f"G u{e}")
        flow.divide("v/C", "v", p.C)
        flow.multiply("errors", "v/C", p.D)
        if not gradient:
            yield part, flow.now("errors"), []
            continue
        _sources(row, flow, p)
        columns = [flow.delayed(block.source, lag) for block in row.blocks for lag in block.lags]
        yield part, flow.now("errors"), columns


def _sources(row: OutputOrders, flow: Stream, p: Polynomials) -> None:
    """Return the signals of which the columns of psi are delays; see `Block.source`."""
    for e, entry in enumerate(row.entries):
        flow.divide(f"u/CF{e}", f"u/F{e}", p.C)
        flow.multiply(f"b{e}", f"u/CF{e}", p.D)
        if entry.f:
            flow.divide(f"b/F{e}", f"b{e}", p.F[e])
            flow.multiply(f"f{e}", f"b/F{e}", -p.B[e])
    if row.a:
        flow.divide("y/C", "y", p.C)
        flow.multiply("a", "y/C", -p.D)
    if row.c:
        flow.divide("c", "errors", p.C)
    if row.d:
        flow.multiply("d", "v/C", -np.ones((p.C.shape[0], 1)))


def prediction_errors(row: OutputOrders, theta: Array, u: Sequence[Array], y: Array) -> Array:
    """Return epsilon (samples, runs) for theta (runs, k)."""
    out = np.empty(y.shape)
    length = block_length(y.shape[0], y.shape[1], row.polynomials(theta).order)
    for part, errors, _ in stream(row, theta, u, y, length, gradient=False):
        out[part] = errors
    return out


def errors_and_gradient(
    row: OutputOrders, theta: Array, u: Sequence[Array], y: Array
) -> tuple[Array, NDArray[np.float64]]:
    """Return epsilon (samples, runs) and psi (k, samples, runs)."""
    out, psi = np.empty(y.shape), np.empty((row.size, *y.shape))
    length = block_length(y.shape[0], y.shape[1], row.polynomials(theta).order)
    for part, errors, columns in stream(row, theta, u, y, length):
        out[part] = errors
        psi[:, part] = columns
    return out, psi
