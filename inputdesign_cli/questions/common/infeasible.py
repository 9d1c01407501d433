"""Reasons why nothing meets the requirements within the limits, or no record was found, and the remedies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.compute.time_limit import OutOfTimeError, time_for_hints
from inputdesign_cli.design.convex.demands import Asked, Question
from inputdesign_cli.design.convex.designs import solve_design
from inputdesign_cli.design.convex.exchange import ExchangeResult, exchange
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.errors import Diagnostic, InfeasibleError
from inputdesign_cli.outcome.shares import rounded_down, rounded_up
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.spectrum import LinesBasis

_TOLERANCE, _EXACT = 1e-5, 1e-6
_ROOM = 1.0 + 1e-4  # margin with which a remedy meets the accuracy
_STEPS = 30
_LONGEST_STEP, _MOST = 1e3, 1e9
_NO_SHARE = 1e-5
# A limit takes part in the conflict if its weight in the proof exceeds this share of the largest.
_TAKES_PART = 1e-4
_MOST_PLACES = 3


@dataclass(frozen=True)
class Reach:
    """Describes the reach of spectra: whether all of them have a bound, and whether it is attained.

    Where it is only approached, at ends of the `band` of all spectra, the band stays off them by a margin
    within the tolerance. `note` explains that to the reader of a result; None if there is nothing to explain.
    """

    bounded: bool = True
    attained: bool = True
    band: tuple[float, float] | None = None
    note: str | None = None


@dataclass(frozen=True)
class StatedBound:
    """Holds a bound of the spec: errors `factor` times as large take value * factor ** `power`.

    A `fraction` is shown in per cent.
    """

    key: str
    label: str
    value: float
    power: int = 1
    fraction: bool = False

    def loosened(self, factor: float) -> float:
        """Return the number to state in the spec for an error `factor` times as large."""
        return self.value * factor**self.power

    def shown(self, value: float) -> str:
        """Return a number for a sentence, rounded towards less accuracy: what is printed can be met."""
        number = 100.0 * value if self.fraction else value
        return f"{rounded_up(number, 4) if self.power > 0 else rounded_down(number, 4)}" + (
            " %" if self.fraction else ""
        )


@dataclass(frozen=True)
class Bought:
    """Holds the best accuracy within limits: `nearest` solves the `problem`, of the goal "factor".

    The `stated` numbers are loosened by one factor; there are none if no number of the spec scales errors.
    """

    units: Units
    stated: Sequence[StatedBound]
    limits: Sequence[PowerLimit]
    problem: Problem
    nearest: ExchangeResult

    @property
    def factor(self) -> float:
        """Return the least common factor on all admitted errors that makes them feasible."""
        return float(np.sqrt(self.nearest.objective))

    @property
    def sentence(self) -> str:
        """Return the accuracy within the limits and where it is worst, as a sentence."""
        if self.stated:
            buys = " and ".join(
                f"{one.label} {one.shown(one.loosened(self.factor))} (asked: {one.shown(one.value)})"
                for one in self.stated
            )
        else:
            buys = f"standard deviations {rounded_up(self.factor, 4)} times as large as it takes"
        places = list[str]()
        for asked, w in self._binding:
            entry = self._entry(asked)
            parts = (f"in entry {entry}" if entry else "", "" if w is None else f"at {self.units.named(w)}")
            places += filter(None, [" ".join(filter(None, parts))])
        shown = list(dict.fromkeys(places))
        more = ", .." if len(shown) > _MOST_PLACES else ""
        worst = f", worst {' and '.join(shown[:_MOST_PLACES])}{more}" if shown else ""
        return f"the limits buy {buys}{worst}"

    @property
    def details(self) -> dict[str, object]:
        """Return the best accuracy within the limits as data, with frequencies in the user's unit."""
        worst = []
        for asked, w in self._binding:
            requirement, entry, at = asked.requirement, self._entry(asked), np.array([w or 0.0])
            ratio = float(requirement.ratios(self.nearest.informations[asked.scenario], at)[0])
            item: dict[str, object] = {"name": requirement.name, "worst_ratio": ratio}
            item |= {"entry": entry} if entry else {}
            worst.append(item | ({} if w is None else {"frequency": w / self.units.frequency}))
        return {
            "factor": self.factor,
            "factor_bound": float(np.sqrt(max(self.nearest.certificate.bound, 1.0))),
            "bought": [
                {"key": bound.key, "asked": bound.value, "bought": bound.loosened(self.factor)}
                for bound in self.stated
            ],
            "worst": worst,
            "limits": [
                {
                    "name": limit.key.removeprefix("limits."),
                    **({} if limit.channel is None else {"channel": limit.channel + 1}),
                    "max" if limit.upper else "min": limit.bound,
                    "share": share,
                }
                for limit, share in self.shares
            ],
        }

    @property
    def shares(self) -> list[tuple[PowerLimit, float]]:
        """Return each limit of the spec with its share of the multipliers of the proof."""
        listed = self.problem.limits
        weights = self.nearest.certificate.limits * np.array([limit.bound for limit in listed])
        least = _TAKES_PART * max(weights.max(initial=0.0), 1e-300)
        stated = listed[: len(self.limits)]
        known = [(limit, float(weights[limit.everywhere(listed)].sum())) for limit in stated]
        return [(limit, share) for limit, share in known if share > least]

    @property
    def _binding(self) -> list[tuple[Asked, float | None]]:
        """Return the requirements that bind and where, the largest multiplier first."""
        return [(self.problem.demands.asked[index], w) for index, w in self.nearest.active]

    def _entry(self, asked: Asked) -> str:
        """Return the entry of G that a requirement is about; empty of a single one."""
        entry = asked.requirement.entry
        return "" if entry is None or self.units.single else self.units.entry(*entry)


