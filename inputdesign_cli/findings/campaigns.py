"""The parts of a campaign: their records, the estimate from them, and the next plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from inputdesign_cli.finding import Finding, doubt, note, refuted

RECORD_WITHOUT_EXCITATION = note(
    "record-without-excitation",
    "A record has no column of the reference. In closed loop the plan is the reference, column r. Without "
    "it no comparison with the plan is possible, and the energy is taken from the plan.",
    "Record r as well.",
)
RECORD_SHORTER = note(
    "record-shorter",
    "A record ends before its plan. The next plan makes up for the missing samples.",
    "Nothing, or withdraw it and give the complete record.",
)
PART_REPEATED = doubt(
    "part-repeated",
    "An earlier part was applied again. The record follows another plan better than the current one. It was "
    "accepted by `--as-applied`.",
    "If it was given by mistake, withdraw it with `--withdraw`: samples must not count twice.",
)
RECORD_UNLIKE_PLAN = doubt(
    "record-unlike-plan",
    "A record does not follow its plan. It was accepted by `--as-applied`. Estimates use the recorded "
    "signals.",
    "If it was given by mistake, withdraw it with `--withdraw`.",
)
RECORD_SCALED = note(
    "record-scaled",
    "A part was applied at another scale than planned. It was accepted by `--as-applied`. Estimates use the "
    "recorded signals.",
    "If a column has the wrong unit, withdraw the record (`--withdraw`) and correct it.",
)
RECORD_WITHDRAWN = note(
    "record-withdrawn",
    "A withdrawn record no longer counts. Its length and energy remain part of the campaign, because its "
    "samples were applied. Its file stays.",
    "Nothing.",
)
RECORD_FOLLOWS_IN_PART = note(
    "record-follows-in-part",
    "A record follows its plan only in part. Their correlation is below 0.9, perhaps by lost samples, "
    "clipping or rounding. Estimates use the recorded signals.",
    "Compare the columns of the record with the plan.",
)
NO_ESTIMATE_YET = note(
    "no-estimate-yet",
    "The records do not determine the model yet. The next part is planned without an estimate.",
    "Apply the next part.",
)
ESTIMATE_NOT_USED = doubt(
    "estimate-not-used",
    "The next plan does not use the estimate itself. The accuracy cannot be evaluated there, for instance "
    "because the loop is unstable. The plan uses a model between the last usable estimate and this one.",
    "Apply the next part. If it happens again, check the records and the model structure.",
)
CAMPAIGN_DOUBTED = doubt(
    "campaign-doubted",
    "The records cast doubt on the model. The campaign continues. If it ended now, it would be undecided.",
    "Check the model structure before you apply more.",
)
CAMPAIGN_REFUTED = refuted(
    "campaign-refuted",
    "The campaign ends because the data refute the model. Tests of the residuals refute its structure. More "
    "samples of the same experiment would not help.",
    "Try `idesign explore` for another structure, or `idesign next DIR --regardless`.",
)
PART_WITHOUT_DESIGN = note(
    "part-without-design",
    "The next part is white noise. At the present estimate no experiment meets the requirements.",
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
_NEARLY = 0.9  # a part of less than this share of its power is named


def withdrawn_record(file: str, number: int) -> list[Finding]:
    """Return the finding for a record that is withdrawn."""
    message = f"record {number} ({file}) does not count any more; its samples and energy remain spent"
    return [RECORD_WITHDRAWN.found(message, where=file, record=number)]


def without_excitation(given: str, plan: str) -> list[Finding]:
    """Return the finding for a record that does not show what was applied."""
    message = f"{given} has no column r, so that it cannot be compared with {plan}"
    return [RECORD_WITHOUT_EXCITATION.found(message, where=given, plan=plan)]


def shorter(given: str, plan: str, samples: int, planned: int) -> list[Finding]:
    """Return a finding if fewer samples were applied than the part has."""
    message = f"{given} ends after {samples} of the {planned} samples of {plan}: the rest is planned anew"
    found = RECORD_SHORTER.found(message, where=given, plan=plan, samples=samples, planned=planned)
    return [] if samples == planned else [found]


def hardly_followed(
    given: str,
    plan: str,
    *,
    likeness: float,
    spliced: float,
    like: float,
    follows: bool,
    other: str | None,
    scale: float = 1.0,
) -> list[Finding]:
    """Return a finding if what was applied is not the plan that was due.

    Args:
        likeness: correlation with the plan; `spliced`: with shifted or lost samples put in their places.
        like: the correlation from which on a record follows its plan.
        follows: whether the record may be one of the plan.
        other: the file of a plan that the record follows better.
        scale: at which the plan was applied, if that is not 1 up to chance.
    """
    figures: dict[str, object] = {"plan": plan, "correlation": likeness, "in_step": spliced}
    withdraw = "Withdraw it with --withdraw if it was given by mistake"
    if other is not None:
        kind, figures = PART_REPEATED, {**figures, "other": other}
        said = f"holds {other} once more, not {plan} (correlation {likeness:.2f}). {withdraw}: samples would "
        said += "count twice"
    elif scale != 1.0 and abs(likeness) > like:
        kind, figures = RECORD_SCALED, {**figures, "scale": scale}
        said = f"was applied at {scale:.4g} times the scale of {plan}"
    elif likeness > like:
        return []
    elif not follows:
        kind, said = RECORD_UNLIKE_PLAN, f"hardly follows {plan} (correlation {likeness:.2f}). {withdraw}. "
        said += "The estimate uses what was recorded"
    else:
        kind, said = RECORD_FOLLOWS_IN_PART, f"follows {plan} only in part: the correlation is {likeness:.2f}"
        said += f", and {spliced:.2f} with shifted or lost samples put in place. The estimate uses what was "
        said += "recorded"
    return [replace(kind.found(f"{given} {said}", where=given), figures=figures)]


def no_estimate_yet(why: str) -> list[Finding]:
    """Return the finding for records without an estimate, for which `why` is the reason."""
    return [NO_ESTIMATE_YET.found(f"there is no estimate yet: {why}", why=why)]


def estimate_not_used(share: float | None, why: str) -> list[Finding]:
    """Return a finding if a plan is not made at the estimate.

    Args:
        share: of the way from the last estimate to this one; None if no model on the way can be used.
        why: the accuracy cannot be evaluated at this one; empty where its poles are the reason.
    """
    if share is None:
        message = "the accuracy cannot be evaluated at this estimate, nor on the way to it from the last one"
        return [ESTIMATE_NOT_USED.found(message, why=why)]
    reason = why or "its poles are too near to the unit circle, or outside"
    message = (
        f"the estimate is not used as it is ({reason}). The plan is made at {100 * share:.0f} % of the way "
        "to it from the last one, and the data decide nothing yet"
    )
    return [] if share == 1.0 else [ESTIMATE_NOT_USED.found(message, share=share, why=reason)]


def campaign_doubted() -> list[Finding]:
    """Return the finding for a campaign whose records speak against the model while it goes on."""
    message = (
        "the records speak against the model (see the other notes). See whether its structure should change "
        "before more is applied: as it stands the campaign would end undecided"
    )
    return [CAMPAIGN_DOUBTED.found(message)]


def campaign_refuted(
    directory: Path, samples: int, end: int, records: Sequence[str], *, every: bool
) -> list[Finding]:
    """Return the finding for a campaign that ends before its time.

    Args:
        samples: applied, of at most `end`.
        records: the files that count; `every`: whether none was withdrawn.
    """
    listed = " ".join(str(directory / name) for name in (["record_??.csv"] if every else records))
    message = (
        f"the campaign ends after {samples} of at most {end} samples: tests of the residuals refute the "
        f"structure of the model (see the other notes). Look for another one with `idesign explore {listed}` "
        f"and begin another campaign with it. To go on as it is: `idesign next {directory} --regardless`"
    )
    where = str(directory)
    return [CAMPAIGN_REFUTED.found(message, where=where, samples=samples, end=end, records=list(records))]


def planned_otherwise(
    file: str, *, why: str, capped: bool, share: float, beyond: bool, part_cost: float, fragile: bool
) -> list[Finding]:
    """Return findings for a plan that is not as the spec asks.

    Args:
        file: of the plan.
        why: the reason why there is no design; empty if there is one.
        capped: whether the plan meets less than is asked.
        share: of its power that the part has.
        beyond: whether a sample costs more than the cap; it costs `part_cost`.
        fragile: whether a robust last part was wanted and not found.
    """
    found = []
    if why:
        message = (
            f"there is no design at this estimate ({why}). The next part is white noise at the cost of "
            "the first plan, or of the pilot. The estimate after it decides"
        )
        found.append(PART_WITHOUT_DESIGN.found(message, where=file, why=why))
    if capped:
        message = (
            f"{file} misses the accuracy that is asked: campaign.power_cap (default: 10 times the "
            "first plan) or limits allow no more until campaign.max_samples"
        )
        found.append(PLAN_CAPPED.found(message, where=file))
    if share < _NEARLY:
        message = (
            f"the part has {100 * share:.0f} % of the power of {file}: with all of it, it would cost "
            "more than campaign.power_cap at the estimate or the plant of the spec"
        )
        found.append(PART_SCALED.found(message, where=file, share=share))
    if beyond:
        message = (
            f"a sample of the next part costs {part_cost:.4g}, more than campaign.power_cap allows, "
            "since earlier parts still move the plant"
        )
        found.append(EARLIER_PARTS_COST.found(message, where=file, cost=part_cost))
    if fragile:
        message = (
            f"{file} is planned for the estimate alone: some plant that the data leave open asks for "
            "more than campaign.power_cap and limits allow"
        )
        found.append(PART_NOT_ROBUST.found(message, where=file))
    return found
