"""Sequential convex programming over Toeplitz shapes: good designs, without proof.

Each step linearises the bias, keeps the variance exact by a matrix inequality, and stays within a
trust region. The variance is convex in the shape; only the bias makes the problem hard.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.design.regression.steps import Region, extend, rescale, step
from inputdesign_cli.design.regression.toeplitz import Autocorrelations, ToeplitzProblem, Weight

_MAX_STEPS = 60
STEP_TOLERANCE = 1e-10
"""The relative gain below which a search ends."""
_SMALLEST_RADIUS = 1e-9
# Where the target cannot be met at the present energy, variance is made cheaper in these steps.
_RELAXED = (1.0, 1e-2, 1e-4, 1e-6, 1e-9)


@dataclass(frozen=True)
class Goal:
    """The goal: least error for an energy, or least energy for a target error, in units of `ToeplitzProblem`.

    Attributes:
        kappa: sigma^2 n / (energy unit): the error of v = 1 when the energy is given; else None.
        target: the largest |b|^2 + kappa v that is allowed when the energy is sought; else None.
    """

    kappa: float | None = None
    target: float | None = None
    biased: bool = True

    def value(self, shape: Autocorrelations) -> float:
        """Return what is minimised: the error, or 1 / kappa (energy up to a factor); infinite if not met."""
        if self.kappa is not None:
            return Weight(self.kappa, self.biased)(shape)
        assert self.target is not None
        slack = self.target - (shape.bias_squared if self.biased else 0.0)
        return shape.v / slack if slack > 0.0 else np.inf

    def weight(self, value: float) -> Weight:
        """Return the convexified goal at a reached value: least error at that energy, [dinkelbach-1967]."""
        return Weight(self.kappa if self.kappa is not None else 1.0 / value, self.biased)


@dataclass
class Counter:
    """Counts the small programs that were solved."""

    solves: int = field(default=0)


def descend(
    problem: ToeplitzProblem, region: Region, goal: Goal, start: Autocorrelations, counter: Counter
) -> Autocorrelations:
    """Find a local minimum of the goal from `start`; it may miss the target if no feasible shape was met."""
    shape = start
    for relaxed in _RELAXED:
        if np.isfinite(goal.value(shape)):
            break
        assert goal.target is not None
        cheaper = Goal(relaxed * goal.target / shape.v, biased=goal.biased)
        shape = _trust_region(problem, region, shape, cheaper, counter, until=goal)
    return _trust_region(problem, region, shape, goal, counter) if np.isfinite(goal.value(shape)) else shape


def _trust_region(
    problem: ToeplitzProblem,
    region: Region,
    shape: Autocorrelations,
    goal: Goal,
    counter: Counter,
    *,
    until: Goal | None = None,
) -> Autocorrelations:
    radius = 0.5
    for _ in range(_MAX_STEPS):
        if until is not None and np.isfinite(until.value(shape)):
            break
        weight = goal.weight(goal.value(shape))
        counter.solves += 1
        try:
            found = step(problem, region, weight, shape, radius)
        except OutOfTimeError:  # the best so far is an answer
            break
        if found is None:
            radius /= 4.0
            if radius < _SMALLEST_RADIUS:
                break
            continue
        rho, model = found
        now = weight(shape)
        predicted = now - model
        if predicted <= STEP_TOLERANCE * now:
            break
        trial = problem.evaluate(rho)
        gained = now - weight(trial) if trial is not None else -np.inf
        if trial is not None and gained > 0.0 and goal.value(trial) < goal.value(shape):
            shape = trial
        if gained < 0.25 * predicted:
            radius /= 4.0
        elif gained > 0.75 * predicted:
            radius = min(2.0, 2.0 * radius)
        if radius < _SMALLEST_RADIUS:
            break
    return shape


def starts(problem: ToeplitzProblem, count: int, rng: np.random.Generator) -> list[Autocorrelations]:
    """Return starts: white, and random shapes of a few lines over a little white noise."""
    shapes = [problem.evaluate(np.eye(problem.n)[0])]
    for _ in range(count):
        lines = rng.integers(1, problem.n + 1)
        power = rng.dirichlet(np.ones(lines))
        rho = np.cos(np.arange(problem.n)[:, None] * np.pi * rng.random(lines)) @ power
        shapes.append(problem.evaluate(0.9 * rho + 0.1 * np.eye(problem.n)[0]))
    return [shape for shape in shapes if shape is not None]


def best(shapes: Sequence[Autocorrelations], goal: Goal) -> Autocorrelations:
    """Return the shape of least value; among shapes that miss the target, the one of least bias."""
    return min(shapes, key=lambda s: (goal.value(s), s.bias_squared))


_MAX_ROUNDS = 50
_SETTLED = 1e-9


def alternate(
    problem: ToeplitzProblem, goal: Goal, start: Autocorrelations, counter: Counter
) -> Autocorrelations:
    """Run the alternation of [eckhard-mse], Section 4.2: fix R11 and solve, fix Z and solve, repeat.

    With Z = R11^-1 R12 fixed, generally only the scale of R is free: for m >= 2 the shape of R11 never
    changes. The gap of its answer, proved as for the other methods, shows this. If the present shape misses
    the target, the bias alone is reduced.
    """
    shape = start
    for _ in range(_MAX_ROUNDS):
        before = shape
        for half in (extend, rescale):
            value = goal.value(shape)
            weight = goal.weight(value) if value < float("inf") else Weight(0.0, goal.biased)
            counter.solves += 1
            try:
                if half is extend:
                    rho = extend(problem, weight, shape.rho[: problem.m])
                else:
                    rho = rescale(problem, weight, shape)
            except OutOfTimeError:  # the best so far is an answer
                return shape
            trial = None if rho is None else problem.evaluate(rho)
            if trial is not None and weight(trial) < weight(shape):
                shape = trial
        now, then = goal.value(shape), goal.value(before)
        if shape is before or then - now <= _SETTLED * now:
            break
    return shape
