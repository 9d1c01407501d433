"""What u and e cause at the outputs of polynomials in q^-1, sample by sample, from rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.signal

from inputdesign_cli.plant.polynomial import Array


def caused_by_inputs(
    A: Sequence[Array], B: Sequence[Sequence[Array]], F: Sequence[Sequence[Array]], u: Array
) -> Array:
    """G u (.., n, p) for samples u (.., n, r).

    Args:
        A: one polynomial an output.
        B, F: one polynomial an entry, rows of columns; an entry of B that is zero causes nothing.
    """
    y = np.zeros((*u.shape[:-1], len(B)))
    for i, row in enumerate(B):
        for j, b in enumerate(row):
            if np.any(b):
                y[..., i] += scipy.signal.lfilter(b, np.convolve(A[i], F[i][j]), u[..., j])
    return y


def caused_by_noise(A: Sequence[Array], C: Sequence[Array], D: Sequence[Array], e: Array) -> Array:
    """H e (.., n, p) for samples e (.., n, p) and one polynomial an output."""
    v = np.empty(e.shape)
    for i, (a, c, d) in enumerate(zip(A, C, D, strict=True)):
        v[..., i] = scipy.signal.lfilter(c, np.convolve(a, d), e[..., i])
    return v
