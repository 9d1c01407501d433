"""How far G would move if the model had one parameter more, in units of the admissible error.

r_u is the error of a right model. That of a wrong one shows only as far as the record excites it. So beside
a verdict stands how far one more parameter would move G, to first order, and how far it may with these data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.identification import Directed, Estimate, that_matter
from inputdesign_cli.plant import Model
from inputdesign_cli.runs.results import Json
from inputdesign_cli.runs.units import Units
from inputdesign_cli.tasks.result.refutations import REMEDY, chance

# Two-sided 95 % of the normal distribution.
_ALLOWED = 1.959963984540054


@dataclass(frozen=True)
class Neglected:
    """A parameter that the model does without.

    Attributes:
        moves: how far G would move if it were estimated along, over what is admitted there.
        may_move: how far it may at most, with 95 %.
        frequency: where, in the unit of the experiment.
    """

    directed: Directed
    moves: float
    may_move: float
    frequency: float

    @property
    def of_structure(self) -> bool:
        """Whether it is a parameter of a larger structure, not a gain that is not always the same."""
        return self.directed.test.fault in ("plant", "noise")

    def entry(self, units: Units) -> dict[str, Json]:
        """One of `assessment.neglected` or `assessment.variations`."""
        return {
            "parameter": self.directed.test.name,
            "probability": self.directed.test.probability,
            "moves": self.moves,
            "may_move": self.may_move,
            "frequency": self.frequency / units.frequency,
        }


def neglected(model: Model, estimate: Estimate, errors: Sequence[OnModelError]) -> list[Neglected]:
    """What was tried and did not refute the estimated `model`; nothing where no error of G is admitted."""
    refuted = {test.name for test in estimate.failed}
    tried = [directed for directed in estimate.directed if directed.test.name not in refuted]
    return [
        max((_largest(model, directed, error) for error in errors), key=lambda one: one.may_move)
        for directed in (tried if errors else [])
    ]


def _largest(model: Model, directed: Directed, error: OnModelError) -> Neglected:
    w = error.grid
    moves, slope = (
        np.max([np.linalg.norm(error.concerned(G), axis=1) for G in states], axis=0) / error.admissible.at(w)
        for states in (directed.moves(model, w), directed.slope(model, w))
    )
    at = int(np.argmax(moves + _ALLOWED * directed.deviation * slope))
    may_move = moves[at] + _ALLOWED * directed.deviation * slope[at]
    return Neglected(directed, float(np.max(moves)), float(may_move), float(w[at]))


def mattering(found: Sequence[Neglected]) -> list[Neglected]:
    """Those that speak against a verdict."""
    return [found[i] for i in that_matter([one.directed for one in found], [one.moves for one in found])]


def objections(units: Units, found: Sequence[Neglected]) -> list[str]:
    """What to say of those that matter."""
    return [
        f"{one.directed.alternatives[0].phrase} would move G by "
        f"{one.moves:.3g} times the admissible error about {units.named(one.frequency)} (probability "
        f"{chance(one.directed.test.probability)} without it): {REMEDY[one.directed.test.fault]}"
        for one in mattering(found)
    ]


def unseen(units: Units, found: Sequence[Neglected]) -> list[str]:
    """What the record leaves open of the structure, where that is more than is admitted."""
    worst = max((one for one in found if one.of_structure), key=lambda one: one.may_move, default=None)
    if worst is None or worst.may_move <= 1.0:
        return []
    return [
        f"the verdict rests on the structure of the model: {worst.directed.alternatives[0].phrase} that "
        f"these data do not rule out would move G by up to {worst.may_move:.3g} times the admissible error, "
        f"at {units.named(worst.frequency)} (95 %)"
    ]
