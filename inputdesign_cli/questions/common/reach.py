"""What is known of all spectra before a design begins."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Reach:
    """How far spectra reach: whether all of them have a bound, and whether it is attained.

    Where it is only approached, at ends of the `band` of all spectra, that stays off them by so little that
    nothing is lost to the tolerance. `note` says what the reader of a result must know of it; None if
    there is nothing to say.
    """

    bounded: bool = True
    attained: bool = True
    band: tuple[float, float] | None = None
    note: str | None = None
