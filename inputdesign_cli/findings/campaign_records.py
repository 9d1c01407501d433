"""A record of a campaign differs from its plan, or cannot be compared with it."""

from __future__ import annotations

from dataclasses import replace

from inputdesign_cli.finding import Finding, FindingKind, Severity

RECORD_WITHOUT_EXCITATION = FindingKind(
    "record-without-excitation",
    Severity.NOTE,
    "a record has no column of the reference",
    "In closed loop the plan is a reference, column r. A record without it cannot be compared with its plan. "
    "Its energy is taken from the plan.",
    "Record r as well.",
)
RECORD_SHORTER = FindingKind(
    "record-shorter",
    Severity.NOTE,
    "a record ends before its plan does",
    "Samples of the plan that were not recorded do not count as applied. The next plan makes up for them.",
    "Nothing, unless the record should be complete: then withdraw it and give the whole one.",
)
PART_REPEATED = FindingKind(
    "part-repeated",
    Severity.DOUBT,
    "an earlier part was applied once more",
    "The record follows another plan of the campaign better than the plan that was due. It was taken because "
    "of --as-applied.",
    "Withdraw the record with --withdraw if it was given by mistake: samples must not count twice.",
)
RECORD_UNLIKE_PLAN = FindingKind(
    "record-unlike-plan",
    Severity.DOUBT,
    "a record does not follow its plan",
    "What was applied has little correlation with the plan. It was taken because of --as-applied. Estimates "
    "use what was recorded.",
    "Withdraw the record with --withdraw if it was given by mistake.",
)
RECORD_SCALED = FindingKind(
    "record-scaled",
    Severity.NOTE,
    "a part was applied at another scale than planned",
    "The record follows its plan at another scale. It was taken because of --as-applied. Estimates use what "
    "was recorded.",
    "Withdraw the record with --withdraw if a column is in another unit, and give it in the right one.",
)
RECORD_WITHDRAWN = FindingKind(
    "record-withdrawn",
    Severity.NOTE,
    "a record does not count any more",
    "Estimates leave out a withdrawn record. Its samples were applied, so that its length and energy remain "
    "part of the campaign. Its file stays.",
    "Nothing.",
)
RECORD_FOLLOWS_IN_PART = FindingKind(
    "record-follows-in-part",
    Severity.NOTE,
    "a record follows its plan in part",
    "The correlation of a record with its plan is below 0.9. Lost samples, clipping or rounding are "
    "possible causes. Estimates use what was recorded.",
    "Compare the columns of the record with the plan.",
)


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
    if samples == planned:
        return []
    message = f"{given} ends after {samples} of the {planned} samples of {plan}: the rest is planned anew"
    return [RECORD_SHORTER.found(message, where=given, plan=plan, samples=samples, planned=planned)]


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
    kind = RECORD_FOLLOWS_IN_PART
    figures: dict[str, object] = {"plan": plan, "correlation": likeness, "in_step": spliced}
    if other is not None:
        kind = PART_REPEATED
        figures |= {"other": other}
        message = (
            f"{given} holds {other} once more, not {plan} (correlation {likeness:.2f}). Withdraw it with "
            "--withdraw if it was given by mistake: samples would count twice"
        )
    elif scale != 1.0 and abs(likeness) > like:
        kind = RECORD_SCALED
        figures |= {"scale": scale}
        message = f"{given} was applied at {scale:.4g} times the scale of {plan}"
    elif likeness > like:
        return []
    elif not follows:
        kind = RECORD_UNLIKE_PLAN
        message = (
            f"{given} hardly follows {plan} (correlation {likeness:.2f}). Withdraw it with --withdraw if it "
            "was given by mistake. The estimate uses what was recorded"
        )
    else:
        message = (
            f"{given} follows {plan} only in part: the correlation is {likeness:.2f}, and {spliced:.2f} with "
            "shifted or lost samples put in place. The estimate uses what was recorded"
        )
    return [replace(kind.found(message, where=given), figures=figures)]
