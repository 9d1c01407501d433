"""Polynomials in the delay operator q^-1, coefficients ascending."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import ComplexArray

_latest: list[tuple[NDArray, ComplexArray]] = [(np.zeros(0), np.zeros(0, dtype=complex))]
_WORTH_KEEPING = 128  # frequencies; fewer are sooner computed than compared
_MODERATE = 1e100  # quotients up to this are no overflow


def unit_circle(w: ArrayLike) -> ComplexArray:
    """q^-1 at normalised frequencies `w` (rad/sample), same shape.

    With w - j rho it is on a circle of radius e^-rho: the transform of signals weighted with e^(-rho t).
    """
    at = np.asarray(w)
    asked, known = _latest[0]
    # G, H and their gradients are asked for at the same frequencies in turn, also for similar plants.
    if at.shape == asked.shape and np.array_equal(at, asked):
        return known
    q = np.asarray(np.exp(-1j * at))
    if at.size < _WORTH_KEEPING:
        return q
    q.setflags(write=False)
    _latest[0] = (at.copy(), q)
    return q


def frequencies_last(*shape: int) -> ComplexArray:
    """Zeros of this shape, frequencies first, that lie side by side in memory for each of the rest."""
    return np.zeros((*shape[1:], shape[0]), dtype=complex).transpose(len(shape) - 1, *range(len(shape) - 1))


def evaluate(coefficients: ArrayLike, q: ComplexArray) -> ComplexArray:
    """Value of sum_i coefficients[i] q^i at each element of `q` (q stands for q^-1).

    Several polynomials (S, l) have values (S, ..).
    """
    stated = np.asarray(coefficients, dtype=float)
    if stated.ndim == 2 and len(stated) > 1:
        columns = stated.T.reshape(stated.shape[1], len(stated), *(1 for _ in np.shape(q)))
        several = np.zeros((len(stated), *np.shape(q)), dtype=complex)
        several += columns[-1]
        for column in columns[-2::-1]:
            several *= q
            several.real += column
        return several
    if stated.ndim == 2:
        return evaluate(stated[0], q)[None]
    c = stated.tolist()
    if len(c) == 1:
        return np.full(np.shape(q), c[0], dtype=complex)
    value: ComplexArray = c[-1] * q
    value += c[-2]
    for coefficient in c[-3::-1]:  # Horner
        value *= q
        value += coefficient
    return value


def roots_in_z(coefficients: ArrayLike) -> ComplexArray:
    """Roots in z = q of a polynomial in q^-1; leading zeros (pure delay) contribute none.

    Trailing zeros are roots at the origin and are left out: they neither resonate nor destabilise.
    """
    c = np.asarray(coefficients, dtype=float)
    there = np.flatnonzero(c)
    if there.size < 2:
        return np.zeros(0, dtype=complex)
    first, last = int(there[0]), int(there[-1])
    if last == first + 1 and abs(c[last]) <= _MODERATE * abs(c[first]):  # by far the most are of first order
        return np.asarray(-c[last : last + 1] / c[first], dtype=complex)
    return np.asarray(np.roots(c[first : last + 1]), dtype=complex)


def join_roots(parts: Iterable[ComplexArray]) -> ComplexArray:
    """All roots of several polynomials in one array."""
    listed = [np.asarray(p, dtype=complex) for p in parts]
    return np.concatenate(listed) if listed else np.zeros(0, dtype=complex)
