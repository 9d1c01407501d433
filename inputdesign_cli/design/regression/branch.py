"""Branch and bound over rho_1 .. rho_{m-1}: a proof that no Toeplitz shape has less than a given error.

The method is [horst-tuy-1996]. Where all of these are fixed the problem is convex (`steps.extend`), and the
lift of a small box is nearly exact.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import count

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.design.regression.lift import Box, Lift, NodeBound, box_limits
from inputdesign_cli.design.regression.toeplitz import ToeplitzProblem

# Most boxes of a proof, which take seconds. For m >= 4 a box takes longer, and more boxes hardly help.
_NODES, _NODES_BEYOND = 400, 100


class BranchAndBound:
    """Holds the state of a proof: boxes that are open, and the least bound of the closed ones.

    Attributes:
        open: the heap of bounds with a number, the box, and its relaxation if that was solved.
        nodes: relaxations solved so far.
        assumed: whether the bound of some box rests on `lift.SMALLEST_EIGENVALUE`.
    """

    def __init__(self, problem: ToeplitzProblem) -> None:
        """Begin with all shapes in one box, and nothing known."""
        self.problem, self.lift, self._order = problem, Lift(problem), count()
        edge = np.ones(problem.m - 1)
        self.open: list[tuple[float, int, Box, NodeBound | None]]
        self.open = [(-np.inf, next(self._order), np.array([-edge, edge]), None)]
        self.closed, self.nodes, self.assumed = np.inf, 0, False

    @property
    def bound(self) -> float:
        """Return a lower bound on the error over all boxes, at the largest energy considered so far."""
        return min(self.closed, self.open[0][0] if self.open else np.inf)

    def prove(
        self,
        kappa: Callable[[], float],
        level: Callable[[], float],
        suggest: Callable[[Array], None] = lambda _: None,
    ) -> bool:
        """Split boxes until |b|^2 + kappa v >= level on all of them, or until time or boxes run out.

        kappa must not fall and may rise: a bound at one energy holds for every smaller one. `suggest` is
        given the autocorrelations of each relaxed optimum below the level; it may improve the incumbent,
        and thereby kappa and level. A better shape has v <= level / kappa.
        """
        while self.open and self.nodes < (_NODES if self.problem.m <= 3 else _NODES_BEYOND):
            node = heapq.heappop(self.open)
            bound, _, whole, found = node
            if bound >= level():
                self.closed = min(self.closed, bound)
                continue
            try:
                for box in (whole,) if found is None else self._halves(whole, found):
                    self._examine(bound, box, kappa(), level, suggest)
            except OutOfTimeError:
                heapq.heappush(self.open, node)  # its own bound counts until both halves are examined
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
        # Shapes beyond the limit on u have at least the level, so that no larger bound is proved.
        bound = max(min(found.bound, level()), least)
        if bound < level() and found.rho.size:
            suggest(found.rho)
        heapq.heappush(self.open, (bound, next(self._order), box, found))

    def _halves(self, box: Box, found: NodeBound) -> tuple[Box, ...]:
        """Return the two halves of a box across the coordinate in which its relaxation is least exact."""
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
