"""The question of a design in raw parameters; requirements are made for the coordinates of the design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from inputdesign_cli.accuracy.calibration import with_alpha
from inputdesign_cli.design.convex.cost import Paid, Weight
from inputdesign_cli.design.convex.demands import RequirementFactory, Scenario
from inputdesign_cli.design.convex.limits import DensityLimit, PowerLimit
from inputdesign_cli.design.convex.problem import Goal
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.spectrum import Basis


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

    The goal "factor" improves on `goal_requirements` (a criterion, or all requirements); `side` must also
    hold. The other goals meet all of them. They hold at the nominal plant, which `experiment` has, and at
    each of the `others`; `paid` is as in `Problem`. `anywhere` is the band of every spectrum, for a best
    design only approached at an end of the experiment's band.
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
        others = [replace(one, experiment=replace(one.experiment, samples=samples)) for one in self.others]
        return replace(self, experiment=replace(self.experiment, samples=samples), others=others)
