"""Toeplitz designs with their proofs: least energy for a target error, least error for an energy."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import finishing, seconds_left
from inputdesign_cli.design.regression.branch import BranchAndBound
from inputdesign_cli.design.regression.lift import SMALLEST_EIGENVALUE
from inputdesign_cli.design.regression.model import MomentsDesign, Regression
from inputdesign_cli.design.regression.search import Search
from inputdesign_cli.design.regression.steps import Region, extend
from inputdesign_cli.design.regression.toeplitz import Goal, Shape, ToeplitzProblem

_NODES, _NODES_BEYOND = 400, 100  # the boxes of m >= 4 are many and dear, and more of them close little
_STARTS = 8  # beside white
# A target is out of reach if no energy up to this many n sigma^2 |L1|^2 / gamma is enough; the largest
# of these for which the proof closes counts.
_PROVED_MULTIPLES = (1e6, 1e4, 1e2)


class OutOfReachError(Exception):
    """Raised when no energy meets the target: the bias alone is too large.

    Attributes:
        bias: |b| / |L1| of the least biased shape that was found.
        proved: the multiple of n sigma^2 |L1|^2 / gamma up to which it is proved; 0 if it is not.
        assumed: whether the proof takes R11 / r_0 >= SMALLEST_EIGENVALUE.
    """

    def __init__(self, bias: float, proved: float, assumed: bool) -> None:
        super().__init__("the target is out of reach")
        self.bias, self.proved, self.assumed = bias, proved, assumed


def design_toeplitz(
    regression: Regression,
    *,
    target: float | None = None,
    energy: float | None = None,
    tolerance: float = 1e-6,
    rng: np.random.Generator,
    alternating: bool = False,
) -> MomentsDesign:
    """Design by sequential convex programming from several starts, then branch and bound.

    Args:
        target: the error that is allowed; the energy is minimised. Or else
        energy: the trace of R; the error is minimised.
        tolerance: the relative gap to be proved; larger gaps are proved where it cannot be.
        alternating: run the alternation of [eckhard-mse], Section 4.2, from white: its design is kept as it
            is, and only the bound comes from here. With R11 fixed the bias is least; with Z = R11^-1 R12
            fixed only the scale of R is free, so that the shape of R11 never changes. Without neglected
            parameters R11 is free, and the search finds the best.

    Raises:
        OutOfReachError: no energy meets the target.
        OutOfTimeError: no shape that meets the target was found in time.
    """
    problem, goal = ToeplitzProblem.of(regression), Goal.of(regression, target=target, energy=energy)
    search = Search(problem, goal, Region.beginning_with(np.ones(1), problem.n))
    alternating = alternating and problem.n > problem.m
    starts = search.starts(0 if alternating else _STARTS, rng)
    if alternating:
        found = [extend(problem, start.rho[: problem.m]) or start for start in starts]
    else:
        found = [search.descend(start) for start in starts]
    shape = min(found, key=lambda one: (goal.value(one), one.bias_squared))
    if not np.isfinite(goal.value(shape)):
        raise _out_of_reach(problem, goal, shape)
    proof = _Proof(search, shape)
    bound = proof.run(tolerance)
    if not alternating:
        with finishing():
            shape = search.tidied(_least_biased(problem, proof.shape))
    spent = energy if energy is not None else goal.stated(goal.value(shape))
    R = scipy.linalg.toeplitz(shape.rho) * (spent / problem.n)
    counts = {"starts": len(found), "solves": search.solves, "nodes": proof.tree.nodes}
    assumed = {"assumed_smallest_eigenvalue": SMALLEST_EIGENVALUE} if proof.tree.assumed else {}
    return MomentsDesign(R, regression.error(R), goal.stated(bound), shape.rho, {**counts, **assumed})


def _least_biased(problem: ToeplitzProblem, shape: Shape) -> Shape:
    """Return the least biased shape with this R11, the limit alpha -> 0 where the bias is free."""
    if problem.biased or problem.n == problem.m:
        return shape
    found = extend(replace(problem, biased=True), shape.rho[: problem.m])
    return shape if found is None else problem.evaluate(found.rho) or shape


class _Proof:
    """Bounds the goal from below while the best `shape` may still improve."""

    def __init__(self, search: Search, shape: Shape) -> None:
        self.search, self.shape, self.tree = search, shape, BranchAndBound(search.problem)

    def run(self, tolerance: float) -> float:
        """Return the lower bound on the goal's value."""
        goal, first = self.search.goal, self.search.problem.first

        def level() -> float:
            return (1.0 - tolerance) * goal.value(self.shape)

        nodes = _most_nodes(self.search.problem)
        if goal.kappa is not None:
            kappa = goal.kappa
            self.tree.prove(lambda: kappa, level, most_nodes=nodes, suggest=self._suggest)
            return max(self.tree.bound, 0.0)
        assert goal.target is not None
        target = goal.target
        # Nothing beats the level if at that energy all errors exceed the target.
        if self.tree.prove(lambda: 1.0 / level(), lambda: target, most_nodes=nodes, suggest=self._suggest):
            return level()
        # At any smaller energy the error has grown by the variance at least, and v >= L1_i^2 for all i.
        missing = target - max(self.tree.bound, 0.0)
        return 1.0 / (1.0 / level() + missing / float(np.max(first**2)))

    def _suggest(self, rho: Array) -> None:
        """Search from the autocorrelations of a relaxed optimum, if that looks better than the best."""
        problem, goal = self.search.problem, self.search.goal
        kappa, start = goal.kappa_at(goal.value(self.shape)), problem.evaluate(rho)
        if start is None:
            return
        self.search.solves += 1
        trial = extend(problem, start.rho[: problem.m])
        if trial is not None and trial.error(kappa) < self.shape.error(kappa) * (1.0 - 1e-12):
            self.shape = self.search.descend(trial)


def _most_nodes(problem: ToeplitzProblem) -> int:
    """Return the number of boxes that a proof may bound, a number that takes seconds."""
    return _NODES if problem.m <= 3 else _NODES_BEYOND


def _out_of_reach(problem: ToeplitzProblem, goal: Goal, shape: Shape) -> OutOfReachError:
    """Prove that the error stays above the target for all energies up to one of `_PROVED_MULTIPLES`."""
    assert goal.target is not None
    target, bias = goal.target, float(np.sqrt(shape.bias_squared))
    for multiple in _PROVED_MULTIPLES:
        seconds_left()
        tree, kappa = BranchAndBound(problem), partial(float, target / multiple)
        if tree.prove(kappa, partial(float, target), most_nodes=_most_nodes(problem)):
            return OutOfReachError(bias, multiple, tree.assumed)
    return OutOfReachError(bias, 0.0, False)
