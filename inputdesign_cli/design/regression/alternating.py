"""The alternation of [eckhard-mse], Section 4.2: fix R11 and solve, fix Z = R11^-1 R12 and solve, repeat.

With Z fixed, R11 Z = R12 generally leaves R only free to scale, so that for m >= 2 the shape of R11 never
leaves its start. It is here so that one can see what it does; its gap comes from the proof of the others.
"""

from __future__ import annotations

from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.design.regression.local import Counter, Goal
from inputdesign_cli.design.regression.steps import extend, rescale
from inputdesign_cli.design.regression.toeplitz import Autocorrelations, ToeplitzProblem, Weight

_MAX_ROUNDS = 50
_SETTLED = 1e-9


def alternate(
    problem: ToeplitzProblem, goal: Goal, start: Autocorrelations, counter: Counter
) -> Autocorrelations:
    """Where the alternation ends from `start`.

    A target that the present shape misses is approached by reducing the bias alone.
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
