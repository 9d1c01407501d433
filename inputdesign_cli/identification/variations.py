"""What a plant that is linear and stays the same does without: an input whose gain changes, or its speed.

In place of G u stands G (u + x f), with a signal f that is made of the same input: the input itself after a
part of the record, or times a ramp; a power of it, its sign, the direction of its last move. Prediction
errors are linear in u, so that their response to f is the gradient with respect to x. Where x is not zero
there is no single G: small changes of u see another one in each state of the plant, such as early and late,
or near the middle of the range and far from it.

Of a plant that heats faster than it cools f is made of its output: T (1 + x s) dy/dt + y = K u, where s is
the direction in which y moves, is to first order T dy/dt + y = K u - x T |dy/dt|. What is added acts without
the dead time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.adequacy import Fault
from inputdesign_cli.identification.records import Record, Records
from inputdesign_cli.identification.white import Echo
from inputdesign_cli.plant import Model

# A signal that lies on a straight line but for this share is the input itself.
_STRAIGHT = 1e-6
_PARTS = {"a quarter": 0.25, "half": 0.5, "three quarters": 0.75}

_Tried = tuple[str, str, Fault, Array, tuple[float, ...]]
"""Name, phrase, fault, f and its slopes in each state, of an input of size one."""


@dataclass(frozen=True)
class Variation:
    """A gain of one input that is not always the same; an `Alternative`.

    Attributes:
        channel: of the input.
        signal: f (N,), of the samples of all records one after the other, in the unit of the input.
        gains: df/du, one for each state of the plant.
        moves: of f that depends on how much the output changes from sample to sample, what a change adds to f
            in each state; zero of others. It acts `early` by so many samples.
        record: makes the record of samples u (N, r), y (N, p) that the structure is to explain.
        theta: (k,), the estimate.
    """

    name: str
    phrase: str
    fault: Fault
    channel: int
    signal: Array
    gains: tuple[float, ...]
    moves: tuple[float, ...]
    early: int
    record: Callable[[Array, Array], Record]
    theta: Array

    @property
    def lag(self) -> bool:
        """No."""
        return False

    def column(self, records: Records) -> NDArray[np.float64]:
        """(N, p): minus the derivative of the prediction errors with respect to x."""
        only = np.zeros_like(records.u)
        only[:, self.channel] = self.signal
        pieces = np.split(only, np.cumsum(records.lengths)[:-1])
        outputs = records.y.shape[1]
        parts = (self.record(piece, np.zeros((len(piece), outputs))) for piece in pieces)
        return -np.concatenate([part.errors_and_gradient(self.theta)[0] for part in parts])

    def slopes(self, model: Model, w: ArrayLike) -> NDArray[np.complex128]:
        """(states, n, p, r): the derivative of G with respect to x in each state."""
        G = model.plant_at(w)
        own, moving = np.zeros_like(G), np.zeros_like(G)
        own[..., self.channel] = G[..., self.channel]
        turned = np.exp(1j * np.asarray(w, dtype=float))
        change = (1.0 - 1.0 / turned) * turned**self.early
        moving[..., self.channel] = change[:, None] * G[..., self.channel] ** 2
        return np.asarray(
            np.multiply.outer(np.array(self.gains), own) + np.multiply.outer(np.array(self.moves), moving)
        )

    def echo(self, lengths: Sequence[int]) -> Echo | None:
        """None: f is made of inputs."""
        return None

    def estimated(self, records: Records) -> None:
        """None: no model of a linear plant has x."""
        return


def variations(
    record: Callable[[Array, Array], Record],
    theta: Array,
    u: Array,
    lengths: Sequence[int],
    simulated: Array | None,
    late: int,
) -> tuple[Variation, ...]:
    """What is tried of each input, and of the speed of a plant with one input and output.

    Of an input with two values powers and sign are the input itself about a level: they say nothing.

    Args:
        record: makes the record of samples (N, r), (N, p) that the structure is to explain.
        theta: (k,), the estimate.
        u: (N, r), of all records one after the other.
        lengths: of the records.
        simulated: (N, p), what the inputs cause; None where that cannot be simulated, or frequencies are not
            in rad/sample.
        late: samples by which the plant answers later than a lag behind a hold does.
    """
    found = []
    for channel, samples in enumerate(u.T):
        name, size = "u" if u.shape[1] == 1 else f"u{channel + 1}", float(np.std(samples))
        x = (samples - np.mean(samples)) / max(size, 1e-300)
        found += [
            Variation(of, phrase, fault, channel, size * f, gains, (0.0,) * len(gains), 0, record, theta)
            for of, phrase, fault, f, gains in (*_changes(name, x), *_curves(name, x, lengths))
        ]
        if simulated is not None and u.shape[1] == simulated.shape[1] == 1:
            found += _one_way(x, size, simulated[:, 0], late, lengths, record, theta)
    return tuple(found)


def _one_way(
    x: Array,
    size: float,
    simulated: Array,
    late: int,
    lengths: Sequence[int],
    record: Callable[[Array, Array], Record],
    theta: Array,
) -> Iterator[Variation]:
    """A plant of input samples size x (N,) that is slower where its output (N,) rises than where it falls."""
    early = late + 1
    changes = np.concatenate(
        [
            np.append(np.diff(own, prepend=own[:1]), np.zeros(early))[early:]
            for own in np.split(simulated, np.cumsum(lengths)[:-1])
        ]
    )
    scale = float(np.std(changes))
    if not (np.all(np.isfinite(changes)) and scale > 0.0):
        return
    bent, slope = _bent(np.abs(changes) / scale, x, lengths)
    if np.linalg.norm(bent) > _STRAIGHT * np.sqrt(len(x)):
        yield Variation(
            "direction of y",
            "a plant that is slower where y rises than where it falls, or the other way round",
            "nonlinear",
            0,
            size * bent,
            (-slope, -slope),
            (-size / scale, size / scale),
            early,
            record,
            theta,
        )


def _changes(name: str, x: Array) -> Iterator[_Tried]:
    """Yield a gain of samples x (N,) that rises evenly, and gains that jump during the record."""
    time = np.arange(x.size) / x.size
    phrase = f"a gain of {name} that rises or falls evenly during the record"
    yield f"{name} rising", phrase, "change", (time - 0.5) * x, (-0.5, 0.5)
    for part, share in _PARTS.items():
        phrase = f"another gain of {name} after {part} of the record"
        yield f"{name} after {part}", phrase, "change", np.where(time >= share, x, 0.0), (0.0, 1.0)


def _curves(name: str, x: Array, lengths: Sequence[int]) -> Iterator[_Tried]:
    """The gain of samples x (N,), of mean zero and size one, depends on them."""
    level, amplitude = (f"a gain of {name} that depends on its {what}" for what in ("level", "amplitude"))
    moves = np.concatenate([_last_moves(own) for own in np.split(x, np.cumsum(lengths)[:-1])])
    for of, phrase, f, gains in (
        (f"{name}^2", level, x**2, (-2.0, 2.0)),  # one deviation below and above the middle
        (f"{name}^3", amplitude, x**3, (0.0,)),
        (f"sign of {name}", f"a dead zone or friction at {name}", np.sign(x), (0.0,)),
        (f"last move of {name}", f"play or hysteresis at {name}", moves, (0.0,)),
    ):
        bent, slope = _bent(f, x, lengths)
        if np.linalg.norm(bent) > _STRAIGHT * np.linalg.norm(f):
            yield of, phrase, "nonlinear", bent, tuple(gain - slope for gain in gains)


def _bent(f: Array, x: Array, lengths: Sequence[int]) -> tuple[Array, float]:
    """What no straight line in x explains of f (N,) in each record, and the mean slope of these lines."""
    ends = np.cumsum(lengths)[:-1]
    bent, slopes = [], []
    for own, by in zip(np.split(f, ends), np.split(x, ends), strict=True):
        line = np.column_stack([np.ones_like(by), by])
        coefficients = np.linalg.lstsq(line, own, rcond=None)[0]
        bent.append(own - line @ coefficients)
        slopes.append(coefficients[1])
    return np.concatenate(bent), float(np.average(slopes, weights=lengths))


def _last_moves(x: Array) -> Array:
    """(N,): the direction in which x last moved; before it first does, the other one."""
    moves = np.sign(np.diff(x, prepend=x[:1]))
    first = np.flatnonzero(moves)[:1]
    moves[0] = -moves[first[0]] if first.size else 0.0
    return np.asarray(moves[np.maximum.accumulate(np.where(moves != 0.0, np.arange(x.size), 0))])
