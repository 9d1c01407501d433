"""Sequential convex programming over Toeplitz shapes: good designs, without proof.

Each step linearises the bias, keeps the variance exact by a matrix inequality, and stays within a
trust region. The variance is convex in the shape; only the bias makes the problem hard.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.design.regression.steps import Region, step
from inputdesign_cli.design.regression.toeplitz import Goal, Shape, ToeplitzProblem

_MAX_STEPS = 60
_STEP_TOLERANCE = 1e-10  # the relative gain below which a search ends
_SMALLEST_RADIUS = 1e-9
# Weights of the variance, relative to the target, that are tried in turn from a start that misses it.
_RELAXED = (1.0, 1e-2, 1e-4, 1e-6, 1e-9)
_FAINT = 1e-5  # smaller errors of rho and smaller powers of lines do not count, since an optimum is flat


@dataclass
class Search:
    """Searches the shapes of a region for a local minimum of the goal, and counts its `solves`."""

    problem: ToeplitzProblem
    goal: Goal
    region: Region
    solves: int = 0

    def starts(self, count: int, rng: np.random.Generator) -> list[Shape]:
        """Return starts: white, and random shapes of a few lines over a little white noise."""
        n = self.problem.n
        white = np.eye(n)[0]
        shapes = [self.problem.evaluate(white)]
        for _ in range(count):
            lines = rng.integers(1, n + 1)
            power = rng.dirichlet(np.ones(lines))
            rho = np.cos(np.arange(n)[:, None] * np.pi * rng.random(lines)) @ power
            shapes.append(self.problem.evaluate(0.9 * rho + 0.1 * white))
        return [shape for shape in shapes if shape is not None]

    def descend(self, start: Shape) -> Shape:
        """Return a local minimum from `start`; it may miss the target if no feasible shape was met."""
        shape = start
        for relaxed in _RELAXED:
            if np.isfinite(self.goal.value(shape)):
                return self._steps(shape, self.goal)
            assert self.goal.target is not None
            shape = self._steps(shape, Goal(relaxed * self.goal.target / shape.v))
        return self._steps(shape, self.goal) if np.isfinite(self.goal.value(shape)) else shape

    def _steps(self, shape: Shape, goal: Goal) -> Shape:
        """Return the last shape of a trust-region search, which ends early once it meets `self.goal`."""
        radius = 0.5
        for _ in range(_MAX_STEPS):
            if goal is not self.goal and np.isfinite(self.goal.value(shape)):
                break
            kappa = goal.kappa_at(goal.value(shape))
            self.solves += 1
            try:
                found = step(self.problem, self.region, kappa, shape, radius)
            except OutOfTimeError:  # the best so far is an answer
                break
            now, gained, predicted = shape.error(kappa), -np.inf, np.inf
            if found is not None:
                predicted = now - found[1]
                if predicted <= _STEP_TOLERANCE * now:
                    break
                trial = self.problem.evaluate(found[0])
                if trial is not None:
                    gained = now - trial.error(kappa)
                    shape = trial if gained > 0.0 and goal.value(trial) < goal.value(shape) else shape
            if gained < 0.25 * predicted:
                radius /= 4.0
            elif gained > 0.75 * predicted:
                radius = min(2.0, 2.0 * radius)
            if radius < _SMALLEST_RADIUS:
                break
        return shape

    def tidied(self, shape: Shape) -> Shape:
        """Return the design moved to lines at multiples of 15 degrees, if that does not make it worse.

        An optimum is flat, so a search finds rho only to the root of its tolerance. A constant or alternating
        signal, for example, is recognised here.
        """
        columns = np.cos(np.arange(self.problem.n)[:, None] * np.pi * np.arange(13) / 12)
        powers, residual = scipy.optimize.nnls(columns, shape.rho)
        powers[powers < _FAINT] = 0.0
        if residual > _FAINT or not powers.any():
            return shape
        trial, value = self.problem.evaluate(columns @ powers / powers.sum()), self.goal.value
        better = trial is not None and value(trial) <= value(shape) * (1.0 + _STEP_TOLERANCE)
        return trial if trial is not None and better else shape
