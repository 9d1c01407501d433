"""What limits that are too tight for the accuracy do buy: how much, where it binds, what is used up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.design.convex.demands import Asked
from inputdesign_cli.design.convex.exchange import ExchangeResult
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.outcome.rounding import rounded_down, rounded_up
from inputdesign_cli.outcome.units import Units

# A limit takes part in the conflict when its share of the proof's weight is above this.
_TAKES_PART = 1e-4
_MOST_PLACES = 3


@dataclass(frozen=True)
class StatedBound:
    """A number of the spec that bounds an error, so that what is bought can be said in its words.

    An error `factor` times as large as asked stands for `value` times factor ** `power`. A `fraction` is
    shown in per cent.
    """

    key: str
    label: str
    value: float
    power: int = 1
    fraction: bool = False

    def loosened(self, factor: float) -> float:
        """What the spec would have to say for an error `factor` times as large."""
        return self.value * factor**self.power

    def shown(self, value: float) -> str:
        """Return a number for a sentence, rounded towards less accuracy: what is printed can be met."""
        number = 100.0 * value if self.fraction else value
        return f"{rounded_up(number, 4) if self.power > 0 else rounded_down(number, 4)}" + (
            " %" if self.fraction else ""
        )


@dataclass(frozen=True)
class Bought:
    """The best accuracy within limits: `nearest` solves `problem` (goal "factor"), which was asked.

    Args:
        stated: the numbers of the spec that are loosened alike; none if that has no words.
        limits: of the spec; others of the problem are implied by them.
    """

    units: Units
    stated: Sequence[StatedBound]
    limits: Sequence[PowerLimit]
    problem: Problem
    nearest: ExchangeResult

    @property
    def factor(self) -> float:
        """The least factor on all errors that are asked for with which they are met."""
        return float(np.sqrt(self.nearest.objective))

    @property
    def proved(self) -> float:
        """A proved lower bound on the factor."""
        return float(np.sqrt(max(self.nearest.certificate.bound, 1.0)))

    @property
    def sentence(self) -> str:
        """What the limits buy, and where that is worst."""
        if self.stated:
            parts = [
                f"{one.label} {one.shown(one.loosened(self.factor))} (asked: {one.shown(one.value)})"
                for one in self.stated
            ]
            buys = " and ".join(parts)
        else:
            buys = f"standard deviations {rounded_up(self.factor, 4)} times as large as it takes"
        places = [text for text in map(self._place, self._binding) if text]
        shown = list(dict.fromkeys(places))
        more = ", .." if len(shown) > _MOST_PLACES else ""
        worst = f", worst {' and '.join(shown[:_MOST_PLACES])}{more}" if shown else ""
        return f"the limits buy {buys}{worst}"

    @property
    def involved(self) -> list[PowerLimit]:
        """The limits that take part in the proof."""
        return [limit for limit, _ in self._shares]

    @property
    def details(self) -> dict[str, object]:
        """Return this as data, with frequencies in the user's unit."""
        return {
            "factor": self.factor,
            "factor_bound": self.proved,
            "bought": [
                {"key": bound.key, "asked": bound.value, "bought": bound.loosened(self.factor)}
                for bound in self.stated
            ],
            "worst": [self._listed(asked, w) for asked, w in self._binding],
            "limits": [_entry(limit, share) for limit, share in self._shares],
        }

    @property
    def _shares(self) -> list[tuple[PowerLimit, float]]:
        """Each limit of the spec with its share of the weight of the proof."""
        listed = self.problem.limits
        weights = self.nearest.certificate.limits * np.array([limit.bound for limit in listed])
        least = _TAKES_PART * max(weights.max(initial=0.0), 1e-300)
        stated = listed[: len(self.limits)]
        known = [(limit, float(weights[limit.everywhere(listed)].sum())) for limit in stated]
        return [(limit, share) for limit, share in known if share > least]

    @property
    def _binding(self) -> list[tuple[Asked, float | None]]:
        """Where the requirements bind, the place of the largest multiplier first."""
        return [(self.problem.demands.asked[index], w) for index, w in self.nearest.active]

    def _place(self, place: tuple[Asked, float | None]) -> str:
        requirement, w = place[0].requirement, place[1]
        parts = []
        if requirement.entry is not None and not self.units.single:
            parts.append(f"in entry {self.units.entry(*requirement.entry)}")
        if w is not None:
            parts.append(f"at {self.units.named(w)}")
        return " ".join(parts)

    def _listed(self, asked: Asked, w: float | None) -> dict[str, object]:
        requirement = asked.requirement
        item: dict[str, object] = {"name": requirement.name}
        if requirement.entry is not None and not self.units.single:
            item["entry"] = self.units.entry(*requirement.entry)
        if w is not None:
            item["frequency"] = w / self.units.frequency
        at = np.array([0.0 if w is None else w])
        item["worst_ratio"] = float(requirement.ratios(self.nearest.informations[asked.scenario], at)[0])
        return item


def named(limit: PowerLimit) -> str:
    """Return the power that a limit bounds, for a sentence: the input power; the power of input 2."""
    number = "" if limit.channel is None else f" {limit.channel + 1}"
    if limit.kind == "moves":
        power = f"the power of the moves of input{number}" if number else "the power of the input's moves"
    else:
        power = f"the power of {limit.kind}{number}" if number else f"the {limit.kind} power"
    if not limit.implied:
        return power
    bound = "rate limit" if limit.kind == "moves" else "amplitude limit"
    return f"{power}, which the {bound} {np.sqrt(limit.bound):.6g} bounds,"


def _entry(limit: PowerLimit, share: float) -> dict[str, object]:
    entry: dict[str, object] = {"name": limit.key.removeprefix("limits.")}
    if limit.channel is not None:
        entry["channel"] = limit.channel + 1
    return entry | {"max" if limit.upper else "min": limit.bound, "share": share}
