"""Compute how far G would move if the model had an additional parameter, relative to the admissible error.

r_u is the error of a right model. The error of a wrong model shows only as far as the record excites it.
So a verdict comes with the change of G by an additional parameter, to first order, and with the largest
change that these data do not exclude.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import DOUBT, NOTE, REFUTED, Finding, FindingKind, finding
from inputdesign_cli.findings.refuted_structure import OF_ONE
from inputdesign_cli.identification import RISING, Directed, Estimate, Moves, that_matter
from inputdesign_cli.outcome import Neglected as Entry
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model

# Two-sided 95 % of the normal distribution.
_ALLOWED = 1.959963984540054


@dataclass(frozen=True)
class Neglected:
    """A parameter that the model does without.

    Attributes:
        moves: the change of G, at the frequencies of the requirement.
        may_move: the largest change of G that is not excluded (95 %), over the admissible error.
        frequency: the frequency of this change, in the unit of the experiment.
    """

    directed: Directed
    moves: Moves
    may_move: float
    frequency: float

    def entry(self, units: Units) -> Entry:
        """Return its entry of `assessment.neglected` or `assessment.variations`."""
        test = self.directed.test
        frequency = self.frequency / units.frequency
        return Entry(test.name, test.probability, self.moves.largest, self.may_move, frequency)


def neglected(
    model: Model, estimate: Estimate, errors: Sequence[OnModelError], information: Array
) -> list[Neglected]:
    """Return the tried parameters that do not refute `model`; an empty list if no error of G is specified.

    Args:
        information: (k, k), the information matrix of r_u.
    """
    refuted = {test.name for test in estimate.tests.failed}
    tried = [directed for directed in estimate.tests.directed if directed.test.name not in refuted]
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
    # If r_u exceeds the admissible error, the parameter is judged as if r_u just met it.
    known = np.minimum(error.error_bound(information, w) / error.admissible.at(w), 1.0) / error.alpha
    may_move = moves + _ALLOWED * deviation
    at = int(np.argmax(may_move))
    return Neglected(directed, Moves(moves, deviation, known), float(may_move[at]), float(w[at]))


def mattering(found: Sequence[Neglected]) -> list[Neglected]:
    """Return the parameters that speak against a verdict."""
    return [found[i] for i in that_matter([one.directed for one in found], [one.moves for one in found])]


@finding(DOUBT, "neglected-parameter", "Estimate it too, or excite the frequencies where G would change.")
def objections(kind: FindingKind, units: Units, found: Sequence[Neglected], *, met: bool) -> list[Finding]:
    """A neglected parameter may change G too much. No test refutes the model, but the parameter is likely.

    Its effect on G and the error of the estimate together exceed the admissible error.

    Args:
        met: whether the verdict would be `met`, which a parameter that matters contradicts.
    """
    severity = REFUTED if met else DOUBT  # a verdict `missed` stays with more parameters
    against = []
    for one in mattering(found):
        test, moves, tried = one.directed.test, one.moves.largest, one.directed.alternatives[0]
        against.append(
            kind.found(
                f"{tried.phrase} would move G by {moves:.3g} times the admissible error about "
                f"{units.named(one.frequency)} (probability {chance(test.probability)} without it)",
                where=test.name,
                remedy=OF_ONE[test.fault].remedy,
                severity=severity,
                moves=moves,
                may_move=one.may_move,
                probability=test.probability,
            )
        )
    return against


@finding(
    NOTE,
    "verdict-rests-on-structure",
    "If the structure is not known from physics, excite the frequencies where G would change.",
)
def unseen(kind: FindingKind, units: Units, found: Sequence[Neglected]) -> list[Finding]:
    """The verdict depends on the model structure. A further parameter or a drifting gain may matter.

    It could change G by more than the admissible error, and the data do not exclude it. The message gives its
    largest effect (95 %).
    """
    structure = [one for one in found if one.directed.of_structure]
    rising = [one for one in found if one.directed.test.name.endswith(RISING)]
    largest = (max(those, key=lambda one: one.may_move) for those in (structure, rising) if those)
    worst = next((one for one in largest if one.may_move > 1.0), None)
    if worst is None:
        return []
    fact = (
        f"tests show no sign of {worst.directed.alternatives[0].phrase}, but do not exclude one that moves G "
        f"by {worst.may_move:.3g} times the admissible error, at {units.named(worst.frequency)} (95 %)"
    )
    return [kind.found(fact, where=worst.directed.test.name, may_move=worst.may_move)]