def named(limit: PowerLimit) -> str:
    """Return the quantity that a limit bounds, for a sentence: input 2 power, or power of the moves of it."""
    number = "" if limit.channel is None else f" {limit.channel + 1}"
    return f"power of the moves of input{number}" if limit.kind == "moves" else f"{limit.kind}{number} power"


def explain(
    units: Units, question: Question, unreachable: UnreachableError, stated: Sequence[StatedBound]
) -> InfeasibleError:
    """Return the error with the proof of the failure, by numbers of the spec that can be loosened."""
    problem, nearest = unreachable.problem, unreachable.nearest
    bought = Bought(units, stated, question.limits, problem, nearest)
    involved = [limit for limit, _ in bought.shares]
    if unreachable.limits_alone:
        times = f"{nearest.certificate.bound:.4g} times as large for the lower ones to be reached"
        why = f"contradict each other: the upper ones would have to be {times}"
        return contradictory(sorted(involved, key=lambda limit: limit.upper), why)
    missed = (problem.demands.asked[index].requirement for index, _ in nearest.active)
    names = " and ".join(dict.fromkeys(requirement.name for requirement in missed))
    parts = [f"{names} cannot be met within the limits: {bought.sentence}"]
    remedies = [
        "raise the limit, or loosen the accuracy: a spectrum can keep errors "
        f"{rounded_up(bought.factor * _ROOM, 4)} times as large as asked, a record somewhat larger ones"
    ]
    if question.goal == "cost" and question.experiment.prior is None and np.isfinite(nearest.objective):
        # Within the same limits information grows in proportion to the length.
        longer = int(np.ceil(question.experiment.samples * nearest.objective))
        enough = units.length(longer)
        remedies.append(f"with {enough} a spectrum can, and a record with somewhat more")
    try:  # infeasibility is proved already, and the rest is optional
        with time_for_hints():
            parts += _what_would_do(unreachable, question, involved)
            remedies += ["spectrum: {type: free} can meet it"] if _within_reach_of_any(question) else []
    except OutOfTimeError:
        remedies.append("what else would do was not looked for further")
    if problem.densities and question.limits:
        remedies.append("limits.spectrum takes part")
    key = involved[0].key if involved else "limits"
    return InfeasibleError(
        Diagnostic("infeasible", "; ".join(parts), "; ".join(remedies), key, details=bought.details)
    )


