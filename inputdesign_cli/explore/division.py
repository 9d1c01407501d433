"""Which part of a record estimates structures, and which judges them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts

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
    """The records that estimate, the records that judge, and how they were parted."""

    first: Parts
    second: Parts
    split: Split


def divided(parts: Parts) -> Division:
    """Return the part of the records that estimates and the part that judges, beginning and end as a rule.

    Where an input rests in one of the two, blocks take turns. Where it rests in any blocks as well, the whole
    record does both.
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
        yield Division(first, second, "blocks in turn")


def _cut(parts: Parts, left: int, cut: Cut) -> Division:
    """Return the first samples of the records, `left` in all, and the others."""
    first, second = list[tuple[Array, Array]](), list[tuple[Array, Array]]()
    for u, y in parts:
        at = min(max(left, 0), len(y))
        left -= len(y)
        if at:
            first.append((u[:at], y[:at]))
        if at < len(y):
            second.append((u[at:], y[at:]))
    return Division(first, second, cut)


def _moves(some: Parts, whole: Parts) -> bool:
    """Return whether all inputs move in a part as they do in the whole, about their levels."""
    if not some:
        return False
    spread, of_all = (
        np.concatenate([u - u.mean(axis=0) for u, _ in records]).std(axis=0) for records in (some, whole)
    )
    return bool(np.all(spread > _STILL * of_all))


def busiest(parts: Parts, most: int) -> list[tuple[Array, Array]]:
    """Return at most `most` samples: of a long record the stretch in which the inputs move most."""
    share = most // len(parts)
    return [(u[at], y[at]) for u, y in parts for at in [_window(u, share if len(parts) > 1 else most)]]


def _window(u: NDArray[np.float64], length: int) -> slice:
    if len(u) <= length:
        return slice(0, len(u))
    moves = np.sum((np.diff(u, axis=0) / np.maximum(u.std(axis=0), 1e-300)) ** 2, axis=1)
    total = np.concatenate([[0.0], np.cumsum(moves)])
    begin = int(np.argmax(total[length - 1 :] - total[: len(total) - length + 1]))
    return slice(begin, begin + length)
