"""Limits on single samples and on powers for several inputs, and what enforces them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.information import PowerKind
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.channel_information import RecordFilter
from inputdesign_cli.signal.dress import Dresser
from inputdesign_cli.signal.recipe import Quantiser, Recipe
from inputdesign_cli.signal.room import Room
from inputdesign_cli.signal.within import Watched


@dataclass(frozen=True)
class ChannelBounds:
    """What a record (n, r) may not exceed, by channel: `amplitude` and `rate` (r,), `output` (p,).

    `powers` are the largest mean squares: kind, channel (None is the sum over the channels), bound.
    """

    amplitude: Array | None = None
    rate: Array | None = None
    output: Array | None = None
    powers: tuple[tuple[PowerKind, int | None, float], ...] = ()

    @property
    def hard(self) -> bool:
        """Whether single samples are limited."""
        return any(bound is not None for bound in (self.amplitude, self.rate, self.output))


def channel_dresser(
    plant: RecordFilter, recipe: Recipe, bounds: ChannelBounds, quantisers: Sequence[Quantiser | None]
) -> Dresser:
    """What enforces the bounds on records of the length of the `plant`'s, with a converter an input."""
    rooms = tuple(
        Room(
            None if bounds.amplitude is None else float(bounds.amplitude[a]),
            None if bounds.rate is None else float(bounds.rate[a]),
            quantiser,
        )
        for a, quantiser in enumerate(quantisers)
    )
    return Dresser(recipe, rooms, _watched(plant, recipe.hold, bounds))


def _watched(plant: RecordFilter, hold: int, bounds: ChannelBounds) -> tuple[Watched, ...]:
    """Every output that is limited, and then also what the search for them might spoil."""
    if bounds.output is None:
        return ()
    found = [_output(plant, channel, hold, float(bound)) for channel, bound in enumerate(bounds.output)]
    for a in range(plant.experiment.inputs):
        if bounds.amplitude is not None:
            found.append(_value(a, plant.experiment.inputs, float(bounds.amplitude[a])))
        if bounds.rate is not None:
            found.append(_move(a, plant.experiment.inputs, float(bounds.rate[a])))
    return tuple(found)


def _output(plant: RecordFilter, channel: int, hold: int, bound: float) -> Watched:
    def adjoint(weights: Array) -> Array:
        each = plant.output_adjoint(weights, channel)
        return each.reshape(-1, hold, each.shape[1]).sum(axis=1)

    return Watched(lambda values: plant.output(np.repeat(values, hold, axis=0), channel), adjoint, bound)


def _value(channel: int, inputs: int, bound: float) -> Watched:
    unit = np.eye(inputs)[channel]
    return Watched(lambda values: values[:, channel], lambda weights: np.outer(weights, unit), bound)


def _move(channel: int, inputs: int, bound: float) -> Watched:
    """From one value to the next, the first from rest; the hold between them does not move."""
    unit = np.eye(inputs)[channel]

    def adjoint(weights: Array) -> Array:
        return np.outer(weights - np.append(weights[1:], 0.0), unit)

    return Watched(lambda values: np.diff(values[:, channel], prepend=0.0), adjoint, bound)
