"""Toeplitz designs with their proofs: least energy for a target error, least error for an energy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import finishing, seconds_left
from inputdesign_cli.design.regression.branch import BranchAndBound
from inputdesign_cli.design.regression.limits import SMALLEST_EIGENVALUE
from inputdesign_cli.design.regression.local import (
    STEP_TOLERANCE,
    Counter,
    Goal,
    alternate,
    best,
    descend,
    starts,
)
from inputdesign_cli.design.regression.model import ErrorSplit, Regression
from inputdesign_cli.design.regression.steps import Region, all_shapes, extend
from inputdesign_cli.design.regression.toeplitz import Autocorrelations, ToeplitzProblem, Weight

_NODES, _NODES_BEYOND = 400, 100  # the boxes of m >= 4 are many and dear, and more of them close little
_FAINT = 1e-5  # powers of lines below this share, in a design that is flat there
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


@dataclass(frozen=True)
class ToeplitzDesign:
    """A design and the bound that is proved for it.

    Attributes:
        R: (n, n) moments summed over the samples.
        bound: no Toeplitz R does better, in the unit of the objective (energy or error).
        assumed: the least eigenvalue of R11 / r_0 that the proof takes for granted; 0 if none.
        starts, solves, nodes: of the local search, of its small programs, of the branch and bound.
    """

    R: Array
    rho: Array
    energy: float
    split: ErrorSplit
    bound: float
    assumed: float
    starts: int
    solves: int
    nodes: int


@dataclass(frozen=True)
class Normalisation:
    """Converts the units of `ToeplitzProblem` into the units of the regression."""

    regression: Regression

    @property
    def error(self) -> float:
        """Return the error for one unit of |b|^2 + kappa v."""
        r = self.regression
        alpha = r.neglected_norm if r.neglected_norm > 0.0 else 1.0
        return alpha**2 * float(r.estimated @ r.estimated)

    def kappa(self, energy: float) -> float:
        """Return kappa of an energy."""
        r = self.regression
        return r.n * r.variance * float(r.estimated @ r.estimated) / (energy * self.error)

    energy = kappa
    """The energy of a kappa: the map is its own inverse."""


def design_toeplitz(
    regression: Regression,
    *,
    target: float | None = None,
    energy: float | None = None,
    tolerance: float = 1e-6,
    most_nodes: int | None = None,
    count: int = 8,
    rng: np.random.Generator,
    alternating: bool = False,
) -> ToeplitzDesign:
    """Design by sequential convex programming from several starts, then branch and bound.

    Args:
        target: the error that is allowed; the energy is minimised. Or else
        energy: the trace of R; the error is minimised.
        tolerance: the relative gap to be proved; larger gaps are proved where it cannot be.
        most_nodes: the number of boxes that the proof may bound; None: a number that takes seconds.
        alternating: run the alternation of [eckhard-mse] from white, not sequential convex programming;
            its design is kept as it is and only the bound comes from here.

    Raises:
        OutOfReachError: no energy meets the target.
        OutOfTimeError: no shape that meets the target was found in time.
    """
    problem, norm = ToeplitzProblem.of(regression), Normalisation(regression)
    if most_nodes is None:
        most_nodes = _NODES if problem.m <= 3 else _NODES_BEYOND
    goal = Goal(
        kappa=None if energy is None else norm.kappa(energy),
        target=None if target is None else target / norm.error,
        biased=problem.biased,
    )
    counter = Counter()
    if alternating:
        found = [alternate(problem, goal, starts(problem, 0, rng)[0], counter)]
    else:
        region = all_shapes(problem)
        found = [descend(problem, region, goal, start, counter) for start in starts(problem, count, rng)]
    shape = best(found, goal)
    if not np.isfinite(goal.value(shape)):
        raise _out_of_reach(problem, goal, shape, most_nodes)
    proof = _Proof(problem, goal, shape, counter, keep=alternating)
    bound = proof.run(tolerance, most_nodes)
    if not alternating:
        with finishing():
            proof.shape = _tidied(problem, goal, _least_biased(problem, proof.shape))
    spent = energy if energy is not None else norm.energy(1.0 / goal.value(proof.shape))
    R = scipy.linalg.toeplitz(proof.shape.rho) * (spent / problem.n)
    return ToeplitzDesign(
        R=R,
        rho=proof.shape.rho,
        energy=spent,
        split=regression.error(R),
        bound=bound * norm.error if energy is not None else norm.energy(1.0 / bound) if bound > 0 else 0.0,
        assumed=SMALLEST_EIGENVALUE if proof.tree.assumed else 0.0,
        starts=len(found),
        solves=counter.solves,
        nodes=proof.tree.nodes,
    )


def _least_biased(problem: ToeplitzProblem, shape: Autocorrelations) -> Autocorrelations:
    """Return the least biased shape with this R11, the limit alpha -> 0 where the bias is free."""
    if problem.biased or problem.n == problem.m:
        return shape
    rho = extend(replace(problem, biased=True), Weight(1.0), shape.rho[: problem.m])
    trial = None if rho is None else problem.evaluate(rho)
    return shape if trial is None else trial


def _tidied(problem: ToeplitzProblem, goal: Goal, shape: Autocorrelations) -> Autocorrelations:
    """Return the design moved to lines at multiples of 15 degrees, if that does not make it worse.

    An optimum is flat, so a search finds rho only to the root of its tolerance. A constant or alternating
    signal, for example, is recognised here.
    """
    lines = np.pi * np.arange(13) / 12
    columns = np.cos(np.arange(problem.n)[:, None] * lines)
    powers, residual = scipy.optimize.nnls(columns, shape.rho)
    powers[powers < _FAINT] = 0.0
    if residual > _FAINT or not powers.any():
        return shape
    trial = problem.evaluate(columns @ powers / powers.sum())
    if trial is None or not goal.value(trial) <= goal.value(shape) * (1.0 + STEP_TOLERANCE):
        return shape
    return trial


class _Proof:
    """Bounds the goal from below while the incumbent may still improve."""

    def __init__(
        self, problem: ToeplitzProblem, goal: Goal, shape: Autocorrelations, counter: Counter, *, keep: bool
    ) -> None:
        self.problem, self.goal, self.shape, self.counter = problem, goal, shape, counter
        self.keep = keep
        self.challenger = shape
        self.region: Region = all_shapes(problem)
        self.tree = BranchAndBound.start(problem)

    def run(self, tolerance: float, most_nodes: int) -> float:
        """Return the lower bound on the goal's value."""
        goal, kept = self.goal, 1.0 - tolerance
        if goal.kappa is not None:
            kappa = goal.kappa
            self._prove(lambda: kappa, lambda: kept * self._value(), most_nodes)
            return self.tree.bound
        assert goal.target is not None
        target = goal.target
        # Nothing beats `kept` times the incumbent if at that energy all errors exceed the target.
        if self._prove(lambda: 1.0 / (kept * self._value()), lambda: target, most_nodes):
            return kept * self._value()
        # At any smaller energy the error has grown by the variance at least.
        kappa = 1.0 / (kept * self._value())
        missing = target - max(self.tree.bound, 0.0)
        with finishing():
            return 1.0 / (kappa + missing / least_variance(self.problem))

    def _value(self) -> float:
        return self.goal.value(self.challenger)

    def _prove(self, kappa: Callable[[], float], level: Callable[[], float], most_nodes: int) -> bool:
        return self.tree.prove(kappa, level, most_nodes=most_nodes, suggest=self._suggest)

    def _suggest(self, rho: Array) -> None:
        weight = self.goal.weight(self._value())
        start = self.problem.evaluate(rho)
        if start is None:
            return
        self.counter.solves += 1
        extended = extend(self.problem, weight, start.rho[: self.problem.m])
        trial = None if extended is None else self.problem.evaluate(extended)
        if trial is None or weight(trial) >= weight(self.challenger) * (1.0 - 1e-12):
            return
        self.challenger = descend(self.problem, self.region, self.goal, trial, self.counter)
        if not self.keep:
            self.shape = self.challenger


