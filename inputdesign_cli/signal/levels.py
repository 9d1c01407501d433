"""Signals of two or three levels with a wanted spectrum, and pseudo-random binary sequences.

A two-level signal cannot have any spectrum that one likes. These start from a multisine of the wanted line
powers whose phases make its fourth power small, so that its modulus hardly varies and little is lost by
taking signs. Then they alternate between the two things wanted: the nearest signal of these levels, and the
nearest one with these line powers, its own phases kept. Discrete-interval binary signals of specified line
powers are due to A. van den Bos and R. G. Krol, Int. J. Control 30 (1979) 871-884. What is lost against the
designed spectrum is measured on the record's own information.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.signal

from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.crest import optimise_phases
from inputdesign_cli.signal.sinusoids import Sinusoids

# The 4-norm alone makes the modulus even.
EVEN, EVEN_STEPS = (4,), 60
_ROUNDS = 60
_LONGEST_REGISTER = 32


def two_level(lines: Sinusoids, rng: np.random.Generator) -> Array:
    """(samples,) of +1 and -1: one period whose line powers are near those of `lines` (on the grid)."""
    return _of_lines(lines, rng, signs)


def three_level(lines: Sinusoids, rng: np.random.Generator) -> Array:
    """(samples,) of +1, 0 and -1 likewise; the share of zeros is what fits best."""
    return _of_lines(lines, rng, signs_and_zeros)


def pseudo_random(bits: int, samples: int, rng: np.random.Generator) -> Array:
    """(samples,) of +1 and -1: a maximum length sequence of 2^bits - 1 values, repeated, from a random start.

    Its spectrum is flat, whatever was designed.
    """
    if not 2 <= bits <= _LONGEST_REGISTER:
        raise ValueError(f"no register of {bits} bits")
    state = rng.integers(0, 2, bits)
    if not state.any():
        state[0] = 1
    length = min(samples, 2**bits - 1)
    sequence, _ = scipy.signal.max_len_seq(bits, state=state, length=length)
    return np.resize(2.0 * sequence - 1.0, samples)


def register_length(samples: int) -> int:
    """The shortest register whose sequence does not repeat within `samples`."""
    return min(max(2, int(np.ceil(np.log2(samples + 1)))), _LONGEST_REGISTER)


def alternate(
    start: Array, nearest: Callable[[Array], Array], restored: Callable[[Array], tuple[Array, float]]
) -> Array:
    """The best signal of few levels that is met on the way between the two things wanted.

    Args:
        start: the first signal of any values.
        nearest: the signal of few levels next to one of any values.
        restored: the signal with the wanted spectrum next to one of few levels, and the misfit of that.
    """
    levels = nearest(start)
    best, least = levels, np.inf
    for _ in range(_ROUNDS):
        wanted, misfit = restored(levels)
        if misfit < least:
            best, least = levels, misfit
        following = nearest(wanted)
        if np.array_equal(following, levels):
            break
        levels = following
    return best


def _of_lines(lines: Sinusoids, rng: np.random.Generator, nearest: Callable[[Array], Array]) -> Array:
    """The levels whose line powers, at their best scale, fit best."""
    phases = optimise_phases(lines, lines.random_phases(rng), powers=EVEN, steps=EVEN_STEPS)
    magnitude = np.zeros(lines.samples // 2 + 1)
    magnitude[lines.harmonics] = lines.samples * lines.amplitudes * np.where(lines.real, 1.0, 0.5)

    def restored(levels: Array) -> tuple[Array, float]:
        transform = np.fft.rfft(levels)
        modulus = np.abs(transform)
        fit = float(magnitude @ modulus / (modulus @ modulus))
        misfit = float(np.sum((magnitude - fit * modulus) ** 2))
        direction = np.where(modulus > 0, transform, 1.0) / np.where(modulus > 0, modulus, 1.0)
        return np.fft.irfft(magnitude * direction, lines.samples), misfit

    return alternate(lines.record(phases), nearest, restored)


def signs(record: Array) -> Array:
    """The nearest multiple of a signal of -1 and 1."""
    return np.where(record >= 0.0, 1.0, -1.0)


def signs_and_zeros(record: Array) -> Array:
    """The nearest multiple of a signal of -1, 0, 1: the m largest values are kept, m the best of all."""
    size = np.abs(record)
    order = np.sort(size)[::-1]
    kept = np.argmax(np.cumsum(order) / np.sqrt(np.arange(1, size.size + 1)))
    return np.where(size >= order[kept], np.sign(record), 0.0)
