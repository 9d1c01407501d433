"""Records, or records and a prior, that are not of one system; samples that count twice."""

from __future__ import annotations

from collections.abc import Sequence

from inputdesign_cli.finding import Finding, FindingKind, Severity
from inputdesign_cli.identification import Estimate
from inputdesign_cli.levels import level
from inputdesign_cli.outcome.shares import chance

PRIOR_COUNTS = FindingKind(
    "prior-counts",
    Severity.NOTE,
    "the prior counts for the estimate",
    "`experiment.prior` has its parameters. Estimate, covariance and accuracy are those of prior and data "
    "together.",
    "Remove the prior to see what the data say alone.",
)
PRIOR_LEFT_OUT = FindingKind(
    "prior-left-out",
    Severity.NOTE,
    "the prior does not count",
    "`experiment.prior` is information without the parameters that it belongs to. It cannot count for an "
    "estimate, nor for a verdict.",
    "Write its parameters beside the matrix, name the `model.yaml` of the earlier data, or give their "
    "records as further files.",
)
PRIOR_CONTRADICTED = FindingKind(
    "prior-contradicted",
    Severity.REFUTED,
    "prior and data contradict each other",
    "The estimate from the data alone differs from that of the prior by more than their covariances explain.",
    "Remove the prior, or look for what has changed since.",
)
PRIOR_REPEATED = FindingKind(
    "prior-of-these-data",
    Severity.REFUTED,
    "the prior seems to be made of these data",
    "Prior and data agree more closely than two independent records do. The same samples would count twice.",
    "Leave the prior out, or give only records that it was not made of.",
)
RECORDS_DIFFER = FindingKind(
    "records-differ",
    Severity.REFUTED,
    "records are not of one system",
    "Parameters that are estimated from each record alone differ by more than chance.",
    "Assess each record alone, and look for what has changed between them.",
)
SAMPLES_REPEATED = FindingKind(
    "samples-repeated",
    Severity.REFUTED,
    "samples seem to be given twice",
    "Two files have rows in common. Samples that count twice make an estimate look surer than it is.",
    "Give each sample once.",
)


def prior_notes(estimate: Estimate, *, stated: bool) -> list[Finding]:
    """Return what a prior that the spec `stated` has to do with the estimate."""
    if not stated:
        return []
    if estimate.prior is None:
        message = (
            "experiment.prior does not count for this estimate: it is information without the parameters "
            "that it belongs to; write parameters: {b1: 3.6, ..} beside a matrix, name the model.yaml of the "
            "earlier data, or give their records as further files"
        )
        return [PRIOR_LEFT_OUT.found(message, where="experiment.prior")]
    counted = (
        "experiment.prior counts: estimate, covariance and accuracy are those of prior and data together"
    )
    return [PRIOR_COUNTS.found(counted, where="experiment.prior"), *contradictions(estimate)]


def contradictions(estimate: Estimate, looks: int = 1) -> list[Finding]:
    """Return a finding where the prior and the data are not of one system, or are of one record.

    Args:
        looks: how often it is asked as data come in; they share the level (Bonferroni).
    """
    if estimate.prior is None:
        return []
    differing, alike = estimate.prior.differing, estimate.prior.alike
    if differing * looks < level("prior"):
        return [
            PRIOR_CONTRADICTED.found(
                "experiment.prior and these data contradict each other (probability "
                f"{chance(differing)} for one system): remove the prior, or look for what has "
                "changed since",
                where="experiment.prior",
                probability=differing,
            )
        ]
    if alike * looks < level("prior"):
        return [
            PRIOR_REPEATED.found(
                "experiment.prior and these data agree more closely than others do (probability "
                f"{chance(alike)}): the prior seems to be made of this record, or of a part or "
                "copy of it, which would count twice; leave it out, or give only records that it was not "
                "made of",
                where="experiment.prior",
                probability=alike,
            )
        ]
    return []


def differences(estimate: Estimate, files: Sequence[str], looks: int = 1) -> list[Finding]:
    """Return a finding where the experiments are not of one system; all share the level (Bonferroni).

    Args:
        looks: see `contradictions`.
    """
    found = [
        (probability, name)
        for probability, name in zip(estimate.tests.alike, files, strict=False)
        if probability * len(estimate.tests.alike) * looks < level("one system")
    ]
    if not found:
        return []
    probability, name = min(found)
    others = [other for other in files if other != name]
    against = others[0] if len(others) == 1 else "the other records"
    return [
        RECORDS_DIFFER.found(
            f"{name} and {against} are not of one system (probability {chance(probability)} that their "
            "parameters differ as much by chance): assess each alone, and look for what has changed between "
            "them",
            where=name,
            probability=probability,
            against=against,
        )
    ]
