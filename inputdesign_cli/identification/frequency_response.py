"""Estimate the frequency response of a plant from data alone, without a model, and its uncertainty.

If the inputs repeat, it follows line by line from mean and scatter of the periods ([pintelon-schoukens-2012],
Section 2.5). Otherwise a local polynomial is used (Section 7.3): around each frequency, responses and the
leakage of start and end are parabolas, fitted to a few lines of the Fourier transforms. A parabola does not
follow the phase of a long dead time: if one is known, inputs are delayed by it first. Signals x from outside,
for example the reference of a loop, are instruments: G is the response of y to x over the response of u.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.identification.nonlinearity import SilentLines, silent_lines
from inputdesign_cli.identification.periodic_response import (
    PeriodicResponse,
    Periods,
    excited_harmonics,
    line_of_periods,
    periodic_response,
)
from inputdesign_cli.plant import Model

CONFIDENCE = 0.95
_MOST_FREQUENCIES = 200
_FREEDOM = 8  # the fewest degrees of freedom of the residuals of a local fit
_PARABOLA = 3  # coefficients
_BEGINNING, _TRIED = 16, 20  # first samples that must recur; recurrences tried as the period
_DEPENDENT = 1e-7  # relative singular value up to which inputs are not separable
# A pulse response begins where it reaches this share of its largest value.
_BEGUN = 0.1

REPEATS = 1e-9
"""The largest difference between successive periods, as a share of the size of the signal."""

Method = Literal["lines", "local_polynomial"]
_Records = Sequence[tuple[Array, Array, Array]]  # x, u, y of each, (N, channels)
_Lines = Sequence[tuple[NDArray, ...]]  # frequencies, and the transforms of x, u and y there
# G (p, r), its radius, the noise and the coherence (p,), at one frequency.
_Found = tuple[ComplexArray, Array, Array, Array]


@dataclass(frozen=True)
class FrequencyResponse:
    """An estimate of G at n frequencies."""

    frequency: Array  # (n,), rad/sample
    G: ComplexArray  # (n, p, r)
    radius: Array  # (n, p, r): the radius of the disc about G that holds the true G with 95 %
    # (n, p): the spectrum of the unexplained part of y, for white noise its variance.
    noise: Array
    coherence: Array  # (n, p): the share of the spectrum of y that the inputs explain
    method: Method  # how it was estimated


def frequency_response(
    u: Array,
    y: Array,
    x: Array | None = None,
    *,
    lengths: Sequence[int] | None = None,
    delays: NDArray[np.int64] | None = None,
) -> FrequencyResponse | None:
    """Return the response from consecutive records; None if they are too short or excite no frequency enough.

    Args:
        u, y: (N, r), (N, p).
        x: (N, r), the external excitation; None: u itself, which then must not depend on y.
        delays: presumed delays of the inputs (p, r), in samples; ignored with external signals.
    """
    at = np.cumsum(lengths or [len(y)])[:-1]
    outside = u if x is None else x
    records = list(zip(*(np.split(signal, at) for signal in (outside, u, y)), strict=True))
    if len(records) == 1 and u.shape[1] == 1 and (period := found_period(outside[:, 0])):
        periods = _settled(period, len(y))
        response = periodic_response(u, y, periods, excited_harmonics(outside, periods))
        return None if response is None else of_periods(response, period)
    late = x is None and delays is not None and np.any(delays)
    found = _delayed(delays, records) if late and delays is not None else _local_polynomial(records)
    return _usable(found) or _usable(_local_polynomial(records))


def _settled(period: int, samples: int) -> Periods:
    """Return periods of which the first is transient, if there are three or more."""
    return Periods(period, skip=int(samples // period > 2))


def found_period(x: Array) -> int:
    """Return the period of a signal (N,) that repeats at least twice, otherwise 0."""
    tolerance = REPEATS * float(np.abs(x).max())
    if x.size < 2:
        return 0
    begin = x[: min(_BEGINNING, x.size // 2)]  # short enough to recur
    windows = np.lib.stride_tricks.sliding_window_view(x[1 : x.size // 2 + begin.size], begin.size)
    same = np.flatnonzero(np.all(np.abs(windows - begin) <= tolerance, axis=1)) + 1
    repeated = (p for p in same[same <= x.size // 2][:_TRIED] if np.all(np.abs(x[p:] - x[:-p]) <= tolerance))
    return int(next(repeated, 0))


def response_delays(model: Model, samples: int, *, step: float) -> NDArray[np.int64]:
    """Return the samples (p, r) until a pulse response first has a tenth of its largest value, otherwise 0.

    Responses later than the record of `samples` samples, `step` apart in continuous time, are not seen.
    """
    pulses = np.zeros((model.inputs, samples, model.inputs))
    pulses[np.arange(model.inputs), 0, np.arange(model.inputs)] = 1.0
    with np.errstate(over="ignore", invalid="ignore"):  # responses of an unstable plant
        caused, _ = model.simulate(pulses, np.zeros((model.inputs, samples, model.outputs)), step)
    size = np.abs(np.nan_to_num(caused, nan=0.0, posinf=0.0, neginf=0.0))
    return np.asarray(np.argmax(size >= _BEGUN * size.max(axis=1, keepdims=True), axis=1).T)


def silent_in(u: Array, y: Array) -> dict[str, SilentLines]:
    """Return the output power at the harmonics, odd and even, that a periodic input does not excite.

    Args:
        u: one input (N, 1).
        y: the outputs (N, p).
    """
    period = found_period(u[:, 0]) if u.shape[1] == 1 else 0
    if not period:
        return {}
    periods = _settled(period, len(y))
    # A drift is the same ramp in every period, and would add power at all lines.
    level = y - line_of_periods(y, periods)
    silent = np.setdiff1d(np.arange(1, (period + 1) // 2), excited_harmonics(u, periods))
    kinds = {"odd": silent[silent % 2 == 1], "even": silent[silent % 2 == 0]}
    found = {kind: silent_lines(periods.transforms(level)[:, :, at]) for kind, at in kinds.items()}
    return {kind: lines for kind, lines in found.items() if lines is not None}


def of_periods(found: PeriodicResponse, period: int) -> FrequencyResponse:
    """Return the response from periods of `period` samples, with discs of confidence."""
    return FrequencyResponse(
        2.0 * np.pi * found.harmonics / period,
        found.G,
        _radius(found.deviation**2, found.freedom),
        found.noise,
        _coherence(found.explained, found.noise / period),
        "lines",
    )


def _local_polynomial(records: _Records) -> FrequencyResponse | None:
    """Return the response at lines of the longest record, NaN where inputs are not separable."""
    inputs, longest, window = records[0][1].shape[1], max(len(y) for *_, y in records), _window(records)
    if min(len(y) for *_, y in records) < 2 * window + 4:
        return None
    transformed = [
        (
            2.0 * np.pi * np.arange(len(record[0])) / len(record[0]),
            *(np.fft.fft(signal, axis=0) / np.sqrt(len(signal)) for signal in record),
        )
        for record in records
    ]
    # Many lines are thinned out evenly on a logarithmic axis.
    last = (longest - 1) // 2
    lines = np.arange(1, last + 1)
    if last > _MOST_FREQUENCIES:
        lines = np.unique(np.geomspace(1, last, _MOST_FREQUENCIES).round())
    frequency = np.asarray(2.0 * np.pi * lines / longest)
    found: list[_Found] = []
    for w in frequency:
        G, radius, noise, coherence = _at(w, transformed, window, inputs, _PARABOLA)
        # The bias of a parabola where G bends: at most its distance from a straight line, beyond the noise.
        straight = _at(w, transformed, window, inputs, _PARABOLA - 1)[0]
        apart = np.nan_to_num(np.abs(G - straight) ** 2)
        found.append((G, radius + np.sqrt(np.maximum(apart - radius**2, 0.0)), noise, coherence))
    responses, discs, spectra, shares = (np.array(values) for values in zip(*found, strict=True))
    return FrequencyResponse(frequency, responses, discs, spectra, shares, "local_polynomial")


def _usable(found: FrequencyResponse | None) -> FrequencyResponse | None:
    """Return the response at its finite frequencies; None if there are none."""
    if found is None or not np.any(at := np.all(np.isfinite(found.radius), axis=(1, 2))):
        return None
    G, radius, noise, coherence = found.G[at], found.radius[at], found.noise[at], found.coherence[at]
    return FrequencyResponse(found.frequency[at], G, radius, noise, coherence, found.method)


def _window(records: _Records) -> int:
    """Return the number of lines of each record that the parabolas are fitted to."""
    unknowns = _PARABOLA * (records[0][1].shape[1] + len(records))
    return -(-(unknowns + _FREEDOM) // len(records)) + 1


def _delayed(delays: NDArray[np.int64], records: _Records) -> FrequencyResponse | None:
    """Return the response to delayed inputs, output by output, without the samples that lie before them."""
    found, begin = [], int(delays.max())
    for i, late in enumerate(delays):
        moved = []
        for _, u, y in records:
            if len(y) > begin:
                own = np.stack([u[begin - d : len(u) - d, j] for j, d in enumerate(late)], axis=1)
                moved.append((own, own, y[begin:, i : i + 1]))
        one = _local_polynomial(moved) if moved else None
        if one is None:
            return None
        turned = np.exp(-1j * np.outer(one.frequency, late))[:, None]
        found.append((one.G * turned, one.radius, one.noise, one.coherence))
        frequency = one.frequency
    G, radius, noise, coherence = (np.concatenate(values, axis=1) for values in zip(*found, strict=True))
    return FrequencyResponse(frequency, G, radius, noise, coherence, "local_polynomial")


def _at(w: float, transformed: _Lines, window: int, inputs: int, terms: int) -> _Found:
    """Return the local estimate at w from polynomials of some terms; NaN if inputs are not separable."""
    rows, targets = [], []
    for number, (lines, X, U, Y) in enumerate(transformed):
        last = (lines.size - 1) // 2
        first = int(np.clip(np.searchsorted(lines, w) - window // 2, 1, last - window + 1))
        near = slice(first, first + window)
        powers = ((lines[near] - w) / (window * lines[1]))[:, None] ** np.arange(terms)
        leakage = np.zeros((window, len(transformed), terms))
        leakage[:, number] = powers
        responses = X[near][:, None, :] * powers[:, :, None]
        rows.append(np.concatenate([responses.reshape(window, -1), leakage.reshape(window, -1)], axis=1))
        targets.append(np.concatenate([Y[near], U[near]], axis=1))
    matrix, target = np.concatenate(rows), np.concatenate(targets)
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    left, singular, right = np.linalg.svd(matrix / scale, full_matrices=False)
    outputs = target.shape[1] - inputs
    entries, each = np.full((outputs, inputs), np.nan), np.full(outputs, np.nan)
    if singular[-1] <= _DEPENDENT * singular[0]:
        return entries + 0j, entries, each, each
    inverse = (right.conj().T / singular) @ left.conj().T / scale[:, None]
    found = inverse @ target
    from_x = found[:inputs].T
    to_u = from_x[outputs:]
    if np.linalg.cond(to_u) > 1.0 / _DEPENDENT:
        return entries + 0j, entries, each, each
    back = np.linalg.inv(to_u)
    G = from_x[:outputs] @ back
    residuals = target - matrix @ found
    errors = residuals[:, :outputs] - residuals[:, outputs:] @ G.T
    freedom = len(matrix) - matrix.shape[1]
    power = np.sum(np.abs(errors) ** 2, axis=0) / freedom
    explained = np.mean(np.abs(target[:, outputs:] @ G.T) ** 2, axis=0)
    coherence = _coherence(explained, power)
    if inputs == 1:
        spread = float(np.sum(np.abs(inverse[:1]) ** 2))
        return G, _radius_of_ratio(from_x[:, 0], residuals, spread, freedom), power, coherence
    spreads = np.sum(np.abs(back.T @ inverse[:inputs]) ** 2, axis=1)
    return G, _radius(np.outer(power, spreads), freedom), power, coherence


def _radius_of_ratio(from_x: ComplexArray, residuals: ComplexArray, spread: float, freedom: int) -> Array:
    """Return the radius (p, 1) of discs about G = y/u that hold every G which y - G u does not refute.

    If x is a reference, u has an error as well. The region is a disc about another centre ([fieller-1954]);
    NaN if it is unbounded.

    Args:
        from_x: (p + 1,), responses of the outputs and of the input to x.
        residuals: (n, p + 1), residuals of the regression on x.
        spread: variance of these responses, relative to the variance of the residuals.
    """
    within = spread * float(scipy.special.fdtri(2, 2 * freedom, CONFIDENCE))
    *outputs, u = from_x
    *errors, of_u = residuals.T
    size = abs(u) ** 2 - within * np.sum(np.abs(of_u) ** 2) / freedom
    if size <= 0.0:
        return np.full((len(outputs), 1), np.nan)
    found = []
    for y, e in zip(outputs, errors, strict=True):
        centre = (y * np.conj(u) - within * np.vdot(of_u, e) / freedom) / size
        rest = (abs(y) ** 2 - within * np.sum(np.abs(e) ** 2) / freedom) / size
        found.append(abs(centre - y / u) + np.sqrt(max(abs(centre) ** 2 - rest, 0.0)))
    return np.array(found)[:, None]


def _coherence(explained: Array, noise: Array) -> Array:
    return np.asarray(explained / np.maximum(explained + noise, 1e-300))


def _radius(variance: Array, freedom: int) -> Array:
    """Return the radius of confidence: |error|^2 / variance follows F with 2 and 2 `freedom` degrees."""
    return np.asarray(np.sqrt(variance * scipy.special.fdtri(2, 2 * freedom, CONFIDENCE)))
