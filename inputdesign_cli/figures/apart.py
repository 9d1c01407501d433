"""Curves and points of one panel that stay apart, however many there are."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.typing import LineStyleType

from inputdesign_cli.figures.style import PALETTE

# Round after round of the colours.
_DASHES: tuple[LineStyleType, ...] = ("solid", (0, (3, 1.5)), (0, (6, 1.5, 1, 1.5)), (0, (1, 1)))
# As many as have no divisor in common with the colours.
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def stroke(number: int, colours: Sequence[str] = PALETTE) -> tuple[str, LineStyleType]:
    """Colour and dashes of a curve by its number from zero: other dashes where the colours are used up."""
    again, place = divmod(number, len(colours))
    return colours[place], _DASHES[again % len(_DASHES)]


def point(number: int) -> tuple[str, str]:
    """Colour and marker of a set of points by its number from zero: no two of the first 42 are alike."""
    return PALETTE[number % len(PALETTE)], _MARKERS[number % len(_MARKERS)]
