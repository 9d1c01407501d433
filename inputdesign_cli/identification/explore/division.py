"""Which part of a record estimates structures, and which judges them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from inputdesign_cli.identification.explore.fits import Parts
from inputdesign_cli.plant.polynomial import Array

Cut = Literal[
    "the first 60 % and the rest",
    "the first 50 % and the rest",
    "the first 40 % and the rest",
    "the first 70 % and the rest",
    "the first 30 % and the rest",
]
Split = Cut | Literal["blocks in turn", "none"]

# Where an input rests beyond one cut, another may leave steps on either side, with what comes after them.
_CUTS: tuple[tuple[float, Cut], ...] = (
    (0.6, "the first 60 % and the rest"),
    (0.5, "the first 50 % and the rest"),
    (0.4, "the first 40 % and the rest"),
    (0.7, "the first 70 % and the rest"),
    (0.3, "the first 30 % and the rest"),
)
# Where an input steps in blocks of one kind only, fewer or more of them may part its steps.
_BLOCKS = (10, 9, 11, 8, 12, 7, 13, 6, 14)
# An input whose rms about its level is less than this share of that in all records rests.
_STILL = 0.2


def divided(parts: Parts) -> tuple[Parts, Parts, Split]:
    """What estimates and what judges: beginning and end of the records.

    Blocks in turn where an input rests in one of these wherever they are parted; the whole twice where it
    does so in any blocks.
    """
    for first, second, split in _divisions(parts):
        if _moves(first, parts) and _moves(second, parts):
            return first, second, split
    return parts, parts, "none"


def _divisions(parts: Parts) -> Iterator[tuple[Parts, Parts, Split]]:
    total = sum(len(y) for _, y in parts)
    for share, cut in _CUTS:
        yield *_cut(parts, int(share * total)), cut
    for count in _BLOCKS:
        length = max(total // count, 1)
        blocks = [
            (u[begin : begin + length], y[begin : begin + length])
            for u, y in parts
            for begin in range(0, len(y), length)
            if len(y) - begin >= length // 2
        ]
        yield blocks[::2], blocks[1::2], "blocks in turn"


def _cut(parts: Parts, left: int) -> tuple[Parts, Parts]:
    """The first samples of the records, so many in all, and the others."""
    first: list[tuple[Array, Array]] = []
    second: list[tuple[Array, Array]] = []
    for u, y in parts:
        at = min(max(left, 0), len(y))
        left -= len(y)
        for some, piece in ((first, slice(0, at)), (second, slice(at, None))):
            if len(y[piece]):
                some.append((u[piece], y[piece]))
    return first, second


def _moves(some: Parts, whole: Parts) -> bool:
    """Whether all inputs move in a part, as they do in the whole, beside its level in every record."""
    if not some:
        return False
    spread, of_all = (
        np.concatenate([u - u.mean(axis=0) for u, _ in records]).std(axis=0) for records in (some, whole)
    )
    return bool(np.all(spread > _STILL * of_all))
