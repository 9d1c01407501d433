"""The estimate of a campaign cannot be built on, or the data contradict its structure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from inputdesign_cli.finding import Finding, FindingKind, Severity

NO_ESTIMATE_YET = FindingKind(
    "no-estimate-yet",
    Severity.NOTE,
    "the records do not determine the model yet",
    "The records so far are too few or too quiet for an estimate. The next part is planned without one.",
    "Apply the next part.",
)
ESTIMATE_NOT_USED = FindingKind(
    "estimate-not-used",
    Severity.DOUBT,
    "the estimate is not used as it is",
    "The accuracy cannot be evaluated at the estimate, for instance because its loop is unstable. The plan "
    "is made on the way from the last usable estimate to this one. The data decide nothing yet.",
    "Apply the next part. If it happens again, look at the records and at the structure of the model.",
)
CAMPAIGN_DOUBTED = FindingKind(
    "campaign-doubted",
    Severity.DOUBT,
    "the records speak against the model",
    "The campaign goes on, but if it ended now it would end undecided. The other findings say why.",
    "See whether the structure of the model should change before more is applied.",
)
CAMPAIGN_REFUTED = FindingKind(
    "campaign-refuted",
    Severity.REFUTED,
    "the campaign ends because the data refute the model",
    "Tests of the residuals after every part refute the structure of the model. More samples of the same "
    "experiment would not mend that.",
    "Look for another structure with `idesign explore` and begin another campaign with it. To go on with "
    "this structure, use `idesign next DIR --regardless`.",
)


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
    if share == 1.0:
        return []
    reason = why or "its poles are too near to the unit circle, or outside"
    message = (
        f"the estimate is not used as it is ({reason}). The plan is made at {100 * share:.0f} % of the way "
        "to it from the last one, and the data decide nothing yet"
    )
    return [ESTIMATE_NOT_USED.found(message, share=share, why=reason)]


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
    names = ["record_??.csv"] if every else records
    listed = " ".join(str(directory / name) for name in names)
    message = (
        f"the campaign ends after {samples} of at most {end} samples: tests of the residuals refute the "
        f"structure of the model (see the other notes). Look for another one with `idesign explore {listed}` "
        f"and begin another campaign with it. To go on as it is: `idesign next {directory} --regardless`"
    )
    where = str(directory)
    return [CAMPAIGN_REFUTED.found(message, where=where, samples=samples, end=end, records=list(records))]
