"""Two files have samples in common: information counts once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, Location
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.other_systems import SAMPLES_REPEATED

# This many rows in a row, half of them different, come again in another record by copying only.
_IN_A_ROW = 8
# A record of which this share stands in another is a copy; a smaller part is a finding.
_COPY, _PART = 0.95, 0.1


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
    for later, (path, rows) in enumerate(zip(paths, records, strict=True)):
        for other, others in zip(paths[:later], records, strict=False):
            ours, theirs = shared(rows, others), shared(others, rows)
            share = max(ours.mean(), theirs.mean())
            if share >= _COPY:
                raise DataError.because(
                    "data-repeated",
                    f"{path.name} and {other.name} hold the same samples: counted twice, they would make the "
                    "estimate look more accurate than it is",
                    "give each record once",
                    "",
                    Location(str(path), 1, 1, ""),
                )
            if share >= _PART:
                said = f"{ours.sum()} of {len(ours)} samples of {path.name} stand in {other.name} as well."
                more = "Counted twice, they make the estimate look more accurate than it is."
                found.append(
                    SAMPLES_REPEATED.found(
                        f"{said} {more}",
                        where=path.name,
                        samples=int(ours.sum()),
                        of=len(ours),
                        other=other.name,
                    )
                )
    return found
