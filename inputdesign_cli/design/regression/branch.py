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
from inputdesign_cli.design.regression.lift import Box, Lift, NodeBound, box_limits
from inputdesign_cli.design.regression.toeplitz import ToeplitzProblem


@dataclass(order=True)
class Node:
    """Holds a box and its bound."""

    bound: float
    number: int
    box: Box = field(compare=False)
    found: NodeBound | None = field(compare=False, default=None)


class BranchAndBound:
    """Holds the state of a proof: boxes that are open, and the least bound of the closed ones.

    Attributes:
        nodes: relaxations solved so far.
        assumed: whether the bound of some box rests on `lift.SMALLEST_EIGENVALUE`.
    """

    def __init__(self, problem: ToeplitzProblem) -> None:
        """Begin with all shapes in one box, and nothing known."""
        self.problem, self.lift, self._order = problem, Lift(problem), count()
        edge = np.ones(problem.m - 1)
        self.open = [Node(-np.inf, next(self._order), np.array([-edge, edge]))]
        self.closed, self.nodes, self.assumed = np.inf, 0, False

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
                continue
            try:
                for box in (node.box,) if node.found is None else self._halves(node.box, node.found):
                    self._examine(node.bound, box, kappa(), level, suggest)
            except OutOfTimeError:
                heapq.heappush(self.open, node)  # with its halves not all examined, its own bound counts
                break
        return self.bound >= level()

    def _examine(
        self,
        least: float,
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
        self.assumed |= allowed.assumed
        # Shapes beyond the limit on u have at least the level; more than that is not known of them.
        bound = max(min(found.bound, level()), least)
        if bound < level() and found.rho.size:
            suggest(found.rho)
        heapq.heappush(self.open, Node(bound, next(self._order), box, found))

    def _halves(self, box: Box, found: NodeBound) -> tuple[Box, ...]:
        """Return the two halves of a box across the coordinate that its relaxation knows least of."""
        width = box[1] - box[0]
        if width.size == 0 or width.max() < 1e-9:
            self.closed = min(self.closed, found.bound)
            return ()
        k = int(np.argmax(found.spread * width + 1e-12 * width))
        at = float(box.mean(axis=0)[k])
        if found.rho.size:
            at = float(np.clip(found.rho[k + 1], at - 0.25 * width[k], at + 0.25 * width[k]))
        left, right = box.copy(), box.copy()
        left[1, k] = right[0, k] = at
        return left, right
