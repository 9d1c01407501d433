"""Designs for every plant that the true one might be: the drawn plants, and the accuracy at each.

All claims about plants that were not drawn hold under the distribution of the draws.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Requirement
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.design.convex.demands import Alternative, Question
from inputdesign_cli.design.convex.designs import Design, solve_design
from inputdesign_cli.design.convex.limits import Paid
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.information import jointly_whitened
from inputdesign_cli.questions.common.foresight import Knowledge

CONFIDENCE = 0.999
"""Confidence of statements on plants that were not drawn."""
MET = 1.0 + 1e-6
# Tolerance of designs that only show the dearest plants.
_ROUGH = 1e-4
_TAKES_PART = 1e-6


@dataclass(frozen=True)
class Batch:
    """Holds plants with parameters `thetas` (S, k), and the number drawn until S were stable."""

    thetas: Array
    plants: tuple[Alternative, ...]
    drawn: int

    @property
    def rejected(self) -> int:
        """Return the number of plants that were unstable."""
        return self.drawn - len(self.plants)


@dataclass(frozen=True)
class Kept:
    """Holds the largest ratio of an error at a plant to the admitted one, and its frequency.

    `asked` are the requirements there. `cost` is the cost of the design at the plant, if it was computed.
    """

    share: float
    asked: tuple[Requirement, ...]
    frequency: float | None = None
    cost: float = 0.0


@dataclass(frozen=True)
class Searched:
    """Holds the worst plant that was found in a region, at `theta` (k,), and its accuracy.

    `tried` plants were looked at in the last search; `added` were found before and are served by the design.
    """

    region: str
    theta: Array
    kept: Kept
    tried: int
    added: int


@dataclass(frozen=True)
class Region(Knowledge):
    """Describes a region of plants: its `name` in words, and the plant at theta (k,), None without one."""

    name: str
    at: Callable[[Array], Alternative | None]

    def theta(self, z: Array) -> Array:
        """Return the parameters at z (m,), as (k,)."""
        return np.asarray(self.centre + self.columns @ z)

    def nearest(self, theta: Array) -> Array:
        """Return a point of the region near these parameters, (m,)."""
        z = self.coordinates(theta)
        return np.clip(z, -1.0, 1.0) if self.box else z / max(float(np.linalg.norm(z)), 1.0)

    def farthest(self, gradient: Array) -> Array:
        """Return the point of the region that is farthest in this direction, (m,)."""
        return np.sign(gradient) if self.box else gradient / max(float(np.linalg.norm(gradient)), 1e-300)


@dataclass(frozen=True)
class Plants:
    """Holds the scenarios of a design: a batch beside the nominal plant; `discard` of it may be left out.

    `afresh` draws others from the same distribution, `fresh` in all; None if plants were listed. `at` gives
    the plant with parameters (k,), and `unknowns` is the number of unknowns of the program. In the `region`
    the worst is `searched`, too.
    """

    batch: Batch
    source: str
    names: tuple[str, ...]
    r_adm: str
    paid: Paid
    discard: int = 0
    afresh: Callable[[], Iterator[Batch]] | None = None
    fresh: int = 0
    at: Callable[[Array], Alternative | None] | None = None
    unknowns: int | None = None
    region: Region | None = None
    searched: Searched | None = None


def without_dearest(question: Question, design: Design, discard: int) -> list[int]:
    """Return the numbers of the `others` that stay if the dearest are left out, one by one.

    Binding plants with the largest multipliers go first, and others take their place.
    """
    kept = list(range(len(question.others)))
    while discard > 0:
        weight = design.result.certificate.shares[1:]
        dear = [n for n in np.argsort(-weight, kind="stable").tolist() if weight[n] > _TAKES_PART]
        # Half of the binding plants at a time: a plant that goes frees others.
        gone = set(dear[: min(discard, max(len(dear) // 2, 1))])
        if not gone:
            break
        kept = [number for place, number in enumerate(kept) if place not in gone]
        discard -= len(gone)
        if discard > 0:
            fewer = replace(question, others=[question.others[number] for number in kept])
            design = solve_design(fewer, tolerance=_ROUGH, any_spectrum_tolerance=None)
    return kept


def kept_by(problem: Problem, design: Design, samples: int) -> list[Kept]:
    """Return the largest ratio of the error to the admissible one at each scenario, the nominal first."""
    return _worst(problem, design, delivered(problem, design, samples))


def _worst(
    problem: Problem, design: Design, informations: NDArray[np.float64], above: float = -np.inf
) -> list[Kept]:
    """Return the largest error ratio at each scenario, with M_s (S, k, k); one up to `above` may become 0."""
    worst = [Kept(0.0, (*there.requirements, *there.side)) for there in problem.scenarios]
    for side in (False, True):
        # Where the best accuracy is sought, requirements may have the ratio that is reached.
        best = design.problem.goal == "factor" and not side
        admitted = float(np.sqrt(design.result.objective)) if best else 1.0
        for index, violation in problem.demands.violations(informations, above=above * admitted, side=side):
            number, share = problem.demands.asked[index].scenario, violation.ratio / admitted
            if share > worst[number].share:
                worst[number] = replace(worst[number], share=share, frequency=violation.frequency)
    return worst


def delivered_samples(design: Design) -> int:
    """Return the samples of the experiment, rounded up where the shortest one is sought."""
    if design.problem.goal != "samples":
        return design.problem.experiment.samples
    return max(int(np.ceil(design.result.s * (1 - 1e-9))), 1)


def delivered(problem: Problem, design: Design, samples: int) -> NDArray[np.float64]:
    """Return the information (S, k, k) of the spectrum at each scenario over this many samples."""
    if problem.goal != "samples":
        return design.result.informations
    return problem.fixed_information + samples * (
        problem.scaled_information + problem.excited(design.result.x)
    )


def tried_on(design: Design, samples: int, plants: Sequence[Alternative], above: float = 0.0) -> list[Kept]:
    """Return the accuracy at plants outside the design; a ratio up to `above` may come out as 0."""
    seconds_left()
    try:
        at = _at(design, samples, plants)
        kept = _worst(at, design, at.informations(design.result.x), above)
        if at.paid == "worst" and at.goal == "cost":
            costs = [cost.at(design.result.x) for cost in at.costs]
            kept = [replace(one, cost=costs[i % len(costs)]) for i, one in enumerate(kept)]
        return kept
    except (np.linalg.LinAlgError, IdesignError):
        if len(plants) > 1:  # one plant or more is to blame
            return [kept for plant in plants for kept in tried_on(design, samples, [plant], above)]
        # The experiment does not identify all of its parameters.
        own = plants[0].at(plants[0].experiment)
        return [Kept(np.inf, (*own.requirements, *own.side))]


def estimate_from(design: Design, samples: int, plant: Alternative, rng: np.random.Generator) -> Array | None:
    """Draw an estimate (k,) from data of the design if this is the true plant; None if undetermined."""
    try:
        alone = _at(design, samples, [plant])
        (information,) = alone.informations(design.result.x)
        root = alone.experiment.factor @ np.linalg.cholesky(information)
        scatter = np.linalg.solve(root.T, rng.standard_normal(len(root)))
    except (np.linalg.LinAlgError, IdesignError):
        return None
    return plant.experiment.model.theta + scatter


def _at(design: Design, samples: int, plants: Sequence[Alternative]) -> Problem:
    """Return the problem at plants outside the design, each in coordinates of its own."""
    on = design.problem.on(design.result.basis)
    power = max(on.power("excitation").at(design.result.x), np.finfo(float).tiny)
    of_length = [plant.experiment.with_samples(samples) for plant in plants]
    whitened = jointly_whitened(of_length, power)
    first, *others = (plant.at(own) for plant, own in zip(plants, whitened, strict=True))
    return replace(
        design.problem,
        experiment=first.experiment,
        requirements=first.requirements,
        side=first.side,
        others=tuple(others),
        limits=(),
        basis=on.basis,
        finer=None,
    )
