"""Estimate drifts of outputs under repeated inputs, from the means of whole periods.

A ramp is the same in every period, but for its level. The scatter of the periods does not show it. It adds to
all lines, excited or not, as a nonlinearity does. The means of the periods show it: without drift they vary
by noise alone once the plant has settled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.periodic_response import Periods

_MOST_DEGREE = 3
_CERTAIN = 1e-4


@dataclass(frozen=True)
class PeriodDrift:
    """Polynomials in time that outputs (N, p) drift along.

    Attributes:
        curve: (N, p), about zero where an output does not drift.
        degree: (p,), zero where it does not.
    """

    curve: Array
    degree: NDArray[np.int_]


def period_drift(
    y: Array, time: Array, periods: Periods, noise: Array, *, repeats: int = 1
) -> PeriodDrift | None:
    """Return the drift of outputs (N, p) beyond chance, record by record, or None if nothing drifts.

    The mean of a period has the variance Phi(0) / period. A degree counts if the means have more of the
    orthogonal polynomial of that degree than chance has with 1e-4 for all outputs, records and degrees.

    Args:
        time: (N,), at which samples were taken, in any unit.
        noise: (p,), the spectrum of the noise towards frequency zero.
        repeats: how many records of equal length follow each other.
    """
    curves, degrees = [], []
    rare = 0.5 * _CERTAIN / (_MOST_DEGREE * repeats * y.shape[1])
    far = -float(scipy.special.ndtri(rare)) * np.sqrt(noise / periods.period)
    for one, at in zip(np.split(y, repeats), np.split(time, repeats), strict=True):
        powers, triangle, along = _along(one, at, periods, _MOST_DEGREE)
        beyond = np.abs(along[1:]) > far
        degree = np.max(beyond * np.arange(1, len(along))[:, None], axis=0, initial=0)
        kept = np.where(np.arange(len(along))[:, None] <= degree, along, 0.0)
        curves.append(_curve(powers, triangle, kept))
        degrees.append(degree)
    most = np.max(degrees, axis=0)
    return PeriodDrift(np.concatenate(curves), most) if np.any(most) else None


def line_of_periods(y: Array, periods: Periods) -> Array:
    """Return the lines (N, p) about zero that fit the means of the periods of outputs (N, p)."""
    return _curve(*_along(y, np.arange(float(len(y))), periods, 1))


def _along(y: Array, time: Array, periods: Periods, most: int) -> tuple[Array, Array, Array]:
    """Powers of time (N, m), the triangle (m, m) that orthogonalises their means, and what y has of each."""
    scaled = (time - time.mean()) / max(float(np.ptp(time)), np.finfo(float).tiny)
    count = periods.blocks * periods.kept(len(y))
    powers = scaled[:, None] ** np.arange(min(most + 1, count))
    basis, triangle = np.linalg.qr(_means(powers, periods))
    return powers, triangle, np.asarray(basis.T @ _means(y, periods))


def _means(signals: Array, periods: Periods) -> Array:
    """(blocks * kept, channels)."""
    return np.asarray(periods.parts(signals).mean(axis=2).reshape(-1, signals.shape[1]))


def _curve(powers: Array, triangle: Array, along: Array) -> Array:
    weights = np.linalg.solve(triangle, along)
    return np.asarray(powers[:, 1:] @ weights[1:])