def _out_of_reach(
    problem: ToeplitzProblem, goal: Goal, shape: Autocorrelations, most_nodes: int
) -> OutOfReachError:
    """Prove that the error stays above the target for all energies up to one of `_PROVED_MULTIPLES`."""
    assert goal.target is not None
    target = goal.target
    bias = float(np.sqrt(shape.bias_squared))
    for multiple in _PROVED_MULTIPLES:
        seconds_left()
        proof = BranchAndBound.start(problem)
        if proof.prove(
            lambda: target / multiple,  # noqa: B023 (called before the loop goes on)
            lambda: target,
            most_nodes=most_nodes,
        ):
            return OutOfReachError(bias, multiple, proof.assumed)
    return OutOfReachError(bias, 0.0, False)


def least_variance(problem: ToeplitzProblem) -> float:
    """Return a lower bound on v = L1^T P11^-1 L1 over all shapes.

    For every y, v >= (y^T L1)^2 / (y^T P11 y). Here y^T P11 y is a mean of |sum_i y_i e^{-jiw}|^2 over the
    spectrum of the shape. The y of the least v that is found is taken.
    """
    head = ToeplitzProblem(problem.first, np.zeros(0), biased=False)
    white = head.evaluate(np.eye(head.n)[0])
    assert white is not None
    shape = descend(head, all_shapes(head), Goal(kappa=1.0, biased=False), white, Counter())
    y = np.linalg.lstsq(scipy.linalg.toeplitz(shape.rho), head.first, rcond=1e-9)[0]
    points = 4096
    peak = float(np.max(np.abs(np.fft.rfft(y, points)) ** 2))
    # Between grid points a trigonometric polynomial of degree d exceeds them by at most this (Bernstein).
    slack = 1.0 - 0.5 * (np.pi * problem.m / points) ** 2
    return float((y @ head.first) ** 2) / (peak / slack)
