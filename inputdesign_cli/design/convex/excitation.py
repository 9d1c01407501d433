"""Test whether the sinusoids that a spectrum may have can identify all parameters."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.errors import InfeasibleError, bad_spec

_UNEXCITED = 1e-13
_PLENTY = 1e9


def check_excites(problem: Problem, start: Array) -> None:
    """Raise `SpecError` (`too-few-lines`) when even all lines together leave parameters unexcited."""
    if not problem.demands.definite:
        return
    eigenvalues, vectors = np.linalg.eigh(problem.information(start))
    faint = eigenvalues <= _UNEXCITED * eigenvalues[-1]
    if not faint.any():
        _check_reachable(problem, start)
        return
    names = problem.experiment.unexcited(vectors[:, faint])
    raise bad_spec(
        "too-few-lines",
        f"these lines cannot tell the parameters apart: nothing is learnt about {names}",
        hint="each sinusoid tells at most two parameters apart (one at frequency 0 or pi): give more "
        "frequencies, or use type: free",
        key="spectrum",
    )


def _check_reachable(problem: Problem, start: Array) -> None:
    """Raise `InfeasibleError` when no power of these lines is enough: they excite too few directions.

    The noise alone then keeps the information matrix regular, but its part does not grow with power.
    """
    if problem.goal != "cost" or problem.basis.has_density:
        return
    excited = np.linalg.eigvalsh(problem.excited(start)[0])
    if excited[0] > _UNEXCITED * excited[-1]:
        return
    try:
        ratio = problem.demands.worst_ratio(problem.informations(_PLENTY * start)).ratio
    except np.linalg.LinAlgError:
        ratio = np.inf
    if ratio > 1.0:
        raise InfeasibleError.because(
            "infeasible",
            "no power of these lines reaches the accuracy: they excite only "
            f"{int(np.sum(excited > _UNEXCITED * excited[-1]))} combinations of the "
            f"{problem.experiment.size} parameters",
            "each sinusoid tells at most two parameters apart: give more frequencies, or use type: free",
            "spectrum",
        )
