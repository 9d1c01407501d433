"""What is said of a model that was found in a log, and of how it does on other data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from inputdesign_cli.outcome.codec import NULL
from inputdesign_cli.outcome.response import MeasuredLines, SilentLine

Fit = float | tuple[float | None, ...] | None
"""Per cent of one output, or of each; None for an unstable model."""


@dataclass(frozen=True)
class Validation:
    """Fits of simulation and one-step prediction to data that the estimate has not seen."""

    simulation_fit_percent: Fit = field(default=None, metadata=NULL)
    prediction_fit_percent: Fit = field(default=None, metadata=NULL)
    reasons: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Structure:
    """A structure that was tried: its orders and delays, and how it fits.

    `failed` are the tests of its residuals that fail. `certain` is whether no parameter of the plant deviates
    by more than half its value.
    """

    family: str
    orders: Mapping[str, int]
    delay: tuple[int, ...]
    parameters: int
    criterion: float
    failed: tuple[str, ...]
    converged: bool
    certain: bool
    estimation_fit_percent: float | None = field(default=None, metadata=NULL)
    simulation_fit_percent: float | None = field(default=None, metadata=NULL)
    prediction_fit_percent: float | None = field(default=None, metadata=NULL)


@dataclass(frozen=True)
class ExploredOutput:
    """The structure that was chosen for an output, and all that were tried."""

    output: str
    structure: Structure
    delay: tuple[int, ...]
    delay_range: tuple[tuple[int, int | None], ...]
    output_error_by_order: Mapping[str, float]
    structures: tuple[Structure, ...]
    not_estimated: tuple[str, ...]
    noise_integrates: bool


@dataclass(frozen=True)
class FeedbackInput:
    """An input that may answer the outputs, with the probability of that by chance."""

    input: str
    probability: float


@dataclass(frozen=True)
class Exploration:
    """How the log was prepared, what was tried, and whether the model deserves trust."""

    channels: Mapping[str, str]
    sample_time: float
    time_unit: str
    samples: int
    segments: tuple[int, ...]
    steps: tuple[str, ...]
    split: str
    loop: tuple[FeedbackInput, ...]
    outputs: tuple[ExploredOutput, ...]
    trusted: bool
    reasons: tuple[str, ...]
    frequency_response: MeasuredLines | None = None
    nonlinearity: Mapping[str, SilentLine] | None = None
