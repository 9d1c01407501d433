"""Propose departures from a linear time-invariant plant: an input whose gain changes, or its speed.

G u is replaced by G (u + x f), with a signal f that is made of the same input: the input itself after a
part of the record, or times a ramp; a power of it, its sign, the direction of its last move. Prediction
errors are linear in u, so that their response to f is the gradient with respect to x. If x is not zero there
is no single G: small changes of u see a different one in each state of the plant. Examples of states are
early and late, or near the middle of the range and far from it.

If a plant heats faster than it cools, f is made of its output: T (1 + x s) dy/dt + y = K u, where s is
the direction in which y moves, is to first order T dy/dt + y = K u - x T |dy/dt|. The added term acts without
the dead time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.adequacy import Fault
from inputdesign_cli.identification.directed import Alternative
from inputdesign_cli.identification.records import Records, split
from inputdesign_cli.plant import Model

# A signal that lies on a straight line but for this share is the input itself.
_STRAIGHT = 1e-6
_PARTS = {"a quarter": 0.25, "half": 0.5, "three quarters": 0.75}

RISING = "rising"
"""The last word of the name of a gain that changes evenly."""


class _Tried(NamedTuple):
    """A trial signal f (N,) that is made of an input scaled to size one."""

    name: str
    phrase: str
    fault: Fault
    f: Array
    gains: tuple[float, ...]  # df/du, one for each state of the plant
    moves: tuple[float, ...] = (0.0,)  # what a change of the output from sample to sample adds in each state
    early: int = 0  # by how many samples that acts early

    def slopes(self, channel: int, size: float, model: Model, w: ArrayLike) -> NDArray[np.complex128]:
        """Return the derivative (states, n, p, r) of G by x, for an input of this size."""
        G = model.plant_at(w)
        own, moving = np.zeros_like(G), np.zeros_like(G)
        own[..., channel] = G[..., channel]
        turned = np.exp(1j * np.asarray(w, dtype=float))
        change = size * (1.0 - 1.0 / turned) * turned**self.early
        moving[..., channel] = change[:, None] * G[..., channel] ** 2
        moves = np.resize(self.moves, len(self.gains))
        return np.asarray(np.multiply.outer(np.array(self.gains), own) + np.multiply.outer(moves, moving))


def variations(records: Records, theta: Array, simulated: Array | None) -> tuple[Alternative, ...]:
    """Return the alternatives for each input, and for the speed of a plant with one input and output.

    For an input with two values, powers and sign are the input itself about a level: they add nothing.

    Args:
        theta: (k,), the estimate.
        simulated: (N, p), the response to the inputs; None if it cannot be simulated, or frequencies are not
            in rad/sample.
    """
    found, u, lengths = [], records.u, records.lengths
    for channel, samples in enumerate(u.T):
        name, size = "u" if u.shape[1] == 1 else f"u{channel + 1}", float(np.std(samples))
        x = (samples - np.mean(samples)) / max(size, 1e-300)
        tried = [*_changes(name, x), *_curves(name, x, lengths)]
        if simulated is not None and u.shape[1] == simulated.shape[1] == 1:
            tried += _one_way(x, simulated[:, 0], records.kind.lateness(theta) + 1, lengths)
        for one in tried:
            # What the signal beside the input adds to the outputs, as minus prediction errors.
            only = np.outer(size * one.f, np.arange(u.shape[1]) == channel)
            parts = tuple(split(only, np.zeros_like(records.y), lengths))
            column = -replace(records, parts=parts).from_rest(theta)[0]
            slopes = partial(one.slopes, channel, size)
            found.append(Alternative(one.name, one.phrase, one.fault, column, slopes))
    return tuple(found)


def _changes(name: str, x: Array) -> Iterator[_Tried]:
    """Yield the signal of a gain of x (N,) that rises evenly, and of gains that jump during the record."""
    time = np.arange(x.size) / x.size
    phrase = f"a gain of {name} that rises or falls evenly during the record"
    yield _Tried(f"{name} {RISING}", phrase, "change", (time - 0.5) * x, (-0.5, 0.5))
    for part, share in _PARTS.items():
        phrase = f"another gain of {name} after {part} of the record"
        yield _Tried(f"{name} after {part}", phrase, "change", np.where(time >= share, x, 0.0), (0.0, 1.0))


def _curves(name: str, x: Array, lengths: Sequence[int]) -> Iterator[_Tried]:
    """Yield the signals of gains that depend on samples x (N,), of mean zero and size one."""
    moves = []
    for own in np.split(x, np.cumsum(lengths)[:-1]):
        # The direction in which x last moved; before it first does, the other one.
        signs = np.sign(np.diff(own, prepend=own[:1]))
        first = np.flatnonzero(signs)[:1]
        signs[0] = -signs[first[0]] if first.size else 0.0
        moves.append(signs[np.maximum.accumulate(np.where(signs != 0.0, np.arange(own.size), 0))])
    for of, phrase, f, gains in (
        # One deviation below and above the middle.
        (f"{name}^2", f"a gain of {name} that depends on its level", x**2, (-2.0, 2.0)),
        (f"{name}^3", f"a gain of {name} that depends on its amplitude", x**3, (0.0,)),
        (f"sign of {name}", f"a dead zone or friction at {name}", np.sign(x), (0.0,)),
        (f"last move of {name}", f"play or hysteresis at {name}", np.concatenate(moves), (0.0,)),
    ):
        bent, slope = _bent(f, x, lengths)
        if np.linalg.norm(bent) > _STRAIGHT * np.linalg.norm(f):
            yield _Tried(of, phrase, "nonlinear", bent, tuple(gain - slope for gain in gains))


def _one_way(x: Array, simulated: Array, early: int, lengths: Sequence[int]) -> Iterator[_Tried]:
    """Yield the signal of a plant of inputs x (N,) that is slower where its output (N,) rises than falls."""
    each = (np.diff(own, prepend=own[:1]) for own in np.split(simulated, np.cumsum(lengths)[:-1]))
    changes = np.concatenate([np.append(own, np.zeros(early))[early:] for own in each])
    scale = float(np.std(changes))
    if not (np.all(np.isfinite(changes)) and scale > 0.0):
        return
    bent, slope = _bent(np.abs(changes) / scale, x, lengths)
    if np.linalg.norm(bent) > _STRAIGHT * np.sqrt(len(x)):
        phrase = "a plant that is slower where y rises than where it falls, or the other way round"
        states = (-slope, -slope), (-1.0 / scale, 1.0 / scale)
        yield _Tried("direction of y", phrase, "nonlinear", bent, *states, early)


def _bent(f: Array, x: Array, lengths: Sequence[int]) -> tuple[Array, float]:
    """Return f (N,) less its straight-line fit in x, record by record, and the mean slope of these lines."""
    ends = np.cumsum(lengths)[:-1]
    bent, slopes = [], []
    for own, by in zip(np.split(f, ends), np.split(x, ends), strict=True):
        line = np.column_stack([np.ones_like(by), by])
        coefficients = np.linalg.lstsq(line, own, rcond=None)[0]
        bent.append(own - line @ coefficients)
        slopes.append(coefficients[1])
    return np.concatenate(bent), float(np.average(slopes, weights=lengths))
