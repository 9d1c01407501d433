"""Choose which part of a record estimates structures, and which judges them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts

# Cuts in per cent. If an input rests beyond one, another may leave steps on both sides, with their responses.
_CUTS = (60, 50, 40, 70, 30)
# Numbers of blocks. If an input steps in every second block only, another number may divide its steps.
_BLOCKS = (10, 9, 11, 8, 12, 7, 13, 6, 14)
# An input rests if its rms about its level is less than this share of its rms in all records.
_STILL = 0.2


def divided(parts: Parts) -> tuple[Parts, Parts, str]:
    """Return the records that estimate, the records that judge, and their division.

    As a rule the beginning estimates and the end judges. If an input rests in one of them, blocks alternate.
    If it rests in these blocks as well, the whole record does both.
    """
    ends = np.cumsum([len(y) for _, y in parts])
    for share in _CUTS:
        # A record that ends before the cut belongs to the first side.
        at = [
            max(share * int(ends[-1]) // 100 - int(end) + len(y), 0)
            for end, (_, y) in zip(ends, parts, strict=True)
        ]
        sides = cut(parts, [slice(k) for k in at]), cut(parts, [slice(k, None) for k in at])
        first, second = ([part for part in side if len(part[1])] for side in sides)
        if _moves(first, parts) and _moves(second, parts):
            return first, second, f"the first {share} % and the rest"
    for count in _BLOCKS:
        length = max(int(ends[-1]) // count, 1)
        blocks = [
            (u[begin : begin + length], y[begin : begin + length])
            for u, y in parts
            for begin in range(0, len(y) - length // 2, length)
        ]
        if _moves(blocks[::2], parts) and _moves(blocks[1::2], parts):
            return blocks[::2], blocks[1::2], "blocks in turn"
    return parts, parts, "none"


def _moves(some: Parts, whole: Parts) -> bool:
    """Return whether all inputs move in a part as they do in the whole, about their levels."""
    if not some:
        return False
    spread, of_all = (
        np.concatenate([u - u.mean(axis=0) for u, _ in records]).std(axis=0) for records in (some, whole)
    )
    return bool(np.all(spread > _STILL * of_all))


def cut(parts: Parts, at: Sequence[slice]) -> list[tuple[Array, Array]]:
    """Return a stretch of each record."""
    return [(u[own], y[own]) for (u, y), own in zip(parts, at, strict=True)]


def busiest(parts: Parts, most: int) -> list[slice]:
    """Return the stretches of the records in which the inputs move most, `most` samples in all."""
    length, found = max(most // len(parts), 2), list[slice]()
    for u, _ in parts:
        moves = np.sum((np.diff(u, axis=0) / np.maximum(u.std(axis=0), 1e-300)) ** 2, axis=1)
        total = np.concatenate([[0.0], np.cumsum(moves)])
        begin = int(np.argmax(total[length - 1 :] - total[: 1 - length])) if len(u) > length else 0
        found.append(slice(begin, min(begin + length, len(u))))
    return found
