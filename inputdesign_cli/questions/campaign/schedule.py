"""An experiment in parts: after each part all data are estimated jointly, and what is left is planned anew.

A part is an ordinary experiment whose prior is what the data tell by their own samples at the new estimate.
It stops where that information meets what is asked. Such a rule needs no correction for looking often: what
it looks at is the information, not the error ([anscombe-1952], [chow-robbins-1965]).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification import Estimate
from inputdesign_cli.outcome.campaign import PlanClaim, PlanKind
from inputdesign_cli.plant import Model

REACHED = 1.0 + 1e-9
"""A ratio no larger than this meets what is asked."""
# What is left of a part is one of its own where it has more than this share of its samples.
_REMAINDER = 0.1


@dataclass(frozen=True)
class Schedule:
    """How an experiment is divided.

    Attributes:
        parts: samples of the first parts; those that follow have `block`.
        samples: of the whole experiment as it is planned; `most`: where it ends at the latest.
    """

    parts: tuple[int, ...]
    block: int
    samples: int
    most: int

    def take(self, done: int) -> int:
        """Samples of the part that begins after so many; 0 at the end.

        Where a record was shorter than its plan, a remainder that is no part of its own goes with the next.
        """
        ends = zip(accumulate(self.parts), self.parts, strict=True)
        left = [end - done for end, part in ends if end - done > _REMAINDER * part]
        whole = self.samples - done
        part = left[0] if left else min(self.block, whole) if whole > _REMAINDER * self.block else self.block
        return max(min(part, self.most - done), 0)

    def rest(self, done: int) -> int:
        """Samples that the plan of that part is for: those of the whole experiment that are left."""
        return max(min(self.samples, self.most) - done, self.take(done))

    @property
    def looks(self) -> int:
        """Into how many parts it is divided at most."""
        done = parts = 0
        while done < self.most:
            done += self.take(done)
            parts += 1
        return max(parts, 1)

    def last(self, done: int) -> bool:
        """Whether the plan ends with that part."""
        return self.rest(done) <= self.take(done)


@dataclass(frozen=True)
class Rules:
    """What a campaign may do; see `campaign` of the spec."""

    schedule: Schedule
    pilot_power: float | None = None
    power_cap: float | None = None
    robust_last: bool = True
    stops: bool = True
    white: bool = False  # plans have a flat spectrum
    rate: tuple[float, ...] | None = None  # largest move of each input from one sample to the next
    seed: int = 0  # that the spec states for its signal

    def seed_of(self, number: int) -> int:
        """Of the record of the round with this number; each has its own."""
        if not self.seed:
            return number
        return int(np.random.SeedSequence([self.seed, number]).generate_state(1)[0])

    def cap(self, first: float | None) -> float:
        """Largest cost of a sample, where one of the first plan costs so much; infinite without either."""
        return np.inf if self.power_cap is None or first is None else self.power_cap * first

    @property
    def end(self) -> int:
        """Samples after which the experiment is over, whatever was reached."""
        return self.schedule.most if self.stops else min(self.schedule.samples, self.schedule.most)

    @property
    def learns_first(self) -> bool:
        """Whether the first plan is made by a record and costs are bounded, so that another must bound it."""
        return self.pilot_power is not None and self.power_cap is not None

    def over(self, done: int, *, met: bool) -> bool:
        """Whether nothing more is applied after so many samples."""
        return done >= self.end or (met and self.stops)

    def refuted(self, estimate: Estimate) -> bool:
        """Whether it ends since tests refute the structure: what it lacks it would lack for ever.

        They are asked after every part, and the parts share their level.
        """
        return self.stops and bool(estimate.failed_within(self.schedule.looks))


@dataclass(frozen=True)
class Standing:
    """What is known after some data.

    Attributes:
        model: the estimate that is built on.
        information: (k, k) of the data by their own samples at that estimate, raw parameters.
        ratio: the largest r_u / r_adm, or of another requirement, there.
        share: of the way from the last estimate to the new one: below 1 where the new one has no stable loop,
            or nothing can be asked of it.
    """

    model: Model
    information: Array
    ratio: float
    share: float = 1.0

    @property
    def met(self) -> bool:
        """Whether the data meet what is asked."""
        return self.share == 1.0 and self.ratio <= REACHED


@dataclass(frozen=True)
class Planned:
    """The experiment for what is left.

    Attributes:
        record: (rest, r) about the operating point, of which `take` samples are applied.
        power: of the record, and the `cost` of the design, per sample at the estimate.
        kind: what it was made for; a `stopgap` is white noise where there is no design.
        capped: whether it falls short of what is asked, by the cap or by limits.
        claim: gives what is proved of the design, as in a result; None of white noise.
        why: there is no design.
        share: of its power that the next part has, which else would cost more than the cap.
        lead: samples of the part, the first ones, that only lead from the end of the last one to its start.
        part_cost: of a sample of the next part, at the plant that it is planned for, with what earlier parts
            have left in it.
        beyond: whether that is more than the cap, whatever is applied.
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
    lead: int = 0
    part_cost: float = 0.0
    beyond: bool = False

    @property
    def designed(self) -> bool:
        """Whether a design is behind it, so that the first such plan sets the cap."""
        return self.kind not in ("pilot", "stopgap")

    @property
    def applied(self) -> Array:
        """(take, r): the samples of the next part."""
        return self.record[: self.take]

    def cut(self, take: int) -> Planned:
        """The same, of which so many samples are applied."""
        return replace(self, take=take)

    def following(self, last: Array, rate: Sequence[float] | None) -> Planned:
        """The same after a part that ended at `last` (r,), with moves of at most `rate` back to its start.

        A record starts within one move of zero.
        """
        if rate is None or not np.any(last):
            return self
        steps = int(np.max(np.ceil(np.abs(last) / rate)))
        back = np.arange(1, steps + 1)[:, None] * np.asarray(rate)
        ramp = np.sign(last) * np.maximum(np.abs(last) - back, 0.0)
        return replace(self, record=np.concatenate([ramp, self.record]), lead=len(ramp))

    def at_most(self, cost: float) -> Planned:
        """The same at a smaller power, where a sample would cost more."""
        if self.cost <= cost * REACHED:
            return self
        share = cost / self.cost
        record = self.record * np.sqrt(share)
        return replace(self, record=record, power=self.power * share, cost=cost, capped=True)

    def weaker(self, share: float) -> Planned:
        """The same, whose next part has this share of its power."""
        record = self.record.copy()
        record[self.lead : self.take] *= np.sqrt(share)
        return replace(self, record=record, share=share)


@dataclass(frozen=True)
class Oracle:
    """What an experiment costs whose design knows the true plant, summed over its samples.

    Attributes:
        cost: of the spectrum; `record`: of the record that is delivered, on the true plant, None without one.
    """

    cost: float
    record: float | None = None


def power_of(record: Array) -> float:
    """Return the mean square of all channels (n, r) together."""
    return float(np.sum(np.mean(record**2, axis=0)))
