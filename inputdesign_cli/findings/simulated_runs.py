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
    asked, found = None if designed is None else designed.asked, []
    for of, coverage in (("of this design", designed), ("with this record", recorded)):
        if asked is None or coverage is None or coverage.kept_limits is None or coverage.kept is None:
            continue
        fact = f"{100 * coverage.kept:.1f} % of {coverage.runs} {of}, of {100 * asked:g} % asked"
        missed = coverage.kept_limits[1] < asked
        found += CONFIDENCE_MISSED.when(missed, fact, where=of, kept=coverage.kept, asked=asked)
    return found


def runs_miss_confidence(designed: Coverage | None, tried: TriedInput) -> list[Finding]:
    """Return a finding if runs of the design keep less than the exact confidence that was asked for."""
    limits, kept = tried.within_r_adm_limits, tried.within_r_adm
    asked = None if designed is None else designed.asked
    if designed is None or asked is None or limits is None or kept is None:
        return []
    fact = f"{100 * kept:.1f} % of the runs stay within r_adm, where exact: {asked:g} was asked for"
    calibrated = designed.runs is not None
    remedy = "" if calibrated else "Leave out runs: 0, ask for a little more, or take more samples."
    missed = tried.on_design_model is None and limits[1] < asked
    return CONFIDENCE_MISSED.when(missed, fact, where="simulation", remedy=remedy, kept=kept, asked=asked)


@finding(NOTE, "other-length", "Nothing. The runs are compared with predictions for the simulated length.")
def other_length(kind: FindingKind, counted: int, simulated: int) -> list[Finding]:
    """The simulated records and the design differ in length. Records may consist of whole periods."""
    fact = (
        f"the design counts {counted} sample{'s' * (counted != 1)}, the records have {simulated}. Runs and "
        f"ellipses.png are for {simulated}, bound.csv for {counted}"
    )
    differ = counted != simulated
    return kind.when(differ, fact, where="simulation", counted=counted, simulated=simulated)


@finding(DOUBT, "initial-estimate-off", "Design at a better estimate, or for several plants (`uncertainty`).")
def initial_estimate_off(kind: FindingKind, units: Units, inputs: Mapping[str, TriedInput]) -> list[Finding]:
    """The true system is not the design model. Fewer runs stay within r_adm than at the design model."""
    for name, entry in inputs.items():
        modelled = None if entry.on_design_model is None else entry.on_design_model.within_r_adm
        found, theory, violations = entry.within_r_adm, entry.theory_on_truth, entry.violations
        if modelled is None or found is None or modelled - found < _GAP:
            continue
        fact = f"{name.replace('_', ' ')}: {100 * found:.0f} % of the runs, not {100 * modelled:.0f} %"
        if theory is not None:
            fact += f". r_u reaches {theory.worst_ratio:.2f} r_adm at {theory.frequency:.3g} {units.per_time}"
        if violations is not None:
            low, middle, high = violations.frequency_quantiles
            fact += f". 9 in 10 violations lie at {low:.3g} to {high:.3g}, median {middle:.3g}"
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
