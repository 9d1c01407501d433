"""Simulated experiments keep less, or are about something else, than the design counts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from inputdesign_cli.finding import Finding, doubt, note
from inputdesign_cli.outcome.design import Coverage
from inputdesign_cli.outcome.simulation import Searched, TriedInput
from inputdesign_cli.outcome.units import Units

# A fraction on the true system this far below that on the design model is worth a note.
_GAP = 0.03

CONFIDENCE_MISSED = doubt(
    "confidence-missed",
    "Too few experiments keep the admissible error. The share of simulated experiments within r_adm is "
    "below the exact confidence by more than chance.",
    "Ask for more `runs` in `confidence`, or for more samples.",
)
OTHER_LENGTH = note(
    "other-length",
    "The simulated records and the design differ in length. The design counts the samples of a spectrum. "
    "Records have whole periods, or are longer because of limits.",
    "Nothing. The runs are compared with predictions for the simulated length.",
)
INITIAL_ESTIMATE = doubt(
    "initial-estimate-off",
    "The true system is not the design model. Fewer runs stay within r_adm than if the true system were the "
    "design model.",
    "Design again at a better estimate, or for several plants (`uncertainty`).",
)
ONE_MINIMUM = note(
    "runs-see-one-minimum",
    "The runs examine one minimum only. Runs of `simulate` start their estimates at the nominal parameters. "
    "The likelihood has other minima, where the search of `identify` may end.",
    "Excite more frequencies, or fix known parameters (`plant.known`).",
)
UNSTABLE = doubt(
    "unstable-runs",
    "Controllers of some simulated runs destabilise the loop. Each run designs a controller from its "
    "estimate. Means exclude runs with an unstable true loop, whose loss is infinite.",
    "Take more samples or more power, or ask for a slower loop.",
)


def confidence_missed(designed: Coverage | None, recorded: Coverage | None) -> Iterator[Finding]:
    """Yield findings where a design, or its record, keeps less than was asked, by more than chance."""
    asked = None if designed is None else designed.asked
    for of, coverage in (("of this design", designed), ("with this record", recorded)):
        if asked is None or coverage is None or coverage.kept_limits is None or coverage.kept is None:
            continue
        message = (
            f"{100 * coverage.kept:.1f} % of {coverage.runs} simulated experiments {of} keep r_adm: by more "
            f"than chance that is fewer than the {100 * asked:g} % that are asked for; ask for more runs "
            "(confidence: {exact: .., runs: ..}), which settle alpha more sharply"
        )
        if coverage.kept_limits[1] < asked:
            yield CONFIDENCE_MISSED.found(message, where=of, kept=coverage.kept, asked=asked)


def runs_miss_confidence(designed: Coverage | None, tried: TriedInput) -> list[Finding]:
    """Return a finding if runs of the design keep less than the exact confidence that was asked for."""
    limits, kept = tried.within_r_adm_limits, tried.within_r_adm
    asked = None if designed is None else designed.asked
    if designed is None or asked is None or limits is None or kept is None:
        return []
    why = (
        "alpha was calibrated by simulated experiments, and chance had a part in it: ask for more of them "
        "(runs)"
        if designed.runs is not None
        else "estimates of records this short scatter more than the asymptotic theory that sizes r_u: leave "
        "out runs: 0, ask for a little more, or take more samples"
    )
    message = f"{100 * kept:.1f} % of the runs stay within r_adm, where exact: {asked:g} was asked for: {why}"
    found = CONFIDENCE_MISSED.found(message, where="simulation", kept=kept, asked=asked)
    return [] if tried.on_design_model is not None or limits[1] >= asked else [found]


def other_length(counted: int, simulated: int) -> list[Finding]:
    """Return a finding if records have another number of samples than the design counts."""
    message = (
        f"simulation: the design counts {counted} sample{'s' * (counted != 1)}, the simulated records have "
        f"{simulated}. What the runs are compared with, and ellipses.png, are for {simulated} samples; "
        f"bound.csv is for {counted}"
    )
    found = OTHER_LENGTH.found(message, where="simulation", counted=counted, simulated=simulated)
    return [found] if counted != simulated else []


def initial_estimate_off(units: Units, inputs: Mapping[str, TriedInput]) -> list[Finding]:
    """Return a finding for the first input whose runs keep less on the true than on the design model."""
    for name, entry in inputs.items():
        modelled = None if entry.on_design_model is None else entry.on_design_model.within_r_adm
        found, theory, violations = entry.within_r_adm, entry.theory_on_truth, entry.violations
        if modelled is None or found is None or modelled - found < _GAP:
            continue
        text = (
            f"{name.replace('_', ' ')}: {100 * found:.0f} % of the runs stay within r_adm on the true "
            f"system, but {100 * modelled:.0f} % where the true system is the design model: the experiment "
            "was designed on an initial estimate that is not the truth"
        )
        if theory is not None:
            at = f"{theory.frequency:.3g} {units.per_time}"
            text += f". On the true system r_u reaches {theory.worst_ratio:.2f} r_adm (at {at})"
        if violations is not None:
            low, middle, high = violations.frequency_quantiles
            text += (
                f"; 9 in 10 violations lie at {low:.3g} to {high:.3g} {units.per_time}, median {middle:.3g}"
            )
        return [INITIAL_ESTIMATE.found(text, where=name, within=found, on_design_model=modelled)]
    return []


def one_minimum(searched: Searched | None) -> list[Finding]:
    """Return the finding that the runs see one minimum, where records leave others."""
    if searched is None:
        return []
    runs, elsewhere, rivals = searched.runs, searched.elsewhere, searched.rivals
    message = (
        "the runs of simulate begin their estimates at the nominal parameters, and see the minimum there "
        f"alone: with the search of identify {elsewhere} of {runs} records end at other parameters, and "
        f"{rivals} of {runs} would be undecided"
    )
    return [ONE_MINIMUM.found(message, where="simulation", runs=runs, elsewhere=elsewhere, rivals=rivals)]


def unstable_runs(unstable: Mapping[str, int], runs: int) -> Iterator[Finding]:
    """Yield a finding for each input with unstable runs."""
    for name, count in unstable.items():
        message = (
            f"with the input {name}, {count} of {runs} simulated controllers make the true loop unstable. "
            "Their losses are infinite, and the means are taken over the other runs"
        )
        if count:
            yield UNSTABLE.found(message, where=name, unstable=count, runs=runs)
