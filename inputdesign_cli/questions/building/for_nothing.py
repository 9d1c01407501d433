"""Where power that tells of the parameters is neither paid for nor limited, as beside a pole in a loop.

A loop takes all power of the input away where the plant has a pole on the unit circle, and leaves that of
the output, which tells of the pole. Where the plant has a zero there, nothing of the output is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cost import weights_of
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant import graded_grid, local_maxima
from inputdesign_cli.spectrum import matrices

Counted = tuple[PowerKind, int | None, float]

# A price so many tens below that of the band may be a zero between the points of a grid.
_ZERO = 6.0
# How near to it what is told is looked at, in parts of the distance to the next pole, from afar. Nearer still
# loops that integrate are taken to be as they are there.
_BESIDE = np.geomspace(1e-2, 1e-4, 9)
# What is told for a unit grows at least with the square of the nearness, from one of these to the next.
_GROWS = 2.5
_EARLIER = 4
# Of the band: lines nearer to a place are on it, and poles.
_ON = 1e-6


@dataclass(frozen=True)
class ForNothing:
    """What the places where power is free of charge do to a question.

    `frequencies` are in the unit of the experiment. `endless` says that power ever nearer to them meets all
    that is asked at no price, or that the criterion has no bound; else the best is only approached there.
    `reached` says that spectra of the family may do so.
    """

    frequencies: tuple[float, ...]
    endless: bool
    reached: bool


def told_for_nothing(question: Question) -> ForNothing | None:
    """The places of the band at which a unit of what is paid for, or limited, tells without end.

    None where there are none, and where other plants are to be served as well: their poles lie elsewhere.
    """
    counted = counted_powers(question)
    if counted is None or question.others:
        return None
    experiment = question.experiment.whitened(1.0)
    found = [(w, told) for w in _places(experiment, counted) if (told := _told(experiment, counted, w))]
    if not found:
        return None
    places = tuple(w for w, _ in found)
    before, after = (sum(told[n] for _, told in found) for n in (0, 1))
    requirements = [make(experiment) for make in question.requirements]

    def level(told: Array) -> float:
        return 2.0 * float(np.log(max(one.worst(told).ratio for one in requirements)))

    gained = level(np.eye(experiment.size) + before) - level(np.eye(experiment.size) + after)
    # The determinant of all k gains the k-th part of what one direction does.
    grown = float(np.log(np.trace(after) / np.trace(before)))
    basis = question.basis
    reached = basis.free
    if not reached and not basis.has_density:
        lines = basis.lines(basis.even)[0]
        reached = bool(np.any(np.abs(lines[:, None] - np.array(places)) <= _ON * experiment.band[1]))
    return ForNothing(places, gained > 0.5 * grown / experiment.size, reached)


def counted_powers(question: Question) -> list[Counted] | None:
    """All that is paid for, or of all powers with an upper limit, each with its weight.

    None where the density of the excitation is limited itself.
    """
    if question.goal == "cost":
        return weights_of(question.cost)
    if any(density.upper for density in question.densities):
        return None
    return [(limit.kind, limit.channel, 1.0 / limit.bound) for limit in question.limits if limit.upper]


def price_density(experiment: Experiment, counted: list[Counted], w: Array) -> NDArray:
    """(n, r, r): what a unit of excitation costs at frequencies (n,)."""
    parts = [
        weight * matrices(experiment.power_density(kind, w, channel)) for kind, channel, weight in counted
    ]
    return np.asarray(np.sum(parts, axis=0))


def _places(experiment: Experiment, counted: list[Counted]) -> list[float]:
    """Frequencies at which some direction of the excitation costs nothing."""
    near = np.concatenate([experiment.singularities, experiment.model.singularities])
    grid = graded_grid(near, *experiment.band)
    typical = float(np.median(np.linalg.eigvalsh(price_density(experiment, counted, grid))[:, -1]))

    def cheapness(w: Array) -> Array:
        least = np.linalg.eigvalsh(price_density(experiment, counted, w))[:, 0]
        return np.asarray(-np.log10(np.maximum(least / typical, np.finfo(float).tiny)))

    return local_maxima(cheapness, grid, cheapness(grid), above=_ZERO)[0].tolist()


def _told(experiment: Experiment, counted: list[Counted], place: float) -> tuple[Array, Array] | None:
    """What a unit of the price tells (k, k) near a place, and far nearer; None where that does not grow."""
    hi = experiment.band[1]
    distance = np.abs(experiment.singularities - place)
    scale = float(np.min(distance[distance > _ON * hi], initial=0.1 * hi))
    w = place + scale * _BESIDE * (1.0 if place + scale * _BESIDE[0] <= hi else -1.0)
    values, vectors = np.linalg.eigh(price_density(experiment, counted, w))
    roots = vectors / np.sqrt(np.maximum(values, np.finfo(float).tiny))[:, None, :]
    rows = np.einsum("nkpr,nrs->nkps", experiment.excitation_gradient(w), roots)
    flat = rows.reshape(*rows.shape[:2], -1)
    told = np.asarray((flat @ flat.conj().swapaxes(1, 2)).real)
    sizes = np.trace(told, axis1=1, axis2=2)
    if not sizes[-1] > _GROWS * sizes[-2]:
        return None
    return told[-1 - _EARLIER], told[-1]
