"""What is said of a frequency response at lines: of a design for it, and of a measurement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from inputdesign_cli.arrays import Array


@dataclass(frozen=True)
class DetectionLines:
    """Lines that are not excited, so that nonlinearities of odd and even degree show there."""

    odd: Array
    even: Array


@dataclass(frozen=True)
class SilentLine:
    """Describes the outputs at lines of one kind that are not excited; lists are by output.

    `worst_ratio` is the largest share of r_adm that the nonlinearity takes, at `frequency`. `cubed` names the
    signal whose cube the lines resemble.
    """

    lines: int
    over_noise: tuple[float, ...]
    probability: tuple[float, ...]
    rms: tuple[float, ...]
    worst_ratio: float | None = None
    frequency: float | None = None
    cubed: str | None = None


@dataclass(frozen=True)
class MeasuredLines:
    """The lines, the periods that count, and the largest deviation over the admitted one.

    Of a measurement without lines of a spec, only the method and how far a model lies outside are there.
    """

    lines: int | None = None
    period: int | None = None
    periods: int | None = None
    blocks: int | None = None
    transient: int | None = None
    counted: int | None = None
    worst_ratio: float | None = None
    worst_frequency: float | None = None
    worst_ratio_limits: tuple[float, float] | None = None
    detection: DetectionLines | None = None
    asked: int | None = None
    records: int | None = None
    method: str | None = None
    excitation: str | None = None
    frequencies: int | None = None
    entries: int | None = None
    model_outside: float | None = None
    model_far_outside: float | None = None
    caveat: str | None = None
    nonlinearity: Mapping[str, SilentLine] | None = None
