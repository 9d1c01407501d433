"""The demands on a design: its question, the requirements of all scenarios, and which of them are missed."""

from __future__ import annotations

import heapq
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Criterion, Requirement, Violation, criterion_of, inverse_factor, worst
from inputdesign_cli.accuracy.calibration import with_alpha
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.limits import DensityLimit, Goal, Paid, PowerLimit, Weight
from inputdesign_cli.information import Experiment, PowerKind, joint_noise
from inputdesign_cli.spectrum import Basis

RequirementFactory = Callable[[Experiment], Requirement]
# This number of scenarios is enough for a next step: cuts for the worst few serve most of the others.
FEW = 4
# Maxima above this share of the required level are noted, so that a small step needs no other search.
_NEARLY = 0.99


@dataclass(frozen=True)
class Scenario:
    """Holds a plant for which the design must hold, in its own coordinates, with its requirements."""

    experiment: Experiment
    requirements: tuple[Requirement, ...]
    side: tuple[Requirement, ...] = ()


@dataclass(frozen=True)
class Asked:
    """Holds a requirement with the number of its scenario; `side` as in `Problem`."""

    scenario: int
    requirement: Requirement
    side: bool


@dataclass
class _Seen:
    """Holds the largest ratio (S,) found so far for each scenario, and its information (S, k, k).

    Ratios fall as information grows: if M_s is at least c times the earlier one, the ratio is at most
    1 / sqrt(c) times the earlier one. So most scenarios need no new evaluation. `looked` are bounds from a
    grid, `searched` tighter ones from a search of the maxima.
    """

    looked: Array
    searched: Array
    informations: NDArray[np.float64] | None = None

    @classmethod
    def none(cls, number: int) -> _Seen:
        """Return the state in which nothing is known yet."""
        return cls(np.full(number, np.inf), np.full(number, np.inf))

    def most(self, informations: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return bounds (2, S) on the ratios with these M_s (S, k, k), from `looked` and `searched`."""
        ratios = np.stack([self.looked, self.searched])
        if self.informations is None:
            self.informations = np.broadcast_to(np.eye(informations.shape[1]), informations.shape).copy()
            return ratios
        try:
            roots = inverse_factor(self.informations)
        except np.linalg.LinAlgError:  # nothing follows from a matrix that is singular
            return np.full_like(ratios, np.inf)
        share = np.linalg.eigvalsh(roots @ informations @ roots.swapaxes(1, 2))[:, 0]
        with np.errstate(divide="ignore"):
            return np.where(share > 0.0, ratios / np.sqrt(np.maximum(share, 0.0)), np.inf)

    def look(self, number: int, information: Array, ratio: float) -> None:
        """Store the largest ratio of a scenario, once `most` has been called."""
        assert self.informations is not None
        self.informations[number] = information
        self.looked[number] = self.searched[number] = ratio

    def search(self, number: int, ratio: float) -> None:
        """Store the largest ratio of the same scenario after a search for its maxima."""
        self.searched[number] = min(self.searched[number], ratio)


@dataclass(frozen=True)
class Demands:
    """Holds the requirements of all scenarios together, and the ratios seen so far."""

    scenarios: tuple[Scenario, ...]

    @cached_property
    def asked(self) -> tuple[Asked, ...]:
        """Return all requirements, scenario by scenario, side requirements after the others."""
        return tuple(
            Asked(number, requirement, side)
            for number, scenario in enumerate(self.scenarios)
            for side, listed in ((False, scenario.requirements), (True, scenario.side))
            for requirement in listed
        )

    @cached_property
    def noise_informations(self) -> NDArray[np.float64]:
        """Return the information (S, k, k) of the noise alone for each scenario."""
        return joint_noise([scenario.experiment for scenario in self.scenarios])

    def are_of(self, asked: Scenario, others: Sequence[Scenario]) -> bool:
        """Return whether the nominal plant, its requirements and the other plants are the given ones."""
        nominal, *known = self.scenarios
        same = len(known) == len(others) and all(map(operator.is_, known, others))
        alike = nominal.requirements is asked.requirements and nominal.side is asked.side
        return same and alike and nominal.experiment is asked.experiment

    @property
    def criterion(self) -> Criterion | None:
        """Return the criterion of the nominal plant that is to be maximised, if that is the goal."""
        return criterion_of(self.scenarios[0].requirements)

    @cached_property
    def definite(self) -> bool:
        """Return whether the requirements exclude a singular information matrix."""
        return any(asked.requirement.definite for asked in self.asked)

    def violations(
        self,
        informations: NDArray[np.float64],
        *,
        above: float = -np.inf,
        side: bool = False,
        few: int | None = None,
    ) -> list[tuple[int, Violation]]:
        """Return the local maxima of all ratios, each with the index of its requirement in `asked`.

        Args:
            side: look at the side requirements, not at the others.
            few: stop after this number of scenarios with violations; the largest bounds come first.
        """
        if len(self.scenarios) == 1:
            return self._violated(0, informations[0], above, side)
        found, bad = list[tuple[int, Violation]](), 0
        for number in self._by_most(informations, side, above):
            nearly = self._violated(number, informations[number], _NEARLY * above, side)
            self._seen[int(side)].search(number, max([_NEARLY * above, *(v.ratio for _, v in nearly)]))
            own = [(index, v) for index, v in nearly if v.ratio > above]
            found += own
            bad += bool(own)
            if few is not None and bad >= few:
                break
        return found

    def largest(self, informations: NDArray[np.float64], *, default: float) -> float:
        """Return the largest ratio of the requirements without side ones; the default without any."""
        found: list[float] = []
        for number in self._by_most(informations, False, -np.inf) if len(self.scenarios) > 1 else [0]:
            if found and self._seen[0].looked[number] <= max(found):
                break  # the next ones are no larger
            found += [v.ratio for _, v in self._violated(number, informations[number], -np.inf, False)]
        return max(found, default=default)

    def _by_most(self, informations: NDArray[np.float64], side: bool, above: float) -> Iterator[int]:
        """Yield the scenarios that may have ratios above `above`, the largest first.

        A scenario is evaluated when no other may have a larger ratio, so that most of them never are.
        """
        seen = self._seen[int(side)]
        looked, searched = seen.most(informations)
        waiting = [(-float(looked[n]), n, False) for n in np.flatnonzero(searched > above).tolist()]
        heapq.heapify(waiting)
        while waiting:
            most, number, looked_at = heapq.heappop(waiting)
            if not -most > above:
                return
            if looked_at:
                yield number
                continue
            asked = [self.asked[index] for index in self._asked_of[number]]
            own = [a.requirement.most(informations[number]) for a in asked if a.side == side]
            seen.look(number, informations[number], max(own, default=0.0))
            heapq.heappush(waiting, (-float(seen.looked[number]), number, True))

    def _violated(
        self, number: int, information: Array, above: float, side: bool
    ) -> list[tuple[int, Violation]]:
        """Return the violations of one scenario, each with the index of its requirement."""
        found: list[tuple[int, Violation]] = []
        for index in self._asked_of[number]:
            if self.asked[index].side == side:
                found += zip(
                    repeat(index), self.asked[index].requirement.violations(information, above=above)
                )
        return found

    @cached_property
    def _seen(self) -> tuple[_Seen, _Seen]:
        """Return what is known of the ratios of requirements, and of side requirements."""
        return _Seen.none(len(self.scenarios)), _Seen.none(len(self.scenarios))

    @cached_property
    def _asked_of(self) -> list[list[int]]:
        """Return the numbers of its requirements for each scenario."""
        return [
            [index for index, asked in enumerate(self.asked) if asked.scenario == number]
            for number in range(len(self.scenarios))
        ]

    def worst_ratio(self, informations: NDArray[np.float64]) -> Violation:
        """Return the worst violation of all requirements, criteria left out."""
        found = [
            asked.requirement.worst(informations[asked.scenario])
            for asked in self.asked
            if not isinstance(asked.requirement, Criterion)
        ]
        return worst(found)


@dataclass(frozen=True)
class Alternative:
    """Holds a further plant for which the design must hold, in raw parameters; see `Question`."""

    experiment: Experiment
    requirements: Sequence[RequirementFactory]
    side: Sequence[RequirementFactory] = ()

    def at(self, coordinates: Experiment) -> Scenario:
        """Return its requirements in the coordinates of this experiment."""
        required = tuple(make(coordinates) for make in self.requirements)
        return Scenario(coordinates, required, tuple(make(coordinates) for make in self.side))


@dataclass(frozen=True)
class Question:
    """A design question in raw parameters: requirements are made for the coordinates of a design.

    The goal "factor" improves on `requirements` (one criterion, or several requirements); `side` must also
    hold. The other goals meet all of them. They hold at the nominal plant, which `experiment` has, and at
    each of the `others`; `paid` is as in `Problem`. `anywhere` is the band of the bound over every spectrum,
    if the best design is only approached at an end of the band of the experiment.
    """

    experiment: Experiment
    basis: Basis
    goal: Goal
    requirements: Sequence[RequirementFactory]
    side: Sequence[RequirementFactory] = ()
    cost: Mapping[PowerKind, Weight] = field(default_factory=dict)
    limits: Sequence[PowerLimit] = ()
    densities: Sequence[DensityLimit] = ()
    others: Sequence[Alternative] = ()
    paid: Paid = "nominal"
    anywhere: tuple[float, float] | None = None

    @property
    def plants(self) -> list[Alternative]:
        """Return all plants for which the design must hold, the nominal one first."""
        return [Alternative(self.experiment, self.requirements, self.side), *self.others]

    def at_alpha(self, alpha: float) -> Question:
        """Return the question with another confidence factor of the model errors of the nominal plant."""

        def changed(make: RequirementFactory) -> RequirementFactory:
            return lambda experiment: with_alpha([make(experiment)], alpha)[0]

        return replace(
            self, requirements=list(map(changed, self.requirements)), side=list(map(changed, self.side))
        )

    def of_length(self, samples: int) -> Question:
        """Return the question for experiments with this number of samples."""
        others = [replace(one, experiment=one.experiment.with_samples(samples)) for one in self.others]
        return replace(self, experiment=self.experiment.with_samples(samples), others=others)
