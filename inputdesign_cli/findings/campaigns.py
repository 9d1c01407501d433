"""The parts of a campaign: their records, the estimate from them, and the next plan."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from inputdesign_cli.finding import DOUBT, NOTE, REFUTED, Finding, FindingKind, doubt, finding, note
from inputdesign_cli.findings.places import argument

PART_REPEATED = doubt(
    "part-repeated",
    "An earlier part was applied again. The record follows another plan better than the current one. It was "
    "accepted by `--as-applied`.",
    "If it was given by mistake, withdraw it with `--withdraw`: samples must not count twice.",
)
RECORD_UNLIKE_PLAN = doubt(
    "record-unlike-plan",
    "A record does not follow its plan, or only in part. Their correlation is below 0.9, perhaps by lost "
    "samples, clipping or rounding. Estimates use the recorded signals.",
    "Compare the record with the plan. If it was given by mistake, withdraw it with `--withdraw`.",
)
RECORD_SCALED = note(
    "record-scaled",
    "A part was applied at another scale than planned. It was accepted by `--as-applied`. Estimates use the "
    "recorded signals.",
    "If a column has the wrong unit, withdraw the record (`--withdraw`) and correct it.",
)
PART_WITHOUT_DESIGN = note(
    "part-without-design",
    "The next part is white noise. At the present estimate no experiment meets the requirements. The noise "
    "costs as much as the first plan, or the pilot.",
    "Apply the part. If it happens again, check the model structure and the limits.",
)
PLAN_CAPPED = note(
    "plan-capped",
    "The plan misses the required accuracy. A sample may cost at most `campaign.power_cap` (default 10) "
    "times a sample of the first plan. The campaign ends after `campaign.max_samples`.",
    "Raise `campaign.power_cap`, `campaign.max_samples` or a limit, or ask for less accuracy.",
)
PART_SCALED = note(
    "part-scaled",
    "The next part is weaker than its plan. Otherwise a sample would cost more than `campaign.power_cap`, "
    "at the estimate or at the plant of the spec.",
    "Raise `campaign.power_cap` if the plant can bear it.",
)
EARLIER_PARTS_COST = note(
    "earlier-parts-cost",
    "Earlier parts make the next one expensive. The plant still responds to them. A sample then costs more "
    "than `campaign.power_cap` allows.",
    "Wait until the plant is at rest, or accept the cost.",
)
PART_NOT_ROBUST = note(
    "part-not-robust",
    "The last part is planned for the estimate alone. For some plant that the data do not exclude, no "
    "experiment within `campaign.power_cap` and `limits` is enough.",
    "Raise `campaign.power_cap` or a limit, or write `campaign.last: nominal`.",
)
PART_BETWEEN_MINIMA = note(
    "part-between-minima",
    "The next part separates minima of the likelihood. Other parameters explain the data nearly as "
    "well. The part excites the frequencies at which the two models differ.",
    "Apply the part.",
)
NEARLY = 0.9
"""A part with less than this share of its planned power is reported."""


@finding(NOTE, "record-withdrawn", "Nothing.")
def withdrawn_record(kind: FindingKind, file: str, number: int) -> list[Finding]:
    """A withdrawn record no longer counts. Its samples were applied: length and energy remain spent."""
    return [kind.found(f"record {number} ({file})", where=file, record=number)]


@finding(NOTE, "record-without-excitation", "Record r as well.")
def without_excitation(kind: FindingKind, given: str, plan: str) -> list[Finding]:
    """A record has no column of the reference. Without it no comparison with the plan is possible."""
    return [kind.found(f"{given} cannot be compared with {plan}", where=given, plan=plan)]


@finding(NOTE, "record-shorter", "Nothing, or withdraw it and give the complete record.")
def shorter(kind: FindingKind, given: str, plan: str, samples: int, planned: int) -> list[Finding]:
    """A record ends before its plan. The next plan makes up for the missing samples."""
    fact = f"{given} has {samples} of the {planned} samples of {plan}"
    return kind.when(samples != planned, fact, where=given, plan=plan, samples=samples, planned=planned)


def hardly_followed(
    given: str, plan: str, likeness: float, *, like: float, follows: bool, other: str | None, scale: float
) -> list[Finding]:
    """Return a finding if what was applied is not the plan that was due.

    Args:
        likeness: correlation with the plan; from `like` on a record follows its plan.
        follows: whether the record may be one of the plan.
        other: the file of a plan that the record follows better.
        scale: the factor on the applied plan; 1 if it may be chance.
    """
    fact = f"{given} and {plan} have a correlation of {likeness:.2f}"
    if other is not None:
        found = PART_REPEATED.when(other, f"{fact}, and {given} repeats {other}", where=given)
    elif scale != 1.0 and abs(likeness) > like:
        found = RECORD_SCALED.when(scale, f"{given} is {scale:.4g} times {plan}", where=given)
    else:
        severity = NOTE if follows else DOUBT
        found = RECORD_UNLIKE_PLAN.when(likeness <= like, fact, where=given, severity=severity)
    figures = {"plan": plan, "correlation": likeness, "scale": scale, "other": other}
    return [replace(one, figures=figures) for one in found]


@finding(NOTE, "no-estimate-yet", "Apply the next part.")
def no_estimate_yet(kind: FindingKind, why: str) -> list[Finding]:
    """The records do not determine the model yet. The next part is planned without an estimate."""
    return [kind.found(why, why=why)]


@finding(DOUBT, "estimate-not-used", "Apply the next part. If it recurs, check the records and the model.")
def estimate_not_used(kind: FindingKind, share: float | None, why: str) -> list[Finding]:
    """The next plan does not use the estimate itself. The accuracy cannot be evaluated there.

    The loop may be unstable, for instance. The plan uses a model between the last usable estimate and this
    one.

    Args:
        share: usable part of the way from the last estimate to this one; None if no model on it can be used.
        why: the reason why the accuracy cannot be evaluated at this one; empty if it is the poles.
    """
    fact = why or "its poles are too near to the unit circle, or outside"
    way = "no model" if share is None else f"the model at {100 * share:.0f} %"
    fact = f"{fact}. On the way from the last estimate {way} can be used"
    return kind.when(share != 1.0, fact, share=share, why=why)


@finding(DOUBT, "campaign-doubted", "Check the model structure before you apply more.")
def campaign_doubted(kind: FindingKind) -> list[Finding]:
    """The records cast doubt on the model. The campaign continues; now it would end undecided."""
    return [kind.found("see the other notes. The campaign would end undecided now")]


@finding(REFUTED, "campaign-refuted", "Try `idesign explore`, or `idesign next DIR --regardless`.")
def campaign_refuted(
    kind: FindingKind, directory: Path, samples: int, end: int, records: Sequence[str]
) -> list[Finding]:
    """The campaign ends because the data refute the model. More samples would not help.

    Args:
        samples: number of applied samples, of at most `end`.
        records: the files that count.
    """
    listed = shlex.join(argument(str(directory / name)) for name in records)
    fact = f"see the other notes. {samples} of at most {end} samples were applied"
    remedy = f"Look for another structure with `idesign explore {listed}`, or continue with this one: "
    remedy += f"`idesign next {shlex.quote(argument(str(directory)))} --regardless`."
    where, names = str(directory), list(records)
    return [kind.found(fact, where=where, remedy=remedy, samples=samples, end=end, records=names)]


def planned_otherwise(
    file: str,
    *,
    why: str,
    capped: bool,
    share: float,
    beyond: bool,
    part_cost: float,
    fragile: bool,
    parts: bool = False,
) -> list[Finding]:
    """Return findings for a plan that is not as the spec asks.

    Args:
        file: the file of the plan.
        why: the reason why there is no design; empty if there is one.
        capped: whether the plan meets less than is asked.
        share: power of the part over that of its plan.
        beyond: whether a sample costs more than the cap; it costs `part_cost`.
        fragile: whether a robust last part was wanted and not found.
        parts: whether the part is to separate minima.
    """
    percent, cost = f"{file} has {100 * share:.0f} % of the planned power", f"{part_cost:.4g} a sample"
    return [
        *PART_WITHOUT_DESIGN.when(why, why, where=file, why=why),
        *PLAN_CAPPED.when(capped, file, where=file),
        *PART_SCALED.when(share < NEARLY, percent, where=file, share=share),
        *EARLIER_PARTS_COST.when(beyond, cost, where=file, cost=part_cost),
        *PART_NOT_ROBUST.when(fragile, file, where=file),
        *PART_BETWEEN_MINIMA.when(parts, file, where=file),
    ]
