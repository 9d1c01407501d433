"""Estimate what a nonlinearity does to a measured frequency response, from lines that were not excited.

An even nonlinearity answers odd harmonics at even ones, an odd one at odd ones
([pintelon-schoukens-2012], Sections 3.4 and 4.3). One of odd degree adds as much to each excited line as to
its neighbours, which is measured; the scatter of the periods shows how much of it is noise. It changes the
gain as well, at frequencies that no silent line shows.

The change is estimated as for a cubic of a Gaussian signal. With y = x + c x^3 and E x^2 = s the gain is
1 + 3 c s, and the rest of c x^3 has the mean square 6 c^2 s^3. The square of the relative change is 9/6 of
the ratio of the rest to the power of x. A third of the rest is beyond the highest line (three times the
band), so that the share that is seen counts 9/6 times 3/2.

A low crest factor leaves less power at silent lines for the same change. If the nonlinearity is static, at an
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

# Neighbouring lines over which the spectrum of the noise is taken to be flat, if it is not known.
_NEIGHBOURS = 15
_CHANGE_OF_GAIN = 9.0 / 6.0 * 3.0 / 2.0  # squared relative change of G over the share of power, see above


@dataclass(frozen=True)
class SilentLines:
    """The power of p outputs at `lines` lines without excitation."""

    lines: int
    over_noise: Array  # (p,) mean of the power there over that of the noise; about one for noise alone
    probability: Array  # (p,) probability that noise alone has as much, by an F test over all lines
    rms: Array  # (p,) rms of the outputs there beyond the noise
    beyond: Array  # (lines, p) mean squares beyond the noise, averaged over neighbouring lines


def silent_lines(Y: ComplexArray, shape: Array | None = None) -> SilentLines | None:
    """Return the power at silent lines from transforms (blocks, periods, lines, p); None without scatter.

    Args:
        shape: (lines, p), the spectrum of the noise up to a factor; None: that of the scatter, smoothed.
    """
    blocks, periods, lines, _ = Y.shape
    if lines == 0 or periods < 2:
        return None
    mean = Y.mean(axis=1, keepdims=True)
    noise = np.sum(np.abs(Y - mean) ** 2, axis=(0, 1)) / (blocks * (periods - 1))
    if np.any(noise <= 0.0):
        return None
    level: Array = periods * np.mean(np.abs(mean[:, 0]) ** 2, axis=0)
    even = _smoothed(noise) if shape is None else shape
    # Divided by the shape of the noise spectrum, all lines have the same weight.
    ratio = np.sum(level / even, axis=0) / np.sum(noise / even, axis=0)
    freedom = 2 * blocks * lines
    # If strong noise at some lines hides the sum, the power beyond it is taken to have its shape.
    like_noise = (ratio - 1.0) * np.mean(noise / even, axis=0) * np.sum(even, axis=0)
    plain = np.sum(level - noise, axis=0)
    beyond = np.where(plain > 0.0, plain, np.maximum(like_noise, 0.0))
    return SilentLines(
        lines,
        np.asarray(ratio),
        np.asarray(scipy.special.fdtrc(freedom, freedom * (periods - 1), ratio)),
        np.sqrt(2.0 * beyond / periods),
        np.maximum(_smoothed(level - noise), 0.0) / periods,
    )


def _smoothed(noise: Array) -> Array:
    """Return means over neighbouring lines (lines, p), near the ends over equally many nearest ones."""
    window = min(_NEIGHBOURS, len(noise))
    sums = np.concatenate([np.zeros((1, noise.shape[1])), np.cumsum(noise, axis=0)])
    first = np.clip(np.arange(len(noise)) - window // 2, 0, len(noise) - window)
    return np.asarray((sums[first + window] - sums[first]) / window)


def response_error(
    found: PeriodicResponse, period: int, kept: int, odd: SilentLines, harmonics: NDArray[np.int_]
) -> Array:
    """Return the mean-square errors (L, p, r) of G at the excited lines: added part and change of gain.

    The response is from `kept` periods of `period` samples in all; `odd` is the power at odd lines without
    excitation, at these `harmonics`.
    """

    def between(known: NDArray[np.int_], values: Array, at: NDArray[np.int_]) -> Array:
        return np.stack([np.interp(np.log(at), np.log(known), column) for column in values.T], axis=1)

    added = between(harmonics, odd.beyond, found.harmonics)
    of_inverse = kept * period * found.deviation**2 / found.noise[:, :, None]  # sum over blocks of |U^-1|^2
    # The share of the added power at the outputs, or divided by |G|^2 at the inputs; the larger one counts.
    gain = np.sum(np.abs(found.G) ** 2, axis=2)
    seen = between(found.harmonics, gain, harmonics)
    shares = np.maximum(
        (odd.beyond.sum(axis=0) + added.sum(axis=0)) / found.explained.sum(axis=0),
        ((odd.beyond / seen).sum(axis=0) + (added / gain).sum(axis=0)) / (found.explained / gain).sum(axis=0),
    )
    changed = _CHANGE_OF_GAIN * shares[None, :, None] * np.abs(found.G) ** 2
    return np.asarray(np.sqrt(added[:, :, None] * of_inverse + changed))


@dataclass(frozen=True)
class Cubes:
    """The cube that explains most of the power of each of p outputs at silent lines."""

    error: Array  # (L, p, r): its change of G at the excited lines
    probability: Array  # (p,): probability that noise alone looks as much like one of the cubes
    source: NDArray[np.int_]  # (p,): the input (from zero) that is cubed, or -1: the output


def cubes(
    found: PeriodicResponse,
    u: Array,
    y: Array,
    periods: Periods,
    silent: NDArray[np.int_],
    model: tuple[ComplexArray, ComplexArray],
    shape: Array,
    *,
    repeats: int = 1,
) -> Cubes:
    """Return the cubes from records (N, r) and (N, p) whose odd harmonics (n,) `silent` are not excited.

    Args:
        model: a rough G at the lines of `found` and at the silent ones, to interpolate the measured one.
        shape: (n, p), the spectrum of the noise at the silent lines, up to a factor.
        repeats: see `Periods.parts`.
    """
    lines, transforms = found.harmonics, periods.transforms(y, repeats)
    # Mean transforms (harmonics, channels, blocks).
    U, Y = (
        np.moveaxis(signal.mean(axis=1), 0, -1) for signal in (periods.transforms(u, repeats), transforms)
    )
    excited = np.zeros_like(Y)
    excited[lines] = Y[lines]
    varying = (np.concatenate([0.0 * X[:1], X[1:]]) * periods.period for X in (U, excited))
    signals = (np.fft.irfft(X, periods.period, axis=0) for X in varying)  # about zero
    of_input, of_output = (np.fft.rfft(x**3, axis=0) / periods.period for x in signals)
    at_silent, at_lines = (
        # Responses to the cube of each input, then cubes of the outputs: (candidates, lines, p, blocks).
        np.stack([*np.einsum("npr,nrb->rnpb", G, of_input[at]), of_output[at]])
        for G, at in ((_carried(lines, found.G, *model, silent), silent), (found.G, lines))
    )
    factor, probability = _fitted(at_silent, transforms[:, :, silent], shape)
    best = np.argmin(probability, axis=0)
    outputs = np.arange(best.size)
    added = np.moveaxis(at_lines[best, :, outputs], 0, 1) * factor[best, outputs, None]
    return Cubes(
        np.abs(added @ np.linalg.inv(U[lines])),
        np.minimum(len(probability) * probability[best, outputs], 1.0),
        np.where(best == len(at_silent) - 1, -1, best),
    )


def _carried(
    lines: NDArray[np.int_],
    G: ComplexArray,
    model: ComplexArray,
    model_there: ComplexArray,
    there: NDArray[np.int_],
) -> ComplexArray:
    """Return G (n, p, r) interpolated between lines as a ratio to the model, whose phase turns less."""
    carried = np.empty_like(model_there)
    for i, j in np.ndindex(G.shape[1:]):
        usable = bool(np.all(np.abs(model[:, i, j]) > 1e-3 * np.abs(G[:, i, j])))
        ratio = G[:, i, j] / model[:, i, j] if usable else G[:, i, j]
        carried[:, i, j] = np.interp(there, lines, ratio) * (model_there[:, i, j] if usable else 1.0)
    return carried


def _fitted(cubed: ComplexArray, Y: ComplexArray, shape: Array) -> tuple[Array, Array]:
    """Return factors (candidates, p) of cubes (candidates, n, p, blocks), and their probabilities by chance.

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
