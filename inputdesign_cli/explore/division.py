"""Which part of a record estimates structures, and which judges them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts

# Where an input rests beyond one cut, another may leave steps on either side, with what comes after them.
_CUTS = (60, 50, 40, 70, 30)
# Where an input steps in blocks of one kind only, fewer or more of them may part its steps.
_BLOCKS = (10, 9, 11, 8, 12, 7, 13, 6, 14)
# An input whose rms about its level is less than this share of that in all records rests.
_STILL = 0.2


class Division(NamedTuple):
    """The records that estimate, the records that judge, and how they were parted."""

    first: Parts
    second: Parts
    split: str


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
    for share in _CUTS:
        yield _parted(parts, share * total // 100, f"the first {share} % and the rest")
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


def _parted(parts: Parts, left: int, split: str) -> Division:
    """Return the first samples of the records, `left` in all, and the others."""
    begins = np.cumsum([0, *(len(y) for _, y in parts)])
    at = [min(max(left - int(begin), 0), len(y)) for begin, (_, y) in zip(begins, parts, strict=False)]
    first = [(u[:k], y[:k]) for k, (u, y) in zip(at, parts, strict=True) if k]
    second = [(u[k:], y[k:]) for k, (u, y) in zip(at, parts, strict=True) if k < len(y)]
    return Division(first, second, split)


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
    return cut(parts, windows(parts, most))


def cut(parts: Parts, at: Sequence[slice]) -> list[tuple[Array, Array]]:
    """Return a stretch of each record."""
    return [(u[own], y[own]) for (u, y), own in zip(parts, at, strict=True)]


def windows(parts: Parts, most: int) -> list[slice]:
    """Return the stretches of the records in which the inputs move most, `most` samples in all."""
    length, found = max(most // len(parts), 2), list[slice]()
    for u, _ in parts:
        moves = np.sum((np.diff(u, axis=0) / np.maximum(u.std(axis=0), 1e-300)) ** 2, axis=1)
        total = np.concatenate([[0.0], np.cumsum(moves)])
        begin = int(np.argmax(total[length - 1 :] - total[: 1 - length])) if len(u) > length else 0
        found.append(slice(begin, min(begin + length, len(u))))
    return found
