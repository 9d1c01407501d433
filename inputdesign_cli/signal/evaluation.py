"""What a record is judged by: its own information, and what its powers cost."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.information import FiniteRecord, PowerKind
from inputdesign_cli.signal.level_search import least_level

# A record meets the accuracy when its ratio exceeds one by no more than rounding.
MET = 1.0 + 1e-9


@dataclass(frozen=True)
class Target:
    """What is asked of a record.

    Args:
        worst_ratio: maps an information matrix to the largest r_u / r_adm (or another figure, to be small).
        meets: whether the level of the record is the lowest at which that is at most one; otherwise the
            record has the power of the design.
        cost: weights of the powers (of all channels together, or one weight a channel), to rank records
            that meet the target.
        designed: what the design costs in the same weights; its power when not given.
        least_ratio: what `worst_ratio` is at least, in a shorter time; to leave out records early.
    """

    worst_ratio: Callable[[Array], float]
    meets: bool = False
    cost: Mapping[PowerKind, float | tuple[float, ...]] = field(default_factory=lambda: {"excitation": 1.0})
    designed: float | None = None
    least_ratio: Callable[[Array], float] | None = None


@dataclass(frozen=True)
class Evaluator:
    """The plant on which records are tried, with the `limits` on their powers (see `Bounds.powers`)."""

    plant: FiniteRecord
    target: Target
    limits: tuple[tuple[PowerKind, int | None, float], ...] = ()
    _latest: list[tuple[Array, float]] = field(default_factory=list, compare=False, repr=False)

    def ratio(self, samples: Array) -> float:
        """The worst ratio; infinite when the record does not excite every parameter."""
        # The same record is asked for twice: when its level is found, and when it is ranked.
        if not self._latest or self._latest[0][0] is not samples:
            self._latest[:] = [(samples, self._ratio(samples))]
        return self._latest[0][1]

    def _ratio(self, samples: Array) -> float:
        try:
            return self.target.worst_ratio(self.plant.information(samples))
        except np.linalg.LinAlgError:
            return np.inf

    def figure(self, samples: Array) -> float:
        """At most one for a record that does what is asked; infinite beyond the limits on the powers."""
        return self.ratio(samples) / MET if self.share(samples) >= 1.0 / MET else np.inf

    def share(self, samples: Array) -> float:
        """The largest factor on its powers that the limits leave to the record, at every plant."""
        powers = {kind: self.plant.mean_squares_of_each(kind, samples) for kind, _, _ in self.limits}
        spent = [
            (most, float(max(powers[kind].sum(axis=1) if channel is None else powers[kind][:, channel])))
            for kind, channel, most in self.limits
        ]
        return min((most / power for most, power in spent if power > 0.0), default=np.inf)

    def cost(self, samples: Array) -> float:
        """The weighted sum of the powers."""
        return float(
            sum(
                np.sum(np.asarray(weight) * self.plant.mean_squares(kind, samples))
                for kind, weight in self.target.cost.items()
            )
        )

    def costs_more(self, samples: Array, cost: float) -> bool:
        """Whether multiples of the samples miss what is asked as long as they cost no more than that."""
        least = self.target.least_ratio
        own = self.cost(samples)
        if least is None or cost <= 0.0 or own <= 0.0:
            return False
        known = self.plant.known
        square = cost / own
        try:
            return least(known + square * (self.plant.information(samples) - known)) > MET
        except np.linalg.LinAlgError:
            return False

    def needed_level(self, samples: Array) -> float | None:
        """The level that the accuracy needs, were there no limits; None when no level is enough."""
        known = self.plant.known
        gained = self.plant.information(samples) - known
        try:
            if not known.any():  # ratios are of standard deviations: they fall as the level grows
                return self.target.worst_ratio(gained) or None
            return least_level(lambda level: self.target.worst_ratio(known + level**2 * gained), 1.0)
        except np.linalg.LinAlgError:  # too short to excite every parameter
            return None
