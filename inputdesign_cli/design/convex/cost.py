"""The cost of an experiment: weights of the powers of input, output and excitation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from inputdesign_cli.information import PowerKind

Weight = float | tuple[float, ...]
# The plants whose powers are paid for: the nominal one, all of them evenly, or the dearest.
Paid = Literal["nominal", "mean", "worst"]


def paid_for(paid: Paid, costs: Sequence[float]) -> float:
    """Return the cost of a design from its costs at each of the plants considered."""
    return max(costs) if paid == "worst" else sum(costs) / len(costs)


def weights_of(cost: Mapping[PowerKind, Weight]) -> list[tuple[PowerKind, int | None, float]]:
    """Return the positive weights of a cost: kind, channel (None is the sum over the channels), weight."""
    listed: list[tuple[PowerKind, int | None, float]] = []
    for kind, weight in cost.items():
        if isinstance(weight, tuple):
            listed += [(kind, channel, w) for channel, w in enumerate(weight) if w > 0]
        elif weight > 0:
            listed.append((kind, None, weight))
    return listed


def weighted_sum(weights: Mapping[PowerKind, Weight], power: Mapping[PowerKind, Sequence[float]]) -> float:
    """Return the cost of powers, by kind and channel, at these weights."""
    return sum(
        weight * (sum(power[kind]) if channel is None else power[kind][channel])
        for kind, channel, weight in weights_of(weights)
    )
