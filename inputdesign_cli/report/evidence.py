"""What data and simulated experiments say, as tables and sentences of a page."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from inputdesign_cli.outcome import Outcome, RequirementMet, Simulation
from inputdesign_cli.outcome.design import LossMoments, TheoreticalLoss
from inputdesign_cli.outcome.estimate import Fit
from inputdesign_cli.outcome.simulation import Limits, Spread, TriedInput
from inputdesign_cli.report.numbers import BREAK, Fact, Rows, listed, shown, spoken

_SPREAD = "{:.4g} ± {:.2g}"
# Below this share of its standard deviation the digits of an estimate say nothing, not even its order.
_NOTHING = 1e-3
_NORMAL = 1.96  # standard deviations to either side of 95 %
_REACHED = 1.0 + 1e-6  # what a record that is rounded to a file may be off


def estimate_table(outcome: Outcome) -> Rows | None:
    """Return the estimated parameters with their standard deviations and 95 % limits."""
    found = outcome.identification
    if found is None or found.theta is None or found.standard_deviation is None:
        return None
    rows = []
    for name, value in found.theta.items():
        spread = found.standard_deviation[name]
        said = "0" if abs(value) < _NOTHING * spread else f"{value:.6g}"
        limits = f"{value - _NORMAL * spread:.4g} to {value + _NORMAL * spread:.4g}"
        rows.append((name, said, f"{spread:.2g}", limits))
    return Rows(("parameter", "estimate", "standard deviation", "95 % limits"), tuple(rows))


def estimate_facts(outcome: Outcome) -> Iterator[Fact]:
    """Yield how well the estimate explains the data."""
    found = outcome.identification
    if found is not None and found.variance is not None:
        value = found.variance
        rows = "" if isinstance(value, float) else "; ".join(map(listed, value))
        yield "noise", f"covariance [{rows}]" if rows else f"variance {value:.5g}", ""
    fit = None if found is None else found.fit_percent
    if fit is not None:
        several = "" if isinstance(fit, float) else "s"
        yield "fit", f"simulation explains {_per_cent(fit)} of the output{several}", ""
    unseen = outcome.validation
    if unseen is not None:
        simulated = f"simulation explains {_per_cent(unseen.simulation_fit_percent)}"
        predicted = f"one-step prediction {_per_cent(unseen.prediction_fit_percent)}"
        yield "validated", f"{simulated}, {predicted} of {_judging(outcome)}", ""
    tests = {} if found is None else {"whiteness": found.whiteness, "independence": found.independence}
    named = [f"{name} {test.probability:.2g}" for name, test in tests.items() if test is not None]
    if named:
        yield "residuals", f"probability of {', of '.join(named)}", ""


def _judging(outcome: Outcome) -> str:
    """Say which data validate: all of them for a given model, or the part that an estimate did not use."""
    if outcome.exploration is None:
        return "these data"
    if outcome.exploration.split == "none":
        return "the data that it is estimated from"
    return "one part, estimated from the other alone (the parameters above: from the whole record)"


def _per_cent(fit: Fit) -> str:
    """The fit of one output, or of each; a dash where a model cannot be simulated."""
    each = (fit,) if fit is None or isinstance(fit, float) else fit
    return " and ".join("-" if value is None else f"{value:.1f}" for value in each) + " %"


def estimate_answer(outcome: Outcome) -> str:
    """Return what the data amount to, in sentences."""
    if outcome.assessment is not None:
        return " ".join(f"{text[0].upper()}{text[1:]}." for text in verdict(outcome))
    found, response = outcome.identification, outcome.frequency_response
    if response is not None and (found is None or found.theta is None):
        return f"The frequency response was measured at {response.frequencies} frequencies."
    said = f"The model was estimated from {outcome.samples} samples"
    fit = None if found is None else found.fit_percent
    if fit is not None:
        said += f"; simulated from the input alone, it explains {_per_cent(fit)} of these data"
    explored, unseen = outcome.exploration, outcome.validation
    if unseen is None or (explored is not None and explored.split == "none"):
        return f"{said}."
    explains = f"explains {_per_cent(unseen.simulation_fit_percent)} of the other"
    return f"{said}. The same structure, estimated from one part of them alone, {explains}."


# Why data leave a verdict open, by `assessment.causes`.
_UNDECIDED = {
    "unsettled": "the search for the parameters did not settle",
    "contradicted": "the data contradict the model",
    "unasked": "what is asked cannot be asked of this estimate",
    "undetermined": "the data do not determine the model: other parameters explain them nearly as well",
    "chance": "chance may stand behind what was measured",
    "nonlinearity": "the plant is not linear enough for what is asked",
    "drift": "outputs drift, and that was not taken away",
    "spikes": "a few samples decide what the data say",
}


def verdict(outcome: Outcome) -> Iterator[str]:
    """Yield what an assessment comes to, and what is left to do."""
    assessment = outcome.assessment
    if assessment is None or outcome.status == "running":
        return
    if assessment.verdict == "undecided":
        causes = "; ".join(_UNDECIDED[cause] for cause in assessment.causes or ())
        yield f"undecided, neither met nor missed: {causes}; the notes say what to change"
        return
    worst = max(assessment.requirements, key=lambda entry: entry.worst_ratio)
    if assessment.met:
        yield f"these data meet the accuracy: {_reached(worst)} of what is admitted"
        return
    yield f"these data miss the accuracy: {_reached(worst)} times what is admitted"
    if assessment.left is None:
        if assessment.no_top_up is not None:
            yield f"no experiment is designed: {assessment.no_top_up}"
        return
    right = f" if the structure of the model is right{_from_rest(outcome)}"
    if assessment.left > _REACHED:
        number = assessment.experiments
        repeat = "" if number is None else f"apply it {number} times, "
        yield (
            "the experiment below is the best within the limits for the model of these data, and after it "
            f"the error is still {assessment.left:.4g} times what is admitted{right}: {repeat}widen "
            "the limits, or loosen the target"
        )
    else:
        yield (
            "the experiment below is what the model of these data still needs: after both the error is "
            f"{assessment.left:.4g} of what is admitted{right}; assess both records together"
        )
    worst_open = max(assessment.neglected or (), key=lambda entry: entry.may_move, default=None)
    if worst_open is not None and worst_open.may_move > 1.0:
        yield (
            f"that structure is open: one more parameter ({worst_open.parameter}), which these data do not "
            f"rule out, may move G by up to {worst_open.may_move:.3g} times what is admitted (95 %)"
        )


def _from_rest(outcome: Outcome) -> str:
    """Say that a record relies on its start from rest, where it does."""
    details = {} if outcome.signal is None else outcome.signal.details
    if "begun_anywhere" not in details:
        return ""
    growth = details["begun_anywhere"]
    otherwise = "nothing is promised" if growth is None else f"{growth:.3g} times as much"
    return f" and the record begins at rest, its levels known (--operating-point; else {otherwise})"


def requirement_table(outcome: Outcome, time_unit: str) -> Rows | None:
    """Return each requirement with the ratio that the data reach."""
    assessment = outcome.assessment
    if assessment is None or not assessment.requirements:
        return None
    unclear = "undecided" if assessment.verdict == "undecided" else ""
    rows = tuple(
        (
            _named(entry),
            f"{entry.worst_ratio:.4g}",
            "" if entry.frequency is None else f"{entry.frequency:.4g}",
            unclear or ("met" if entry.worst_ratio <= 1.0 + 1e-9 else "missed"),
        )
        for entry in assessment.requirements
    )
    return Rows(("requirement", "of what is admitted", f"at (rad/{time_unit})", "verdict"), rows)


def campaign_facts(outcome: Outcome) -> Iterator[tuple[str, str]]:
    """Yield how a campaign stands: its parts so far, what has been reached, and what comes next."""
    campaign = outcome.campaign
    if campaign is None or not campaign.rounds:
        return
    now, parts = campaign.rounds[-1], len(campaign.records)
    state = {
        "running": "goes on",
        "stopped": "has ended: the data meet what is asked",
        "missed": "has ended without meeting what is asked",
        "undecided": "has ended undecided: see the notes",
    }[campaign.state]
    yield "campaign", f"{state}, after {parts} part{'' if parts == 1 else 's'} and {now.samples} samples"
    gone = [str(n) for n, record in enumerate(campaign.records, start=1) if record.withdrawn]
    if gone:
        yield "", f"withdrawn: record {', '.join(gone)}"
    if now.worst_ratio is not None:
        yield "reached", f"{now.worst_ratio:.4g} of what is admitted, at the estimate"
    plan = now.plan
    if plan is not None:
        whole = plan.planned_samples
        first = f", the first of {whole} that are planned with {plan.power:.4g}"
        of = first if whole is not None and whole > plan.samples else ""
        power = plan.power if plan.part_power is None else plan.part_power
        yield "next", f"apply {plan.samples} samples of power {power:.4g} (signal.csv{of})"


def campaign_answer(outcome: Outcome) -> str:
    """Return how a campaign stands, in sentences."""
    state, *others = campaign_facts(outcome)
    more = (f"{name.capitalize()}: {text}." for name, text in others if name)
    return " ".join([f"The campaign {state[1]}.", *more])


def simulation_answer(outcome: Outcome) -> Iterator[str]:
    """Yield how many simulated experiments stay within r_adm, in a sentence."""
    found = outcome.simulation
    entry = None if found is None else found.inputs.get("design")
    if found is None or entry is None or entry.within_r_adm is None or entry.within_r_adm_limits is None:
        return
    low, high = (100 * limit for limit in entry.within_r_adm_limits)
    yield (
        f"In {found.runs} simulated experiments {100 * entry.within_r_adm:.1f} % of the models stayed "
        f"within r_adm at every frequency (95 % limits {low:.1f} to {high:.1f})."
    )


_COLUMNS: dict[str, Callable[[TriedInput], str]] = {
    "loss": lambda one: _spread(one.loss),
    "mean squared error": lambda one: (
        "" if one.mse is None else _SPREAD.format(one.mse, one.mse_standard_error or 0.0)
    ),
    "theory": lambda one: _theory(one),
    "mean estimate": lambda one: (
        listed(one.mean_estimate) if one.mse is not None and isinstance(one.mean_estimate, np.ndarray) else ""
    ),
    "deviations over theory": lambda one: _range(one),
    "worst over admitted": lambda one: "" if one.worst_ratio is None else shown(one.worst_ratio),
    "within r_adm": lambda one: _share(
        one.within_r_adm, one.within_r_adm_limits, one.within_r_adm_true is None
    ),
    "errors within r_adm of the plant of the spec": lambda one: _share(
        one.within_r_adm, one.within_r_adm_limits, one.within_r_adm_true is not None
    ),
    "were the design model true": lambda one: (
        ""
        if one.on_design_model is None
        else _share(one.on_design_model.within_r_adm, one.on_design_model.within_r_adm_limits)
    ),
    "within r_u": lambda one: _share(one.within_r_u, one.within_r_u_limits),
    "cost": lambda one: "" if one.cost is None else f"{one.cost:.5g}",
    "errors within r_adm of the true plant": lambda one: _share(
        one.within_r_adm_true, one.within_r_adm_true_limits
    ),
    "over the spectrum that knows the plant": lambda one: _mean_and_tail(one.cost_over_oracle),
    "over the record of that": lambda one: _mean_and_tail(one.cost_over_oracle_record),
    "true ratio": lambda one: _mean_and_tail(one.true_ratio),
    "samples": lambda one: "" if one.samples is None else f"{one.samples.mean:.0f}",
    "ended": lambda one: ", ".join(f"{number} {way}" for way, number in _endings(one).items() if number),
    "unstable loops": lambda one: str(one.unstable or ""),
    "not settled": lambda one: str(one.not_converged or ""),
}


def simulation_table(found: Simulation | None) -> Rows | None:
    """Return one row for each input that was tried; None without a simulation."""
    if found is None:
        return None
    cells = {name: [cell(entry) for entry in found.inputs.values()] for name, cell in _COLUMNS.items()}
    filled = {name: column for name, column in cells.items() if any(column)}
    if not filled:
        return None
    each = zip(map(spoken, found.inputs), *filled.values(), strict=True)
    return Rows(("input", *filled), tuple(each))


def _named(entry: RequirementMet) -> str:
    return " ".join(filter(None, (spoken(entry.name), entry.entry)))


def _reached(entry: RequirementMet) -> str:
    return f"{_named(entry)} reaches {entry.worst_ratio:.4g}"


def _share(value: float | None, limits: Limits | None, wanted: bool = True) -> str:
    if value is None or limits is None or not wanted:
        return ""
    low, high = (100 * limit for limit in limits)
    return f"{100 * value:.1f} %{BREAK}95 % limits {low:.1f} to {high:.1f}"


def _range(entry: TriedInput) -> str:
    if entry.deviation_ratio is None or entry.chance is None:
        return ""
    low, high = entry.chance
    found = entry.deviation_ratio
    return f"{found.least:.4g} to {found.largest:.4g}{BREAK}chance {low:.3g} to {high:.3g}"


def _mean_and_tail(found: Spread | None) -> str:
    return "" if found is None else f"{found.mean:.3g}{BREAK}95 % below {found.quantile_95:.3g}"


def _endings(entry: TriedInput) -> dict[str, int | None]:
    ways = {"stopped": entry.stopped, "missed": entry.missed, "undecided": entry.undecided}
    return ways | {"unplanned": entry.unplanned}


def _spread(found: LossMoments | None) -> str:
    return "" if found is None else _SPREAD.format(found.mean, found.sd)


def _theory(entry: TriedInput) -> str:
    if entry.theory is None:
        return ""
    return (
        _spread(entry.theory.loss) if isinstance(entry.theory, TheoreticalLoss) else shown(entry.theory.mse)
    )
