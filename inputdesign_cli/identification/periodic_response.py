"""The frequency response from inputs that repeat, line by line: means of the periods, and their scatter.

[pintelon-schoukens-2012], Section 2.5. With r inputs the record has r blocks of periods whose lines differ in
their phases, so that the matrix U of inputs by blocks has an inverse at every line: G = Y U^-1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray

_EXCITED = 1e-6  # the least size of an excited line, relative to the largest
# Up to this share of the input power, a difference between periods is noise, which excited lines must exceed
# with the probability _SURE. Beyond it the inputs do not repeat.
_REPEAT = 0.1
_SURE = 0.99
# The highest power of time in a drift, and the probability that noise is taken for a drift.
_MOST_DEGREE, _CERTAIN = 3, 1e-4


@dataclass(frozen=True)
class Periods:
    """The periods of a record: equal blocks of whole periods, of which the first few are transient."""

    period: int  # samples
    blocks: int = 1  # as many as inputs
    skip: int = 0  # periods at the start of each block that do not count

    def each(self, samples: int) -> int:
        """Return the number of whole periods per block in a record of `samples` samples."""
        return samples // (self.period * self.blocks)

    def kept(self, samples: int) -> int:
        """Return the number of periods per block that count."""
        return self.each(samples) - self.skip

    def transforms(self, signal: Array, repeats: int = 1) -> ComplexArray:
        """Return amplitudes (.., blocks, kept, harmonics, channels) of signals (.., N, channels)."""
        return np.asarray(np.fft.rfft(self.parts(signal, repeats), axis=-2) / self.period)

    def means(self, signal: Array, harmonics: NDArray[np.int_]) -> ComplexArray:
        """Return the transforms at harmonics of the mean period, (.., L, channels, blocks)."""
        found = np.fft.rfft(self.parts(signal).mean(axis=-3), axis=-2)[..., harmonics, :] / self.period
        return np.asarray(np.moveaxis(found, -3, -1))

    def parts(self, signal: Array, repeats: int = 1) -> Array:
        """Return the periods of signals that count, (.., blocks, kept, period, channels), to the end.

        Args:
            repeats: number of records of equal length with the same input that follow each other. Their
                periods that count stand one after the other.
        """
        if repeats > 1:
            return np.concatenate([self.parts(one) for one in np.split(signal, repeats, axis=-2)], axis=-3)
        *runs, samples, channels = signal.shape
        each = self.each(samples)
        used = signal[..., samples - self.blocks * each * self.period :, :]
        parts = used.reshape(*runs, self.blocks, each, self.period, channels)
        return parts[..., self.skip :, :, :]


@dataclass(frozen=True)
class PeriodicResponse:
    """G (L, p, r) at harmonics, with its uncertainty from the scatter of the periods."""

    harmonics: NDArray[np.int_]
    G: ComplexArray
    deviation: Array  # (L, p, r): standard deviation of the entries, the rms of |error|
    noise: Array  # (L, p): the spectrum of the noise; for white noise it is the variance
    explained: Array  # (L, p): mean squares of the part that the inputs explain, per line
    freedom: int  # degrees of freedom of each variance, counted as complex numbers


def excited_harmonics(x: Array, periods: Periods) -> NDArray[np.int_]:
    """Return the harmonics between 0 and pi at which some channel of x (N, r) has power."""
    size = np.abs(periods.transforms(x)).mean(axis=(0, 1)).max(axis=1)
    size = size[: (periods.period + 1) // 2]
    size[0] = 0.0
    return np.flatnonzero(size > _EXCITED * size.max(initial=0.0))


def differing(u: Array, periods: Periods, *, repeats: int = 1) -> float:
    """Return the share of the power of inputs (N, r) by which the periods of all records differ."""
    lines = periods.transforms(u, repeats)[:, :, 1:]
    other = float(np.sum(np.abs(lines - lines.mean(axis=1, keepdims=True)) ** 2))
    return other / max(float(np.sum(np.abs(lines) ** 2)), 1e-300)


def excited_lines(
    u: Array, periods: Periods, harmonics: NDArray[np.int_], *, repeats: int = 1
) -> NDArray[np.bool_]:
    """Return whether inputs (N, r) exceed rounding and noise at each of the harmonics, (L,)."""
    U = periods.transforms(u, repeats)
    mean = np.moveaxis(U.mean(axis=1), 0, -1)  # (harmonics, r, blocks)
    size = np.sqrt(np.mean(np.abs(mean[1:]) ** 2, axis=(0, 2)))
    if np.any(size <= _EXCITED**2 * np.abs(u).max(axis=0)):
        return np.zeros(harmonics.size, dtype=np.bool_)
    singular = np.linalg.svd(mean / size[:, None], compute_uv=False)
    excited = singular[harmonics, -1] > _EXCITED * singular[1:, 0].max()
    kept, freedom = U.shape[1], periods.blocks * (U.shape[1] - 1)
    if differing(u, periods, repeats=repeats) <= _REPEAT:
        power = kept * np.mean(np.abs(mean[harmonics]) ** 2, axis=2)
        scatter = np.sum(np.abs(U - U.mean(axis=1, keepdims=True)) ** 2, axis=(0, 1))[harmonics] / freedom
        beyond = float(scipy.special.fdtri(2 * periods.blocks, 2 * freedom, _SURE))
        excited &= np.all(power > beyond * scatter, axis=1)
    return np.asarray(excited)


def response_at(U: ComplexArray, Y: ComplexArray) -> ComplexArray:
    """Return G (.., L, p, r) from means of inputs (L, r, r) and outputs (.., L, p, r), inputs by blocks."""
    return np.asarray(Y @ np.linalg.inv(U))


def periodic_response(
    u: Array, y: Array, periods: Periods, harmonics: NDArray[np.int_], *, repeats: int = 1
) -> PeriodicResponse | None:
    """Return G from two or more periods of u (N, r) and y (N, p); None if inputs are not separable."""
    U, Y = (periods.transforms(signal, repeats)[:, :, harmonics] for signal in (u, y))
    kept = U.shape[1]
    inputs, outputs = (np.moveaxis(part.mean(axis=1), 0, -1) for part in (U, Y))
    if not harmonics.size or np.any(np.linalg.cond(inputs) > 1.0 / _EXCITED):
        return None
    G = response_at(inputs, outputs)
    left = Y - np.einsum("lpr,bklr->bklp", G, U)
    freedom = periods.blocks * (kept - 1)
    scatter = np.sum(np.abs(left) ** 2, axis=(0, 1)) / freedom
    inverse = np.linalg.inv(inputs)
    spread = np.sum(np.abs(inverse) ** 2, axis=1) / kept
    variance = scatter[:, :, None] * spread[:, None, :]
    explained = np.mean(np.abs(G @ inputs) ** 2, axis=2)
    return PeriodicResponse(harmonics, G, np.sqrt(variance), periods.period * scatter, explained, freedom)


class PeriodDrift(NamedTuple):
    """Polynomials in time that outputs (N, p) drift along.

    A ramp is the same in every period, but for its level, so that their scatter does not show it. It adds to
    all lines, excited or not, as a nonlinearity does. The means of the periods show it: without drift they
    vary by noise alone once the plant has settled.
    """

    curve: Array  # (N, p), about zero where an output does not drift
    degree: NDArray[np.int_]  # (p,), zero where it does not


def period_drift(
    y: Array, time: Array, periods: Periods, noise: Array, *, repeats: int = 1
) -> PeriodDrift | None:
    """Return the drift of outputs (N, p) beyond chance, record by record, or None if nothing drifts.

    The mean of a period has the variance Phi(0) / period. A degree counts if the means have more of its
    orthogonal polynomial than by chance, at 1e-4 for all outputs, records and degrees.

    Args:
        time: (N,), in any unit; `noise` (p,) the spectrum of the noise towards frequency zero.
    """
    curves, degrees = [], []
    rare = 0.5 * _CERTAIN / (_MOST_DEGREE * repeats * y.shape[1])
    far = -float(scipy.special.ndtri(rare)) * np.sqrt(noise / periods.period)
    for one, at in zip(np.split(y, repeats), np.split(time, repeats), strict=True):
        polynomials, along = _along(one, at, periods, _MOST_DEGREE)
        order = np.arange(len(along))[:, None]
        degree = np.max((np.abs(along) > far) * order, axis=0)
        curves.append(polynomials @ np.where(order <= degree, along, 0.0))
        degrees.append(degree)
    most = np.max(degrees, axis=0)
    return PeriodDrift(np.concatenate(curves), most) if np.any(most) else None


def line_of_periods(y: Array, periods: Periods) -> Array:
    """Return the straight lines (N, p) about zero that fit the means of the periods of outputs (N, p)."""
    polynomials, along = _along(y, np.arange(float(len(y))), periods, 1)
    return np.asarray(polynomials @ along)


def _along(y: Array, time: Array, periods: Periods, most: int) -> tuple[Array, Array]:
    """Return polynomials (N, m) of time, with orthonormal period means up to levels, and y's coefficients."""
    scaled = (time - time.mean()) / max(float(np.ptp(time)), np.finfo(float).tiny)
    count = periods.blocks * periods.kept(len(y))
    powers = scaled[:, None] ** np.arange(min(most + 1, count))

    def means(signals: Array) -> Array:
        return np.asarray(periods.parts(signals).mean(axis=2).reshape(-1, signals.shape[1]))

    basis, triangle = np.linalg.qr(means(powers))
    weights = np.linalg.inv(triangle)
    weights[0] = 0.0
    return powers @ weights, np.asarray(basis.T @ means(y))
