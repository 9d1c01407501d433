"""Branch and bound over rho_1 .. rho_{m-1}: a proof that no Toeplitz shape has less than a given error.

The method is [horst-tuy-1996]. Where all of these are fixed the problem is convex (`steps.extend`), and the
lift of a small box is nearly exact.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.design.regression.lift import Box, Lift, NodeBound
from inputdesign_cli.design.regression.limits import box_limits
from inputdesign_cli.design.regression.toeplitz import ToeplitzProblem


@dataclass(order=True)
class Node:
    """Holds a box and its bound; `assumed`: the bound rests on `limits.SMALLEST_EIGENVALUE`."""

    bound: float
    number: int
    box: Box = field(compare=False)
    found: NodeBound | None = field(compare=False, default=None)
    assumed: bool = field(compare=False, default=False)


@dataclass
class BranchAndBound:
    """Holds the state of a proof: boxes that are open, and the least bound of the closed ones.

    Attributes:
        nodes: relaxations solved so far.
        closed_assumed: whether a box that is done rests on the assumption of
            `limits.SMALLEST_EIGENVALUE`.
    """

    problem: ToeplitzProblem
    lift: Lift
    open: list[Node] = field(default_factory=list)
    closed: float = np.inf
    nodes: int = 0
    closed_assumed: bool = False
    _order: count = field(default_factory=count)

    @staticmethod
    def start(problem: ToeplitzProblem) -> BranchAndBound:
        """Return the start of the proof: all shapes in one box, nothing known."""
        edge = np.ones(problem.m - 1)
        tree = BranchAndBound(problem, Lift(problem))
        tree.open.append(Node(-np.inf, next(tree._order), Box(-edge, edge)))
        return tree

    @property
    def assumed(self) -> bool:
        """Return whether `bound` rests on the assumption of `limits.SMALLEST_EIGENVALUE`."""
        return self.closed_assumed or any(node.assumed for node in self.open)

    @property
    def bound(self) -> float:
        """Return the least error over all boxes, at the largest energy considered so far."""
        return min(self.closed, self.open[0].bound if self.open else np.inf)

    def prove(
        self,
        kappa: Callable[[], float],
        level: Callable[[], float],
        *,
        most_nodes: int,
        suggest: Callable[[Array], None] = lambda _: None,
    ) -> bool:
        """Split boxes until |b|^2 + kappa v >= level on all of them, or until the time is over.

        kappa must not fall and may rise: a bound at one energy holds for every smaller one. `suggest` is
        given the autocorrelations of each relaxed optimum below the level; it may improve the incumbent,
        and thereby kappa and level. A better shape has v <= level / kappa.
        """
        while self.open and self.nodes < most_nodes:
            node = heapq.heappop(self.open)
            if node.bound >= level():
                self.closed = min(self.closed, node.bound)
                self.closed_assumed |= node.assumed
                continue
            boxes = (node.box,) if node.found is None else self._halves(node.box, node.found)
            try:
                for box in boxes:
                    if not _without_shapes(box):
                        self._examine(node, box, kappa(), level, suggest)
            except OutOfTimeError:
                heapq.heappush(self.open, node)  # with its halves not all examined, its own bound counts
                break
        return self.bound >= level()

    def _examine(
        self,
        parent: Node,
        box: Box,
        kappa: float,
        level: Callable[[], float],
        suggest: Callable[[Array], None],
    ) -> None:
        largest_v = level() / kappa
        allowed = box_limits(self.problem, box, largest_v)
        if allowed.least_v > largest_v:
            self.closed = min(self.closed, level())
            return
        self.nodes += 1
        found = self.lift.bound(box, kappa, allowed)
        if found is None:
            found = NodeBound(-np.inf, np.zeros(0), box.upper - box.lower)
        # Shapes beyond the limit on u have at least the level; more than that is not known of them.
        bound, assumed = min(found.bound, level()), allowed.assumed
        if bound < parent.bound:
            bound, assumed = parent.bound, parent.assumed
        if bound < level() and found.rho.size:
            suggest(found.rho)
        heapq.heappush(self.open, Node(bound, next(self._order), box, found, assumed))

    def _halves(self, box: Box, found: NodeBound) -> tuple[Box, ...]:
        width = box.upper - box.lower
        if width.size == 0 or width.max() < 1e-9:
            self.closed = min(self.closed, found.bound)
            return ()
        coordinate = int(np.argmax(found.spread * width + 1e-12 * width))
        at = box.centre[coordinate]
        if found.rho.size:
            quarter = 0.25 * width[coordinate]
            at = float(np.clip(found.rho[coordinate + 1], at - quarter, at + quarter))
        return box.halves(coordinate, at)


def _without_shapes(box: Box) -> bool:
    """Return whether some vector shows that P11 is nowhere positive semidefinite in the box."""
    m = box.lower.size + 1
    i = np.arange(m)
    lag = np.abs(i[:, None] - i[None, :])
    centre = np.concatenate([[1.0], box.centre])[lag]
    radius = np.concatenate([[0.0], 0.5 * (box.upper - box.lower)])
    vector = np.linalg.eigh(centre)[1][:, 0]
    correlation = np.array([np.sum(np.outer(vector, vector)[lag == k]) for k in range(m)])
    return bool(vector @ centre @ vector + radius @ np.abs(correlation) < 0.0)
