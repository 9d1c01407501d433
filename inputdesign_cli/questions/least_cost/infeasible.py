"""Why nothing meets the requirements within the limits, and what would."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError, time_for_hints
from inputdesign_cli.design.convex.designs import solve_design
from inputdesign_cli.design.convex.exchange import exchange
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.errors import Diagnostic, InfeasibleError
from inputdesign_cli.outcome.rounding import rounded_up
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.within_limits import Bought, StatedBound, named
from inputdesign_cli.spectrum import LinesBasis

_TOLERANCE, _EXACT = 1e-5, 1e-6
_ROOM = 1.0 + 1e-4  # so that what is asked is met with room to spare
_STEPS = 30
_LONGEST_STEP, _MOST = 1e3, 1e9
_NO_SHARE = 1e-5


def explain(
    units: Units,
    question: Question,
    unreachable: UnreachableError,
    stated: Sequence[StatedBound] = (),
    *,
    samples_of_record: Callable[[int], int | None] = lambda _: None,
) -> InfeasibleError:
    """The proof that came with the failure, in the words of the spec.

    Args:
        stated: the numbers of the spec that can be loosened.
        samples_of_record: maps the samples that a spectrum takes to what a record takes; None: not known.
    """
    problem, nearest = unreachable.problem, unreachable.nearest
    bought = Bought(units, stated, question.limits, problem, nearest)
    involved = bought.involved
    if unreachable.limits_alone:
        return _contradiction(involved, nearest.certificate.bound)
    missed = (problem.demands.requirement(index) for index, _ in nearest.active)
    names = " and ".join(dict.fromkeys(requirement.name for requirement in missed))
    hint = (
        "raise the limit, or loosen the accuracy: a spectrum can keep errors "
        f"{rounded_up(bought.factor * _ROOM, 4)} times as large as asked, a record somewhat larger ones"
    )
    parts: list[str] = []
    remedies = [hint]
    try:  # that it is infeasible is proved, whatever else is found out
        with time_for_hints():
            parts += _what_would_do(unreachable, question, involved)
            for remedy in _remedies(units, question, nearest.objective, samples_of_record):
                remedies.append(remedy)
    except OutOfTimeError:
        remedies.append("what else would do was not looked for further")
    message = "; ".join([f"{names} cannot be met within the limits: {bought.sentence}", *parts])
    hint = "; ".join(remedies)
    if problem.densities and question.limits:
        hint += "; limits.spectrum takes part"
    key = involved[0].key if involved else "limits"
    return InfeasibleError(Diagnostic("infeasible", message, hint, key, details=bought.details))


def _remedies(
    units: Units, question: Question, times: float, samples_of_record: Callable[[int], int | None]
) -> Iterator[str]:
    """Yield what meets the accuracy within the limits, what takes longest to find out last.

    Args:
        times: what the information lacks within the limits, as a factor.

    Raises:
        OutOfTimeError: see `seconds_left`.
    """
    longer = None
    if question.goal == "cost" and question.experiment.prior is None and np.isfinite(times):
        # Within the same limits information grows in proportion to the length.
        longer = int(np.ceil(question.experiment.samples * times))
        yield f"with {longer} samples a spectrum can"
    if _within_reach_of_any(question):
        yield "spectrum: {type: free} can meet it"
    enough = None if longer is None else samples_of_record(longer)
    if enough is not None:
        yield f"with {units.length(enough)} (and signal.samples, if stated) a record can"


def _what_would_do(
    unreachable: UnreachableError, question: Question, involved: Sequence[PowerLimit]
) -> list[str]:
    """Which limits are exhausted, and what they would have to be."""
    needs = {limit: _needed(unreachable, limit) for limit in involved if limit.upper}
    parts = [f"{named(limit)} is exhausted" for limit, need in needs.items() if not need]
    parts += [need for need in needs.values() if need]
    if not any(needs.values()):
        parts.append(_together(unreachable, question))
    return parts


def _together(unreachable: UnreachableError, question: Question) -> str:
    """What all upper limits would have to be."""
    upper = {limit.key: limit for limit in question.limits if limit.upper}
    raised = [limit for limit in question.limits if limit.upper]
    densities = [density for density in question.densities if density.upper]
    # The optimum of the goal "factor" meets the accuracy if limits and densities are multiplied by it.
    factor = unreachable.nearest.objective if densities else needed_factor(unreachable, raised)
    if factor is None:
        return "no change of the upper limits is enough"
    times = f"would have to be {rounded_up(factor)} times as large"
    if not upper:
        return f"limits.spectrum {times}"
    if any(limit.implied for limit in upper.values()):  # what the spec limits there is not a power
        own = {key: _own_factor(limit, factor) for key, limit in upper.items()}
        own |= {density.key: factor for density in densities}
        listed = " and ".join(f"{key} {rounded_up(each)} times" for key, each in own.items())
        times = f"would have to be as large as a spectrum needs, {listed}, and larger for a record"
    return f"no change of a single limit is enough; all of them together {times}"


def _own_factor(limit: PowerLimit, factor: float) -> float:
    """Return the factor of the number in the spec if its power is multiplied by `factor`."""
    return float(np.sqrt(factor)) if limit.implied else factor


def _needed(unreachable: UnreachableError, limit: PowerLimit) -> str:
    """What the limit would have to be with the others kept; empty if that does not help."""
    factor = needed_factor(unreachable, [limit])
    if factor is None:
        return ""
    least = factor * limit.bound
    channel = "" if limit.channel is None else f" {limit.channel + 1}"
    moves = f"power of the moves of input{channel}"
    power = moves if limit.kind == "moves" else f"{limit.kind}{channel} power"
    needs = f"needs {power} >= {rounded_up(least)}"
    if limit.implied:
        peak = np.sqrt(limit.bound)
        least_peak = rounded_up(float(np.sqrt(least)))
        sample = limit.of_samples
        return (
            f"{needs}, so {sample} of {least_peak} at least; the limit, {sample} of {peak:.6g}, allows "
            f"{limit.bound:.6g}"
        )
    return f"{needs}, limit is {limit.bound:.6g}"


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


def needed_factor(unreachable: UnreachableError, limits: Sequence[PowerLimit]) -> float | None:
    """Return the least factor on these limits together that allows the accuracy; None if none does.

    The multipliers of the limits are the slope of the square of the best ratio: Newton's method, in
    logarithms, between values that are proved too small and values that are known to do. Information of noise
    or of a prior does not grow with the powers: the square of the ratio is not the factor.
    """
    stated = unreachable.problem.limits
    bounds = {place: limit.bound for limit in limits for place in limit.everywhere(stated)}
    places, found = list(bounds), unreachable.nearest
    low, high, at = 1.0, np.inf, 1.0
    for _ in range(_STEPS):
        share = float(found.certificate.limits[places] @ np.array(list(bounds.values()))) * at
        if found.certificate.bound > 1.0 + _EXACT:
            low = at
            if share < _NO_SHARE or low > _MOST:
                return None
            step = min(np.log(found.certificate.bound) / share, np.log(_LONGEST_STEP))
            at = low * float(np.exp(step))
        elif found.objective < 1.0 - _EXACT:
            high = at
        else:
            return at
        if high - low <= _EXACT * low:
            return low
        if at >= high:
            at = float(np.sqrt(low * high))
        problem = _raised(unreachable.problem.on(found.basis), bounds, at)
        found = exchange(
            problem,
            found.x,
            tolerance=0.3 * _EXACT,
            interior=_padded(unreachable.within, problem.basis.size),
            enough=lambda objective, _: objective < 1.0 - 1e-3,
        )
    return low if np.isfinite(high) else None


def _raised(problem: Problem, bounds: Mapping[int, float], factor: float) -> Problem:
    limits = list(problem.limits)
    for index, bound in bounds.items():
        limits[index] = replace(limits[index], bound=factor * bound)
    return replace(problem, limits=tuple(limits), finer=None)


def _padded(x: Array | None, size: int) -> Array | None:
    return None if x is None else np.pad(x, (0, size - x.size))
