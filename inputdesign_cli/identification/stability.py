"""Test whether all roots of polynomials lie inside the unit circle, and mirror the others into it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array

# A root is never moved closer to the circle than this.
_MARGIN = 1e-3
# A root that is nearer counts as on it. Specs refuse roots within rounding of the circle.
_ON_THE_CIRCLE = 1e-9
# A sum of coefficients up to this share of their sizes is zero to rounding of decimals.
_EXACT = 1e-12


def is_stable(monic: Array) -> NDArray[np.bool_]:
    """Return whether all roots in z of each polynomial (runs, m + 1) lie inside the unit circle, (runs,).

    By the step-down recursion: the reflection coefficients are below one in modulus, by more than rounding.
    """
    stable = np.ones(monic.shape[0], dtype=bool)
    p = monic
    with np.errstate(over="ignore", invalid="ignore"):  # an unstable polynomial may overflow
        while p.shape[1] > 1:
            last = p[:, -1:]
            stable &= np.abs(last[:, 0]) < 1.0 - _ON_THE_CIRCLE
            room = np.where(np.abs(last) < 1.0, 1.0 - last**2, 1.0)
            p = ((p - last * p[:, ::-1]) / room)[:, :-1]
    return stable


def without_integrators(monic: Array) -> Array:
    """Return a polynomial in q^-1 divided by 1 - q^-1 as often (n times) as possible, (m + 1 - n,)."""
    while monic.size > 1 and abs(np.sum(monic)) <= _EXACT * np.sum(np.abs(monic)):
        monic = np.cumsum(monic)[:-1]
    return monic


def reflected(monic: Array) -> Array:
    """Return a polynomial (m + 1,) with its roots outside the unit circle mirrored at it."""
    roots = np.roots(monic)
    modulus = np.abs(roots)
    roots = np.where(modulus >= 1.0, roots / np.maximum(modulus, 1.0) ** 2, roots)
    modulus = np.maximum(np.abs(roots), 1e-300)
    roots = roots * np.minimum(1.0, (1.0 - _MARGIN) / modulus) ** (modulus > 1.0 - _ON_THE_CIRCLE)
    return np.atleast_1d(np.asarray(np.poly(roots).real, dtype=float))
