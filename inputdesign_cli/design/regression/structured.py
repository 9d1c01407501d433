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

_STARTS = 8  # random starts, in addition to white
# A target is out of reach if no energy up to this multiple of n sigma^2 |L1|^2 / gamma is enough. The largest
# multiple for which the proof closes counts.
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
        tolerance: the relative gap to be proved; a larger gap is proved where this one cannot be.
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
    bound, better, tree = _proved(search, shape, tolerance)
    if not alternating:
        with finishing():
            shape = search.tidied(_least_biased(problem, better))
    spent = energy if energy is not None else goal.stated(goal.value(shape))
    R = scipy.linalg.toeplitz(shape.rho) * (spent / problem.n)
    counts = {"starts": len(found), "solves": search.solves, "nodes": tree.nodes}
    assumed = {"assumed_smallest_eigenvalue": SMALLEST_EIGENVALUE} if tree.assumed else {}
    return MomentsDesign(R, regression.error(R), goal.stated(bound), shape.rho, {**counts, **assumed})


def _least_biased(problem: ToeplitzProblem, shape: Shape) -> Shape:
    """Return the least biased shape with this R11, the limit alpha -> 0 where the bias is free."""
    if problem.neglected_norm or problem.n == problem.m:
        return shape
    found = extend(replace(problem, neglected_norm=1.0), shape.rho[: problem.m])
    return shape if found is None else problem.evaluate(found.rho) or shape


def _proved(search: Search, best: Shape, tolerance: float) -> tuple[float, Shape, BranchAndBound]:
    """Return a lower bound on the goal's value, the best shape, which the proof may improve, and its tree."""
    problem, goal, tree = search.problem, search.goal, BranchAndBound(search.problem)

    def level() -> float:
        return (1.0 - tolerance) * goal.value(best)

    def suggest(rho: Array) -> None:
        nonlocal best
        kappa, start = goal.kappa_at(goal.value(best)), problem.evaluate(rho)
        if start is None:
            return
        search.solves += 1
        trial = extend(problem, start.rho[: problem.m])
        if trial is not None and trial.error(kappa) < best.error(kappa) * (1.0 - 1e-12):
            best = search.descend(trial)

    if goal.kappa is not None:
        tree.prove(partial(float, goal.kappa), level, suggest)
        return max(tree.bound, 0.0), best, tree
    assert goal.target is not None
    # No shape is better than the level if at that energy all errors exceed the target.
    if tree.prove(lambda: 1.0 / level(), partial(float, goal.target), suggest):
        return level(), best, tree
    # At any smaller energy the error has grown by the variance at least, and v >= L1_i^2 for all i.
    missing = (goal.target - max(tree.bound, 0.0)) / float(np.max(problem.estimated**2))
    return 1.0 / (1.0 / level() + missing), best, tree


def _out_of_reach(problem: ToeplitzProblem, goal: Goal, shape: Shape) -> OutOfReachError:
    """Prove that the error stays above the target for all energies up to one of `_PROVED_MULTIPLES`."""
    assert goal.target is not None
    target, bias = goal.target, float(np.sqrt(shape.bias_squared))
    for multiple in _PROVED_MULTIPLES:
        seconds_left()
        tree, kappa = BranchAndBound(problem), partial(float, target / multiple)
        if tree.prove(kappa, partial(float, target)):
            return OutOfReachError(bias, multiple, tree.assumed)
    return OutOfReachError(bias, 0.0, False)
