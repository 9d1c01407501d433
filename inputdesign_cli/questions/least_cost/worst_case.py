"""The plant that a design serves worst, in all of a region and not only among the plants that were drawn.

It is looked for by ascent from several starts, as [frank-wolfe-1956] does: from a point towards the farthest
one of the region in the direction of the gradient. What is found is a plant that is served so badly; that
there is no worse one is not proved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.design.convex.question import Alternative, Question
from inputdesign_cli.questions.common.robust import (
    Batch,
    Kept,
    Plants,
    Region,
    Searched,
    delivered_samples,
    kept_by,
    tried_on,
)
from inputdesign_cli.questions.least_cost.outcome import Answer

# Steps towards the farthest point, of a difference, and of an ascent at most.
_LENGTHS, _DIFFERENCE, _STEPS = (1.0, 0.5, 0.25, 0.1, 0.03), 0.01, 15
_GAIN = 1e-5
_STARTS = 3  # beside the plant of the spec
# Plants are added until the worst one is missed by no more than this, and no more than this number.
_NEARLY, _MOST_ADDED = 1.0 + 1e-6, 8


Keeps = Callable[[Array, Alternative], Kept]


@dataclass(frozen=True)
class Found:
    """The worst plant that was found, at `theta` (k,), what it keeps, and how many were tried."""

    theta: Array
    plant: Alternative
    kept: Kept
    tried: int


@dataclass
class _Ascent:
    """One search; the worst plant so far stands first in `best`."""

    region: Region
    keeps: Keeps
    tried: int = 0
    best: list[tuple[Array, Alternative, Kept]] = field(default_factory=list)

    def share(self, z: Array) -> float:
        """How near the plant at z comes to being missed, 0 where there is none."""
        seconds_left()
        theta = self.region.theta(z)
        plant = self.region.at(theta)
        if plant is None:
            return 0.0
        self.tried += 1
        kept = self.keeps(theta, plant)
        if not self.best or kept.share > self.best[0][2].share:
            self.best[:] = [(theta, plant, kept)]
        return kept.share

    def from_start(self, z: Array) -> None:
        """Steps as long as they lead to a worse plant."""
        found = self.share(z)
        for _ in range(_STEPS):
            ahead = np.array([self._beside(z, axis, found) for axis in range(z.size)])
            if not (np.isfinite(found) and np.any(ahead)):
                return
            target, before = self.region.farthest(ahead), found
            for length in _LENGTHS:
                step = z + length * (target - z)
                share = self.share(step)
                if share > (1.0 + _GAIN) * before:
                    z, found = step, share
                    break
            if found == before:
                return

    def _beside(self, z: Array, axis: int, here: float) -> float:
        """The derivative along an axis, by a difference within the region; 0 where there is no plant."""
        step = np.zeros(z.size)
        step[axis] = -_DIFFERENCE if z[axis] > 0.0 else _DIFFERENCE
        share = self.share(z + step)
        return (share - here) / step[axis] if share > 0.0 and np.isfinite(share) else 0.0


def worst_plant(region: Region, keeps: Keeps, starts: Sequence[Array]) -> Found:
    """Return the worst plant of the region that ascents find.

    Args:
        starts: parameters (k,) of plants to begin with, the worst known first.
    """
    search = _Ascent(region, keeps)
    for theta in starts[: 1 + _STARTS]:
        search.from_start(region.nearest(theta))
    theta, plant, kept = search.best[0]
    return Found(theta, plant, kept, search.tried)


def _kept_at(design: Design, samples: int, theta: Array, plant: Alternative) -> Kept:
    (tried,) = tried_on(design, samples, Batch(theta[None], (plant,), 1))
    return tried.kept


def with_worst_plants(
    plants: Plants, region: Region, question: Question, first: Answer, solve: Callable[[Question], Answer]
) -> tuple[Plants, Question, Answer]:
    """Return the design for the worst plants of the region as well, added until none is found to be missed.

    Args:
        region: where worse ones are searched.
    """
    answer, added = first, 0
    while True:
        design = answer.design
        samples = delivered_samples(design)
        kept = kept_by(design.problem.on(design.result.basis), design, samples)
        nominal = question.experiment.model.theta
        shares = np.array([one.share for one in kept[1:]])
        thetas = [nominal, *plants.batch.thetas[np.argsort(-shares, kind="stable")]]
        found = worst_plant(region, partial(_kept_at, design, samples), thetas)
        if found.kept.share <= _NEARLY or added == _MOST_ADDED:
            searched = Searched(region.name, found.theta, found.kept, found.tried, added)
            return replace(plants, searched=searched), question, answer
        batch, added = plants.batch, added + 1
        thetas_now = np.concatenate([batch.thetas, found.theta[None]])
        plants = replace(plants, batch=Batch(thetas_now, (*batch.plants, found.plant), batch.drawn + 1))
        question = replace(question, others=[*question.others, found.plant])
        answer = solve(question)
