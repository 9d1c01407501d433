"""Evaluate the cost of a part at a plant that still moves from earlier parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cost import Weight, weighted_sum
from inputdesign_cli.information import Experiment, FiniteRecord, PowerKind
from inputdesign_cli.questions.campaign.schedule import REACHED, Planned


def within_caps(
    plan: Planned,
    caps: Sequence[tuple[Experiment, float]],
    weights: Mapping[PowerKind, Weight],
    step: float,
    before: Array,
) -> Planned:
    """Return the plan with a first part whose samples cost at most the cap at each of several plants.

    Args:
        caps: plants with their caps; the plan is made for the first plant.
        weights: of the powers; `step`: time between samples in the unit of the experiment's frequencies.
        before: (m, r), applied earlier.
    """
    costs = [PartCost.of(at, weights, step, before, plan.applied, plan.lead) for at, _ in caps]
    scale = min(cost.within(cap) for cost, (_, cap) in zip(costs, caps, strict=True))
    beyond = any(cost.at(scale) > cap * REACHED for cost, (_, cap) in zip(costs, caps, strict=True))
    kept = plan if scale == 1.0 else plan.weaker(scale**2)
    return replace(kept, part_cost=costs[0].at(scale), beyond=beyond)


@dataclass(frozen=True)
class PartCost:
    """The cost left + 2 scale mixed + scale^2 own of samples that are applied at a scale.

    Attributes:
        own: cost of the effects of the samples from rest; `left`: of the effects of earlier samples; `mixed`:
            of their products.
    """

    own: float
    mixed: float
    left: float

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        weights: Mapping[PowerKind, Weight],
        step: float,
        before: Array,
        part: Array,
        fixed: int,
    ) -> PartCost:
        """Return the cost of a part (n, r) after `before` (m, r) from rest; `fixed` samples keep scale 1.

        Noise does not count, as in the cost of a design.
        """
        whole = np.concatenate([before, part])
        scaled = np.arange(len(whole))[:, None] >= len(before) + fixed
        at = FiniteRecord(replace(experiment, samples=len(whole)), len(whole), step)
        own, left = (
            {kind: at.signals(kind, samples)[len(before) :] for kind in weights}
            for samples in (whole * scaled, whole * ~scaled)
        )

        def paid(x: Mapping[PowerKind, Array], y: Mapping[PowerKind, Array]) -> float:
            return weighted_sum(
                weights, {kind: np.mean(x[kind] * y[kind], axis=0).tolist() for kind in weights}
            )

        return cls(paid(own, own), paid(own, left), paid(left, left))

    def at(self, scale: float) -> float:
        """Return the cost of a sample at this scale."""
        return self.left + 2.0 * scale * self.mixed + scale**2 * self.own

    def within(self, cap: float) -> float:
        """Return the largest scale up to one at which a sample costs at most `cap`.

        If effects of earlier parts alone cost more, the own effects of the part keep the cap.
        """
        if self.at(1.0) <= cap:
            return 1.0
        if self.left >= cap:
            return float(min(np.sqrt(cap / self.own), 1.0)) if self.own > 0.0 else 1.0
        return float((np.sqrt(self.mixed**2 + self.own * (cap - self.left)) - self.mixed) / self.own)
