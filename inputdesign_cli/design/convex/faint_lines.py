"""Sinusoids of so little power that their information is rounding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.design.convex.exchange import ExchangeResult
from inputdesign_cli.design.convex.problem import Problem

# Shares of the least eigenvalue of the information that lines may take with them.
_ROUNDING, _FAINT = 1e-12, 1e-9


def without_faint_lines(problem: Problem, found: ExchangeResult) -> ExchangeResult:
    """Return the design without the sinusoids that together hardly change its information.

    The solver leaves a little power everywhere. Power alone does not show which lines can go. In a loop with
    integral action, power near frequency zero costs almost nothing and far exceeds that of lines that matter.
    If the cost is minimised, the other lines make up for the removed ones.
    """
    if found.basis.has_density or problem.has_floors or not found.x.any():
        return found
    at = problem.on(found.basis)
    least = np.linalg.eigvalsh(found.informations)[:, 0]
    if least.min() <= 0.0:
        return found
    samples = found.s if problem.goal == "samples" else 1.0  # of the information that was found
    told = samples * found.x * np.max(np.linalg.norm(at.information_maps, axis=(2, 3)) / least, axis=1)
    order = np.argsort(told)
    lost = np.cumsum(told[order])
    # Beside limits there is no room to make up for more than rounding.
    tight = problem.scaled or problem.limits or problem.densities
    faint = lost <= (_ROUNDING if tight else _FAINT)
    if not np.any(faint):
        return found
    x = found.x.copy()
    x[order[faint]] = 0.0
    if problem.scaled:
        return replace(found, x=x)
    x *= 1.0 + 2.0 * lost[faint][-1]
    return replace(found, x=x, objective=at.cost_at(x), informations=at.informations(x))
