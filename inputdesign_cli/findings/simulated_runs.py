"""Simulated experiments keep less, or are about something else, than the design counts."""

from __future__ import annotations

from collections.abc import Mapping

from inputdesign_cli.finding import DOUBT, NOTE, Finding, FindingKind, doubt, finding
from inputdesign_cli.outcome.design import Coverage
from inputdesign_cli.outcome.simulation import Searched, TriedInput
from inputdesign_cli.outcome.units import Units

# A fraction on the true system this far below that on the design model is worth a note.
_GAP = 0.03

CONFIDENCE_MISSED = doubt(
    "confidence-missed",
    "Too few experiments stay within the admissible error. The share of simulated runs within r_adm is "
    "below the exact confidence by more than chance.",
    "Ask for more `runs` in `confidence`, or for more samples.",
)


def confidence_missed(designed: Coverage | None, recorded: Coverage | None) -> list[Finding]:
    """Return findings where a design, or its record, keeps less than was asked, by more than chance."""
    asked = None if designed is None else designed.asked
    each = [("this design", designed), ("this record", recorded)]
    return [
        one
        for of, coverage in each
        if coverage is not None
        for one in _missed(of, coverage.kept, coverage.kept_limits, asked)
    ]


def runs_miss_confidence(designed: Coverage | None, tried: TriedInput) -> list[Finding]:
    """Return a finding if runs of the design keep less than the exact confidence that was asked for."""
    asked = None if designed is None or tried.on_design_model is not None else designed.asked
    return _missed("simulation", tried.within_r_adm, tried.within_r_adm_limits, asked)


def _missed(
    of: str, kept: float | None, limits: tuple[float, float] | None, asked: float | None
) -> list[Finding]:
    if asked is None or kept is None or limits is None:
        return []
    fact = f"{of} has {100 * kept:.1f} %, where {100 * asked:g} % was asked for"
    return CONFIDENCE_MISSED.when(limits[1] < asked, fact, where=of, kept=kept, asked=asked)


@finding(NOTE, "other-length", "Nothing. The runs are compared with predictions for the simulated length.")
def other_length(kind: FindingKind, counted: int, simulated: int) -> list[Finding]:
    """The simulated records and the design differ in length. Records may consist of whole periods."""
    fact = f"samples of the design {counted}, of the runs {simulated}. bound.csv is for the former"
    differ = counted != simulated
    return kind.when(differ, fact, where="simulation", counted=counted, simulated=simulated)


@finding(DOUBT, "initial-estimate-off", "Design at a better estimate, or for several plants (`uncertainty`).")
def initial_estimate_off(kind: FindingKind, units: Units, inputs: Mapping[str, TriedInput]) -> list[Finding]:
    """The true system is not the design model. Fewer runs stay within r_adm than at the design model."""
    for name, entry in inputs.items():
        modelled = None if entry.on_design_model is None else entry.on_design_model.within_r_adm
        found, theory = entry.within_r_adm, entry.theory_on_truth
        if modelled is None or found is None or modelled - found < _GAP:
            continue
        fact = f"{name.replace('_', ' ')}: {100 * found:.0f} % of the runs, not {100 * modelled:.0f} %"
        if theory is not None:
            fact += f". r_u reaches {theory.worst_ratio:.2f} r_adm at {theory.frequency:.3g} {units.per_time}"
        return [kind.found(fact, where=name, within=found, on_design_model=modelled)]
    return []


@finding(NOTE, "runs-see-one-minimum", "Excite more frequencies, or fix known parameters (`plant.known`).")
def one_minimum(kind: FindingKind, searched: Searched | None) -> list[Finding]:
    """The runs examine one minimum only. The search of `identify` may end at another minimum."""
    if searched is None:
        return []
    runs, elsewhere, rivals = searched.runs, searched.elsewhere, searched.rivals
    fact = (
        f"with the search of identify {elsewhere} of {runs} records end at other parameters, and {rivals} of "
        f"{runs} would be undecided"
    )
    return [kind.found(fact, where="simulation", runs=runs, elsewhere=elsewhere, rivals=rivals)]


@finding(DOUBT, "unstable-runs", "Take more samples or more power, or ask for a slower loop.")
def unstable_runs(kind: FindingKind, unstable: Mapping[str, int], runs: int) -> list[Finding]:
    """Controllers of some simulated runs destabilise the loop. Means exclude these runs."""
    return [
        kind.found(f"{count} of {runs} with the input {name}", where=name, unstable=count, runs=runs)
        for name, count in unstable.items()
        if count
    ]