def _what_would_do(
    unreachable: UnreachableError, question: Question, involved: Sequence[PowerLimit]
) -> list[str]:
    """Return sentences on the exhausted limits, and the value each would need with the others kept."""
    parts, alone = list[str](), False
    for limit in involved:
        factor = needed_factor(unreachable, [limit]) if limit.upper else None
        if factor is not None:
            alone, least = True, factor * limit.bound
            needs, peak = f"needs {named(limit)} >= {rounded_up(least)}", np.sqrt(limit.bound)
            if limit.implied:
                needs += (
                    f", so {limit.of_samples} of {rounded_up(float(np.sqrt(least)))} at least; the limit, "
                )
                needs += f"{limit.of_samples} of {peak:.6g}, allows {limit.bound:.6g}"
            else:
                needs += f", limit is {limit.bound:.6g}"
            parts.append(needs)
        elif limit.upper:
            parts.insert(0, f"the {named(limit)} is exhausted")
    return parts if alone else [*parts, _together(unreachable, question)]


def _together(unreachable: UnreachableError, question: Question) -> str:
    """Return a sentence with the factor on all upper limits; its square root if they bound samples."""
    raised = [limit for limit in question.limits if limit.upper]
    densities = [density.key for density in question.densities if density.upper]
    # The optimum of the goal "factor" meets the accuracy if limits and densities are multiplied by it.
    factor = unreachable.nearest.objective if densities else needed_factor(unreachable, raised)
    if factor is None:
        return "no change of the upper limits is enough"
    own = {limit.key: float(np.sqrt(factor)) if limit.implied else factor for limit in raised}
    own |= dict.fromkeys(densities, factor)
    times = " and ".join(f"{key} would have to be {rounded_up(each)} times" for key, each in own.items())
    alone = "no change of a single limit is enough; " if raised else ""
    more = ", and larger for a record" if any(limit.implied for limit in raised) else ""
    return f"{alone}{times} as large{more}"


def _within_reach_of_any(question: Question) -> bool:
    """Return whether some spectrum of another type meets the requirements (without densities)."""
    if question.densities or question.basis.free:
        return False
    experiment = question.experiment
    anything = LinesBasis.anywhere(*experiment.band, experiment.inputs)
    try:
        solve_design(replace(question, basis=anything), tolerance=_TOLERANCE)
    except (UnreachableError, np.linalg.LinAlgError):
        return False
    return True


def contradictory(limits: Sequence[PowerLimit], why: str) -> InfeasibleError:
    """Return the error that no spectrum keeps to these limits, whatever is asked."""
    names = ", ".join(dict.fromkeys(limit.key for limit in limits)) or "limits.spectrum"
    key = limits[0].key if limits else "limits"
    return InfeasibleError.because(
        "contradictory-limits", f"{names} {why}", "lower min of these limits, or raise max", key
    )


def needed_factor(unreachable: UnreachableError, limits: Sequence[PowerLimit]) -> float | None:
    """Return the least factor on these limits together that allows the accuracy; None if none does.

    The dual variables of the limits are derivatives of the squared best ratio, for Newton's method in
    logarithms. The squared ratio itself is not the factor, since the information of noise or of a prior does
    not grow with the powers.
    """
    stated = unreachable.problem.limits
    bounds = {place: limit.bound for limit in limits for place in limit.everywhere(stated)}
    places, found, at = list(bounds), unreachable.nearest, 1.0
    for _ in range(_STEPS):
        # The proved bound where the limits are too tight, and the attained value where they are not.
        ratio = max(found.certificate.bound, min(found.objective, 1.0))
        if abs(ratio - 1.0) <= _EXACT:
            return at
        share = float(found.certificate.limits[places] @ np.array(list(bounds.values()))) * at
        if share < _NO_SHARE or at > _MOST:
            return None
        at *= float(np.exp(min(np.log(ratio) / share, np.log(_LONGEST_STEP))))
        problem, within = unreachable.problem.on(found.basis), unreachable.within
        raised = list(problem.limits)
        for index, bound in bounds.items():
            raised[index] = replace(raised[index], bound=at * bound)
        problem = replace(problem, limits=tuple(raised), finer=None)
        if within is not None:
            within = np.pad(within, (0, problem.basis.size - within.size))
        found = exchange(problem, found.x, tolerance=0.3 * _EXACT, interior=within)
    return None
