"""What is said of the record that is to be applied."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from inputdesign_cli.outcome.codec import others
from inputdesign_cli.outcome.design import Coverage

Channels = tuple[float, ...]


@dataclass(frozen=True)
class Moves:
    """The changes of a record of held values: how many, the largest, and the shortest dwell (time)."""

    count: int
    largest: Channels
    shortest_dwell: float


@dataclass(frozen=True)
class Signal:
    """Sizes of the samples, one entry a channel, and what the samples themselves attain.

    `worst_ratio` is the largest ratio of the requirements. `of_limits` are the shares of limits on single
    samples that it takes. `begun_anywhere` is the growth of its errors where the start is unknown (None
    without bound); it is absent (NaN here) where the start does not matter.
    """

    samples: int
    type: str | None = None
    sample_time: float | None = None
    power: Channels | None = None
    peak: Channels | None = None
    crest_factor: Channels | None = None
    input_power: Channels | None = None
    output_power: Channels | None = None
    input_peak: Channels | None = None
    input_move: Channels | None = None
    output_peak: Channels | None = None
    criterion: float | None = None
    efficiency: float | None = None
    worst_ratio: float | None = None
    extra_power: float | None = None
    spectrum_error: float | None = None
    limits: Mapping[str, tuple[float, float]] | None = None
    of_limits: Mapping[str, float] | None = None
    spectral_factor_residual: float | None = None
    operating_point: Channels | None = None
    wav_full_scale: float | None = None
    confidence: Coverage | None = None
    spectrum_of: Mapping[str, float] | None = None
    start_shift: float | None = None
    distance_to_best: float | None = None
    moves: Moves | None = None
    mean_squared_error: float | None = None
    details: Mapping[str, object] = others()
