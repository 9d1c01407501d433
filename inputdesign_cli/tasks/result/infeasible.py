"""Why nothing meets the requirements within the limits, and what would."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.accuracy import Requirement
from inputdesign_cli.design.convex.designs import Question, solve_design
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.runs.units import Units
from inputdesign_cli.spectrum import LinesBasis

# A limit takes part in the conflict when its share of the proof's weight is above this.
_TAKES_PART = 1e-4
_TOLERANCE = 1e-5


def explain(units: Units, question: Question, unreachable: UnreachableError) -> InfeasibleError:
    """The proof that came with the failure, in the words of the spec."""
    problem, nearest = unreachable.problem, unreachable.nearest
    proved = nearest.certificate.bound
    weights = nearest.certificate.limits * np.array([limit.bound for limit in problem.limits])
    stated = len(question.limits)  # limits implied by those on the density follow
    involved = [
        limit
        for limit, weight in zip(problem.limits[:stated], weights, strict=False)
        if weight > _TAKES_PART * max(weights.max(initial=0.0), 1e-300)
    ]
    if unreachable.limits_alone:
        return _contradiction(involved, proved)
    asked = _conflicting(unreachable)
    names = " and ".join(dict.fromkeys(requirement.name for requirement, _ in asked))
    where = sorted({w for _, w in asked if w is not None})
    at = f" (hardest at {_list(where, units)})" if where else ""
    needs = [_needed(question, limit) for limit in involved if limit.upper]
    parts = [text for text in needs if text]
    looser = np.sqrt(max(proved, 1.0))
    if not parts:
        # The optimum of the goal "factor" meets the accuracy within limits so many times as large.
        times = f"would have to be {_up(nearest.objective)} times as large"
        only_density = problem.densities and not stated
        together = f"no change of a single limit is enough; all of them together {times}"
        parts = [f"limits.spectrum {times}" if only_density else together]
    message = f"{names}{at} cannot be met within the limits: " + "; ".join(parts)
    hint = (
        f"raise the limit, or loosen the accuracy: within the limits the error can be made no smaller than "
        f"{looser:.4g} times what is asked"
    )
    if question.goal == "cost" and question.experiment.prior is None and np.isfinite(nearest.objective):
        # Within the same limits information grows in proportion to the length.
        longer = int(np.ceil(question.experiment.samples * nearest.objective))
        hint += f"; with {longer} samples a spectrum can"
    if _within_reach_of_any(question):
        hint += "; spectrum: {type: free} can meet it"
    if problem.densities and stated:
        hint += "; limits.spectrum takes part"
    key = involved[0].key if involved else "limits"
    return InfeasibleError.because("infeasible", message, hint, key)


def _conflicting(unreachable: UnreachableError) -> list[tuple[Requirement, float | None]]:
    requirements = unreachable.problem.requirements
    return [(requirements[index], frequency) for index, frequency in unreachable.nearest.active]


def _needed(question: Question, limit: PowerLimit) -> str:
    """The least power of this kind with which the other limits allow the accuracy; empty if none does."""
    others = [other for other in question.limits if other is not limit]
    if limit.channel is not None:
        return ""
    asked = [*question.requirements, *question.side] if question.goal == "cost" else list(question.side)
    alone = Question(
        experiment=question.experiment,
        basis=question.basis,
        goal="cost",
        requirements=asked,
        cost={limit.kind: 1.0},
        limits=others,
        densities=question.densities,
    )
    try:
        least = solve_design(alone, tolerance=_TOLERANCE).result.certificate.bound
    except (UnreachableError, np.linalg.LinAlgError):
        return ""
    if limit.implied:
        peak = np.sqrt(limit.bound)
        return f"needs {limit.kind} power >= {_up(least)}, but a peak of {peak:.6g} leaves {limit.bound:.6g}"
    return f"needs {limit.kind} power >= {_up(least)}, limit is {limit.bound:.6g}"


def _within_reach_of_any(question: Question) -> bool:
    """Whether some spectrum of another type meets what this type cannot (densities are left out)."""
    if question.densities or question.basis.free:
        return False
    experiment = question.experiment
    anything = LinesBasis.anywhere(*experiment.band, experiment.inputs)
    try:
        solve_design(replace(question, basis=anything), tolerance=_TOLERANCE)
    except (UnreachableError, np.linalg.LinAlgError):
        return False
    return True


def _contradiction(involved: list[PowerLimit], proved: float) -> InfeasibleError:
    lower = [limit for limit in involved if not limit.upper]
    upper = [limit for limit in involved if limit.upper]
    names = ", ".join(dict.fromkeys(limit.key for limit in (*lower, *upper))) or "limits.spectrum"
    where = [*lower, *upper][0].key if involved else "limits"
    return InfeasibleError.because(
        "contradictory-limits",
        f"no spectrum of this type keeps to {names}: the upper limits would have to be {proved:.4g} "
        "times as large for the lower ones to be reached",
        "lower min, or raise max",
        where,
    )


def _list(frequencies: list[float], units: Units) -> str:
    shown: list[float] = []
    for w in frequencies:
        if not shown or w > 1.01 * shown[-1] + 1e-6:
            shown.append(w)
    text = ", ".join(f"{w / units.frequency:.4g}" for w in shown[:3])
    return f"{text}{', ..' if len(shown) > 3 else ''} {units.per_time}"


def _up(value: float) -> str:
    """Six digits, rounded up: what is printed suffices."""
    digits = 5 - int(np.floor(np.log10(value)))
    return f"{np.ceil(value * 10.0**digits) / 10.0**digits:.6g}"
