"""Divide an experiment into parts: after each part the model is estimated again and the rest is planned anew.

A part is an ordinary experiment. Its prior is the information of the data by their own samples at the new
estimate. The experiment stops as soon as that information suffices. This rule needs no correction for
repeated looks: it looks at the information, not at the error ([anscombe-1952], [chow-robbins-1965]).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification import Estimate
from inputdesign_cli.outcome.campaign import PlanClaim, PlanKind, State
from inputdesign_cli.outcome.estimate import Verdict
from inputdesign_cli.plant import Model

REACHED = 1.0 + 1e-9
"""A ratio no larger than this meets what is asked."""
# The rest of a part is a part of its own if it has more than this share of its samples.
_REMAINDER = 0.1
_ENDED: dict[Verdict, State] = {"met": "stopped", "missed": "missed", "undecided": "undecided"}


@dataclass(frozen=True)
class Schedule:
    """Holds the lengths of the parts.

    Attributes:
        parts: samples of the first parts; later parts have `block`.
        samples: number of samples of the whole experiment as planned; `most`: the largest number.
        hold: samples for which each value stands; a part has whole values.
    """

    parts: tuple[int, ...]
    block: int
    samples: int
    most: int
    hold: int = 1

    def take(self, done: int) -> int:
        """Return the samples of the part that begins after `done` samples; 0 at the end.

        If a record was shorter than its plan, a short remainder goes with the next part.
        """
        ends = zip(accumulate(self.parts), self.parts, strict=True)
        left = [end - done for end, part in ends if end - done > _REMAINDER * part]
        whole = self.samples - done
        part = left[0] if left else min(self.block, whole) if whole > _REMAINDER * self.block else self.block
        return max(min(-(-part // self.hold) * self.hold, self.most - done), 0)

    def rest(self, done: int) -> int:
        """Return the samples that the plan of that part is for: the rest of the whole experiment."""
        return max(min(self.samples, self.most) - done, self.take(done))

    @property
    def looks(self) -> int:
        """Return the largest number of parts."""
        done = parts = 0
        while done < self.most:
            done += self.take(done)
            parts += 1
        return max(parts, 1)

    def last(self, done: int) -> bool:
        """Return whether the plan ends with that part."""
        return self.rest(done) <= self.take(done)


@dataclass(frozen=True)
class Rules:
    """Holds the rules of a campaign; see `campaign` of the spec."""

    schedule: Schedule
    pilot_power: float | None = None
    power_cap: float | None = None
    robust_last: bool = True
    stops: bool = True
    white: bool = False  # plans have a flat spectrum
    rate: tuple[float, ...] | None = None  # largest move of each input from one sample to the next
    least: tuple[float, ...] | None = None  # smallest useful move of each input
    seed: int = 0  # seed of the signal, as the spec states it

    def seed_of(self, number: int) -> int:
        """Return the seed of the part with this number: each has its own, the same if it is planned again."""
        own = np.random.SeedSequence([self.seed, number])
        return int(own.generate_state(1)[0]) if self.seed else number

    def cap(self, first: float | None) -> float:
        """Return the largest cost of a sample; infinite without a cap. `first` is that of the first plan."""
        return np.inf if self.power_cap is None or first is None else self.power_cap * first

    @property
    def end(self) -> int:
        """Return the number of samples after which the experiment is over, whatever was reached."""
        return self.schedule.most if self.stops else min(self.schedule.samples, self.schedule.most)

    def state(self, done: int, verdict: Verdict, *, refuted: bool = False) -> State:
        """Return how a campaign stands after `done` samples; while nothing is decided, it goes on.

        Args:
            verdict: the verdict on all data, `met` if they suffice at the estimate itself.
            refuted: whether the data contradict the structure, or each other, which more data do not mend.
        """
        if refuted:
            return "undecided"
        over = done >= self.end or (self.stops and verdict == "met")
        return _ENDED[verdict] if over else "running"

    def refuted(self, estimate: Estimate) -> bool:
        """Return whether tests refute the structure; they are repeated, and all parts share their level."""
        return self.stops and bool(estimate.tests.failed_within(self.schedule.looks))


@dataclass(frozen=True)
class Standing:
    """Holds the model that plans are built on, and its accuracy.

    Attributes:
        model: the estimate, or a model on the way to it.
        information: (k, k), from the samples of the data at the model, in raw parameters.
        ratio: the largest r_u / r_adm, or of another requirement, at the model.
        share: share of the way from the last estimate to the new one. It is below 1 if the new one has no
            stable loop, or the accuracy cannot be evaluated at it.
        open: whether other minima of the likelihood, or tests, leave the model undecided.
        others: parameters (k,) of these minima.
    """

    model: Model
    information: Array
    ratio: float
    share: float = 1.0
    open: bool = False
    others: tuple[Array, ...] = ()

    @property
    def met(self) -> bool:
        """Return whether the data suffice."""
        return self.share == 1.0 and self.ratio <= REACHED


@dataclass(frozen=True)
class Planned:
    """Holds a plan for the rest of the experiment.

    Attributes:
        record: (rest, r) about the operating point, of which `take` samples are applied.
        power: power of the record; `cost`: cost of a sample of the design at the estimate.
        kind: the purpose; a `stopgap` is white noise if there is no design.
        capped: whether the cap or limits make it miss the accuracy that is asked.
        claim: returns the proof of the design, None without one; the first plan with a proof sets the cap.
        why: the reason why there is no design.
        share: power of the next part over the power of the plan, below 1 if it was weakened to keep the cap.
        part_cost: cost of a sample of the next part at the plant that it is planned for, with the effects of
            earlier parts.
        beyond: whether `part_cost` exceeds the cap, whatever is applied.
        alone: whether the part is planned without the data, which leave the model undecided.
        fragile: whether a plan that ends with its part suffices at the estimate alone, although it was to
            suffice at all plants that the data do not rule out.
    """

    record: Array
    take: int
    power: float
    cost: float
    kind: PlanKind
    capped: bool = False
    claim: Callable[[], PlanClaim] | None = field(default=None, compare=False, repr=False)
    why: str = ""
    share: float = 1.0
    part_cost: float = 0.0
    beyond: bool = False
    alone: bool = False
    fragile: bool = False

    @property
    def applied(self) -> Array:
        """Return the samples of the next part, (take, r)."""
        return self.record[: self.take]
