"""How far G would move if the model had one parameter more, in units of the admissible error.

r_u is the error of a right model. That of a wrong one shows only as far as the record excites it. So beside
a verdict stands how far one more parameter would move G, to first order, and how far it may with these data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.identification import Directed, Estimate, Moves, that_matter
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.refutations import REMEDY, chance

# Two-sided 95 % of the normal distribution.
_ALLOWED = 1.959963984540054


@dataclass(frozen=True)
class Neglected:
    """A parameter that the model does without.

    Attributes:
        moves: what it does to G, at the frequencies of the requirement.
        may_move: how far it may move G at most, with 95 %, over what is admitted.
        frequency: where, in the unit of the experiment.
    """

    directed: Directed
    moves: Moves
    may_move: float
    frequency: float

    def entry(self, units: Units) -> dict[str, Json]:
        """One of `assessment.neglected` or `assessment.variations`."""
        return {
            "parameter": self.directed.test.name,
            "probability": self.directed.test.probability,
            "moves": self.moves.largest,
            "may_move": self.may_move,
            "frequency": self.frequency / units.frequency,
        }


def neglected(
    model: Model, estimate: Estimate, errors: Sequence[OnModelError], information: Array
) -> list[Neglected]:
    """What was tried and did not refute the estimated `model`; nothing where no error of G is admitted.

    Args:
        information: (k, k), by which r_u is judged.
    """
    refuted = {test.name for test in estimate.failed}
    tried = [directed for directed in estimate.directed if directed.test.name not in refuted]
    return [
        max((_largest(model, directed, error, information) for error in errors), key=lambda one: one.may_move)
        for directed in (tried if errors else [])
    ]


def _largest(model: Model, directed: Directed, error: OnModelError, information: Array) -> Neglected:
    w = error.grid
    moves, slope = (
        np.max([np.linalg.norm(error.concerned(G), axis=1) for G in states], axis=0) / error.admissible.at(w)
        for states in (directed.moves(model, w), directed.slope(model, w))
    )
    deviation = directed.deviation * slope
    # A record that misses what is asked is judged as one that would just meet it.
    known = np.minimum(error.error_bound(information, w) / error.admissible.at(w), 1.0) / error.alpha
    may_move = moves + _ALLOWED * deviation
    at = int(np.argmax(may_move))
    return Neglected(directed, Moves(moves, deviation, known), float(may_move[at]), float(w[at]))


def mattering(found: Sequence[Neglected]) -> list[Neglected]:
    """Those that speak against a verdict."""
    return [found[i] for i in that_matter([one.directed for one in found], [one.moves for one in found])]


def objections(units: Units, found: Sequence[Neglected]) -> list[str]:
    """What to say of those that matter."""
    return [
        f"{one.directed.alternatives[0].phrase} would move G by "
        f"{one.moves.largest:.3g} times the admissible error about {units.named(one.frequency)}"
        f"{'' if one.moves.largest > 1.0 else ', beyond it with the error of the estimate,'} (probability "
        f"{chance(one.directed.test.probability)} without it): {REMEDY[one.directed.test.fault]}"
        for one in mattering(found)
    ]


def unseen(units: Units, found: Sequence[Neglected]) -> list[str]:
    """What the record leaves open of the structure, where that is more than is admitted."""
    worst = max(
        (one for one in found if one.directed.of_structure), key=lambda one: one.may_move, default=None
    )
    if worst is None or worst.may_move <= 1.0:
        return []
    return [
        f"the verdict rests on the structure of the model: {worst.directed.alternatives[0].phrase} that "
        f"these data do not rule out would move G by up to {worst.may_move:.3g} times the admissible error, "
        f"at {units.named(worst.frequency)} (95 %)"
    ]
