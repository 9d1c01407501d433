"""Which part of a record estimates structures, and which judges them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.explore.regression import LONG

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


class Division(NamedTuple):
    """The records that estimate, those that judge, and how they were parted.

    Attributes:
        before: of each record that judges what was recorded right before it, which may be nothing.
    """

    first: Parts
    second: Parts
    split: Split
    before: Parts = ()


def known_before(second: Parts, before: Parts, late: int) -> Parts:
    """`before`, what was recorded right before those that judge, where delays would leave out much of these.

    The inputs that are answered so late are known there.
    """
    return before if late * LONG > max(len(y) for _, y in second) else ()


def divided(parts: Parts) -> Division:
    """What estimates and what judges: beginning and end of the records.

    Blocks in turn where an input rests in one of these wherever they are parted; the whole twice where it
    does so in any blocks.
    """
    for division in _divisions(parts):
        if _moves(division.first, parts) and _moves(division.second, parts):
            return division
    return Division(parts, parts, "none")


def _divisions(parts: Parts) -> Iterator[Division]:
    total = sum(len(y) for _, y in parts)
    for share, cut in _CUTS:
        yield _cut(parts, int(share * total), cut)
    for count in _BLOCKS:
        length = max(total // count, 1)
        blocks = [
            (k, begin)
            for k, (_, y) in enumerate(parts)
            for begin in range(0, len(y), length)
            if len(y) - begin >= length // 2
        ]
        first, second = (
            [(parts[k][0][begin : begin + length], parts[k][1][begin : begin + length]) for k, begin in some]
            for some in (blocks[::2], blocks[1::2])
        )
        before = [(parts[k][0][:begin], parts[k][1][:begin]) for k, begin in blocks[1::2]]
        yield Division(first, second, "blocks in turn", before)


def _cut(parts: Parts, left: int, cut: Cut) -> Division:
    """The first samples of the records, so many in all, and the others."""
    first, second, before = (list[tuple[Array, Array]]() for _ in range(3))
    for u, y in parts:
        at = min(max(left, 0), len(y))
        left -= len(y)
        if at:
            first.append((u[:at], y[:at]))
        if at < len(y):
            second.append((u[at:], y[at:]))
            before.append((u[:at], y[:at]))
    return Division(first, second, cut, before)


def _moves(some: Parts, whole: Parts) -> bool:
    """Whether all inputs move in a part, as they do in the whole, beside its level in every record."""
    if not some:
        return False
    spread, of_all = (
        np.concatenate([u - u.mean(axis=0) for u, _ in records]).std(axis=0) for records in (some, whole)
    )
    return bool(np.all(spread > _STILL * of_all))
