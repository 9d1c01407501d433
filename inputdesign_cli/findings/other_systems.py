"""Records, or records and a prior, that are not of one system; samples that count twice."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, Location
from inputdesign_cli.finding import REFUTED, Finding, FindingKind, finding, note, refuted
from inputdesign_cli.identification import Estimate
from inputdesign_cli.levels import level
from inputdesign_cli.outcome.shares import chance

PRIOR_LEFT_OUT = note(
    "prior-left-out",
    "The estimate does not include the prior. `experiment.prior` gives information without its parameters, "
    "which serves no estimate, no verdict and no top-up.",
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

# This number of successive rows, half of them different, recurs in another record only if copied.
_IN_A_ROW = 8
# A record is a copy if _COPY of it stands in another, as a share; from _PART on there is a finding.
_COPY, _PART = 0.95, 0.1
_PRIOR = "experiment.prior"


def prior_notes(estimate: Estimate, *, stated: bool) -> list[Finding]:
    """Return findings on a prior: it was left out, or it contradicts the data.

    Args:
        stated: whether the spec states a prior.
    """
    without = stated and estimate.prior is None
    return [*PRIOR_LEFT_OUT.when(without, where=_PRIOR), *(contradictions(estimate) if stated else [])]


def contradictions(estimate: Estimate, looks: int = 1) -> list[Finding]:
    """Return a finding where the prior and the data are not of one system, or are of one record.

    Args:
        looks: number of tests as data come in; they share the level (Bonferroni).
    """
    if estimate.prior is None:
        return []
    for kind, likely in (
        (PRIOR_CONTRADICTED, estimate.prior.differing),
        (PRIOR_REPEATED, estimate.prior.alike),
    ):
        if likely * looks < level("prior"):
            return [kind.found(f"probability {chance(likely)}", where=_PRIOR, probability=likely)]
    return []


@finding(REFUTED, "records-differ", "Assess each record alone, and find out what has changed between them.")
def differences(kind: FindingKind, estimate: Estimate, files: Sequence[str], looks: int = 1) -> list[Finding]:
    """The records come from different systems. Their own parameters differ by more than chance.

    Args:
        looks: number of tests as data come in; all records and looks share the level (Bonferroni).
    """
    if not estimate.tests.alike:
        return []
    probability, name = min(zip(estimate.tests.alike, files, strict=False))
    against = " and ".join(other for other in files if other != name)
    fact = f"{name} and {against} (probability {chance(probability)} for one system)"
    certain = probability * len(estimate.tests.alike) * looks < level("one system")
    return kind.when(certain, fact, where=name, probability=probability, against=against)


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


@finding(REFUTED, "samples-repeated", "Give each sample once.")
def samples_repeated(kind: FindingKind, paths: Sequence[Path], records: Sequence[Array]) -> list[Finding]:
    """Two files have rows in common. The estimate would look more accurate than it is.

    Args:
        records: (n, c), the values in each file.

    Raises:
        DataError: `data-repeated`, two files hold the same samples.
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
        fact = f"{count} of {len(ours)} samples of {path.name} stand in {other.name} as well"
        if share >= _PART:
            found.append(kind.found(fact, where=path.name, samples=count, of=len(ours), other=other.name))
    return found
