"""Records, or records and a prior, that are not of one system; samples that count twice."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, Location
from inputdesign_cli.finding import Finding, note, refuted
from inputdesign_cli.identification import Estimate
from inputdesign_cli.levels import level
from inputdesign_cli.outcome.shares import chance

PRIOR_COUNTS = note(
    "prior-counts",
    "The estimate includes the prior. `experiment.prior` has its parameters. Estimate, covariance and "
    "accuracy combine prior and data.",
    "Remove the prior to see the estimate from the data alone.",
)
PRIOR_LEFT_OUT = note(
    "prior-left-out",
    "The estimate does not include the prior. `experiment.prior` gives information without its parameters, "
    "which serves neither an estimate nor a verdict.",
    "Write its parameters beside the matrix, or name the `model.yaml` or the records of the earlier data.",
)
PRIOR_CONTRADICTED = refuted(
    "prior-contradicted",
    "Prior and data contradict each other. Their estimates differ by more than their covariances explain.",
    "Remove the prior, or find out what has changed since.",
)
PRIOR_REPEATED = refuted(
    "prior-of-these-data",
    "The prior seems to come from these data. They agree more closely than independent records. The same "
    "samples would count twice.",
    "Remove the prior, or give only records that it does not include.",
)
RECORDS_DIFFER = refuted(
    "records-differ",
    "The records come from different systems. Parameters estimated from each record alone differ by more "
    "than chance.",
    "Assess each record alone, and find out what has changed between them.",
)
SAMPLES_REPEATED = refuted(
    "samples-repeated",
    "Two files have rows in common. The estimate would look more accurate than it is.",
    "Give each sample once.",
)


# This many rows in a row, half of them different, come again in another record by copying only.
_IN_A_ROW = 8
# A record of which this share stands in another is a copy; a smaller part is a finding.
_COPY, _PART = 0.95, 0.1
_PRIOR = "experiment.prior"


def prior_notes(estimate: Estimate, *, stated: bool) -> list[Finding]:
    """Return what a prior that the spec `stated` has to do with the estimate."""
    if not stated:
        return []
    if estimate.prior is None:
        message = (
            "experiment.prior does not count for this estimate: it is information without the parameters "
            "that it belongs to; write parameters: {b1: 3.6, ..} beside a matrix, name the model.yaml of "
            "the earlier data, or give their records as further files"
        )
        return [PRIOR_LEFT_OUT.found(message, where=_PRIOR)]
    counted = (
        "experiment.prior counts: estimate, covariance and accuracy are those of prior and data together"
    )
    return [PRIOR_COUNTS.found(counted, where=_PRIOR), *contradictions(estimate)]


def contradictions(estimate: Estimate, looks: int = 1) -> list[Finding]:
    """Return a finding where the prior and the data are not of one system, or are of one record.

    Args:
        looks: how often it is asked as data come in; they share the level (Bonferroni).
    """
    if estimate.prior is None:
        return []
    differing, alike = estimate.prior.differing, estimate.prior.alike
    if differing * looks < level("prior"):
        message = (
            f"experiment.prior and these data contradict each other (probability {chance(differing)} for "
            "one system): remove the prior, or look for what has changed since"
        )
        return [PRIOR_CONTRADICTED.found(message, where=_PRIOR, probability=differing)]
    if alike * looks < level("prior"):
        message = (
            "experiment.prior and these data agree more closely than others do (probability "
            f"{chance(alike)}): the prior seems to be made of this record, or of a part or copy of it, "
            "which would count twice; leave it out, or give only records that it was not made of"
        )
        return [PRIOR_REPEATED.found(message, where=_PRIOR, probability=alike)]
    return []


def differences(estimate: Estimate, files: Sequence[str], looks: int = 1) -> list[Finding]:
    """Return a finding where the experiments are not of one system; all share the level (Bonferroni).

    Args:
        looks: see `contradictions`.
    """
    probability, name = min(zip(estimate.tests.alike, files, strict=False), default=(1.0, ""))
    if not estimate.tests.alike or probability * len(estimate.tests.alike) * looks >= level("one system"):
        return []
    others = [other for other in files if other != name]
    against = others[0] if len(others) == 1 else "the other records"
    message = (
        f"{name} and {against} are not of one system (probability {chance(probability)} that their "
        "parameters differ as much by chance): assess each alone, and look for what has changed between them"
    )
    return [RECORDS_DIFFER.found(message, where=name, probability=probability, against=against)]


def shared(one: Array, other: Array) -> NDArray[np.bool_]:
    """Return which rows (n,) of `one` (n, c) stand in `other` (m, c), in the same order."""
    rows = np.unique(np.concatenate([one, other]), axis=0, return_inverse=True)[1].ravel()
    found = np.zeros(len(one), dtype=bool)
    if min(len(one), len(other)) < _IN_A_ROW:
        return found
    ours, theirs = (
        np.lib.stride_tricks.sliding_window_view(part, _IN_A_ROW) for part in np.split(rows, [len(one)])
    )
    several = np.sum(np.diff(np.sort(ours, axis=1), axis=1) > 0, axis=1) >= _IN_A_ROW // 2
    stretches = np.unique(np.concatenate([ours, theirs]), axis=0, return_inverse=True)[1].ravel()
    again = several & np.isin(stretches[: len(ours)], stretches[len(ours) :])
    for start in range(_IN_A_ROW):
        found[start : start + len(again)] |= again
    return found


def samples_repeated(paths: Sequence[Path], records: Sequence[Array]) -> list[Finding]:
    """Say which files, each (n, c) as it stands there, have a part in common.

    Raises:
        DataError: `data-repeated`, one holds what another does.
    """
    found = []
    for (other, others), (path, rows) in combinations(zip(paths, records, strict=True), 2):
        ours, theirs = shared(rows, others), shared(others, rows)
        share, count = max(ours.mean(), theirs.mean()), int(ours.sum())
        if share >= _COPY:
            message = (
                f"{path.name} and {other.name} hold the same samples: counted twice, they would make the "
                "estimate look more accurate than it is"
            )
            where = Location(str(path), 1, 1, "")
            raise DataError.because("data-repeated", message, "give each record once", "", where)
        message = (
            f"{count} of {len(ours)} samples of {path.name} stand in {other.name} as well. Counted twice, "
            "they make the estimate look more accurate than it is."
        )
        own = SAMPLES_REPEATED.found(message, where=path.name, samples=count, of=len(ours), other=other.name)
        found += [own] if share >= _PART else []
    return found
