"""Which inputs of a record move, and whether it is long enough to be explored."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.identification.checks import check_varying

_FEWEST = 30
_UNKNOWN = ("gain and dynamics",)


def moving_in(parts: Parts) -> tuple[tuple[int, ...], list[tuple[Array, Array]]]:
    """The inputs that never move, and the records without them.

    Raises:
        SpecError: `too-few-samples`, `constant-input` or `constant-output`.
    """
    u, y = (np.concatenate(signals) for signals in zip(*parts, strict=True))
    _check_length(len(y), _FEWEST)
    still = tuple(int(j) for j in np.flatnonzero(np.ptp(u, axis=0) <= 1e-12 * np.abs(u).max(axis=0)))
    if len(still) == u.shape[1]:
        check_varying(_UNKNOWN, u, y)
    moving = [j for j in range(u.shape[1]) if j not in still]
    check_varying(_UNKNOWN, u[:, moving], y)
    _check_length(len(y), _FEWEST * (len(moving) + 1) // 2)
    return still, [(part_u[:, moving], part_y) for part_u, part_y in parts]


def _check_length(samples: int, needed: int) -> None:
    """Raises `SpecError` (`too-few-samples`) where there are fewer."""
    if samples < needed:
        are = "1 sample is" if samples == 1 else f"{samples} samples are"
        raise bad_spec(
            "too-few-samples",
            f"{are} too few to choose a structure and to judge it: take {needed} at least",
            hint="record more; or identify a structure that you know: idesign identify DATA --spec SPEC",
            key="u",
        )
