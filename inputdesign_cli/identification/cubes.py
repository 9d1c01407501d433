"""Estimate what a cube within a plant does to a measured frequency response, from lines not excited.

The power at silent lines alone does not determine what a nonlinearity changes at excited ones. Signals of
low peaks leave little power there, and the gain changes all the same. If the nonlinearity is static, at an
input or at the output, the signal itself gives its cubic part up to a factor. The part of the outputs at
silent lines in phase with it gives the factor, and so the change at every excited line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.identification.periodic_response import PeriodicResponse, Periods


@dataclass(frozen=True)
class Cubes:
    """The cube that explains most of the power of each of p outputs at silent lines.

    Attributes:
        error: (L, p, r): its change of G at the excited lines.
        probability: (p,): that noise alone looks as much like one of the cubes.
        source: (p,): the input (from zero) that is cubed, or -1: the output.
    """

    error: NDArray[np.float64]
    probability: Array
    source: NDArray[np.int_]


def cubes(
    found: PeriodicResponse,
    u: Array,
    y: Array,
    periods: Periods,
    silent: NDArray[np.int_],
    model: tuple[ComplexArray, ComplexArray],
    shape: NDArray[np.float64],
    *,
    repeats: int = 1,
) -> Cubes:
    """Return the cubes from records (N, r) and (N, p) with odd harmonics (n,) that are silent.

    Args:
        model: a rough G at the lines of `found` and at the silent ones, which the measured one is carried by.
        shape: (n, p) of the spectrum of the noise at the silent lines, up to a factor.
        repeats: how many records of equal length with the same input follow each other.
    """
    U, Y = (_mean(signal, periods, repeats) for signal in (u, y))
    lines = found.harmonics
    of_input, of_output = _cubed(U, periods.period), _cubed(_only(Y, lines), periods.period)
    G = _carried(lines, found.G, *model, silent)
    at_silent = np.stack([*_through(G, of_input[silent]), of_output[silent]])
    at_lines = np.stack([*_through(found.G, of_input[lines]), of_output[lines]])
    factor, probability = _fitted(at_silent, _transforms(y, periods, repeats)[:, :, silent], shape)
    best = np.argmin(probability, axis=0)
    outputs = np.arange(best.size)
    added = np.moveaxis(at_lines[best, :, outputs], 0, 1) * factor[best, outputs, None]
    return Cubes(
        np.abs(added @ np.linalg.inv(U[lines])),
        np.minimum(len(probability) * probability[best, outputs], 1.0),
        np.where(best == len(at_silent) - 1, -1, best),
    )


def _transforms(signal: Array, periods: Periods, repeats: int) -> ComplexArray:
    """Return the transforms of all records (blocks, periods, harmonics, channels)."""
    return np.concatenate([periods.transforms(one) for one in np.split(signal, repeats)], axis=1)


def _mean(signal: Array, periods: Periods, repeats: int) -> ComplexArray:
    """Return mean transforms (harmonics, channels, blocks), with the level zero."""
    mean = np.moveaxis(_transforms(signal, periods, repeats).mean(axis=1), 0, -1)
    mean[0] = 0.0
    return mean


def _only(Y: ComplexArray, lines: NDArray[np.int_]) -> ComplexArray:
    """Return Y at these lines, and zero at all others, which contain noise alone."""
    kept = np.zeros_like(Y)
    kept[lines] = Y[lines]
    return kept


def _cubed(X: ComplexArray, period: int) -> ComplexArray:
    """Return the transforms of the cubes of signals, harmonics first."""
    signal = np.fft.irfft(X * period, period, axis=0)
    return np.asarray(np.fft.rfft(signal**3, axis=0) / period)


def _through(G: ComplexArray, cubed: ComplexArray) -> list[ComplexArray]:
    """Return the effect of the cube of each of r inputs on the outputs (n, p, blocks)."""
    return [G[:, :, j, None] * cubed[:, None, j] for j in range(cubed.shape[1])]


def _carried(
    lines: NDArray[np.int_],
    G: ComplexArray,
    model: ComplexArray,
    model_there: ComplexArray,
    there: NDArray[np.int_],
) -> ComplexArray:
    """G (n, p, r) at harmonics between lines; what it is over the model turns less than it does itself."""
    carried = np.empty_like(model_there)
    for i, j in np.ndindex(G.shape[1:]):
        usable = bool(np.all(np.abs(model[:, i, j]) > 1e-3 * np.abs(G[:, i, j])))
        ratio = G[:, i, j] / model[:, i, j] if usable else G[:, i, j]
        between = np.interp(there, lines, ratio.real) + 1j * np.interp(there, lines, ratio.imag)
        carried[:, i, j] = between * (model_there[:, i, j] if usable else 1.0)
    return carried


def _fitted(
    cubed: ComplexArray, Y: ComplexArray, shape: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(candidates, p): the factor of each cube (candidates, n, p, blocks), and how likely noise has as much.

    Args:
        Y: (blocks, periods, n, p).
    """
    blocks, kept, lines, _ = Y.shape
    mean = Y.mean(axis=1, keepdims=True)
    freedom = 2 * blocks * (kept - 1) * lines
    noise = 2.0 * np.sum(np.abs(Y - mean) ** 2 / shape, axis=(0, 1, 2)) / freedom
    power = np.sum(np.abs(cubed) ** 2 / shape[:, :, None], axis=(1, 3))
    alike = np.sum(np.real(cubed.conj() * np.moveaxis(mean[:, 0], 0, -1)) / shape[:, :, None], axis=(1, 3))
    factor = alike / np.maximum(power, 1e-300)
    deviation = np.sqrt(noise / (2.0 * kept * np.maximum(power, 1e-300)))
    return factor, np.asarray(2.0 * scipy.special.stdtr(freedom, -np.abs(factor) / deviation))
