"""Entries for data: an estimate or measured response, a verdict, and a model that was found in a log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.codec import NULL
from inputdesign_cli.outcome.design import RequirementMet, Rival

Variance = float | tuple[tuple[float, ...], ...]


def variance_of(covariance: Array) -> Variance:
    """Return the variance of the noise of one output, or its covariance (p, p) by rows."""
    return float(covariance[0, 0]) if covariance.size == 1 else tuple(map(tuple, covariance.tolist()))


@dataclass(frozen=True)
class DetectionLines:
    """Holds lines that are not excited, so that nonlinearities of odd and even degree show there."""

    odd: Array
    even: Array


@dataclass(frozen=True)
class SilentLine:
    """Describes the outputs at one kind of lines that are not excited; tuples have an entry per output.

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
    """Holds the lines, the periods that count, and the largest deviation over the admitted one.

    A measurement without lines of a spec has only its method and size, and `model_outside`: the share of
    estimates of G whose confidence disc misses the model (`model_far_outside`: by far).
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


@dataclass(frozen=True)
class Test:
    """Holds a chi-squared test: statistic, degrees of freedom, and the probability of a larger statistic."""

    statistic: float
    degrees_of_freedom: int
    probability: float
    lag: int | None = None


@dataclass(frozen=True)
class PriorAgreement:
    """Holds the probability that prior and data differ as much by chance."""

    probability: float


@dataclass(frozen=True)
class Identification:
    """Holds parameters with standard deviations, variance of the noise, and tests of the residuals.

    A measurement without a model has its `method` alone. `fit_percent` is None for an unstable model.
    """

    method: str | None = None
    theta: Mapping[str, float] | None = None
    standard_deviation: Mapping[str, float] | None = None
    variance: Variance | None = None
    converged: bool | None = None
    steps: int | None = None
    starts: int | None = None
    whiteness: Test | None = None
    independence: Test | None = None
    tests: Mapping[str, Test] | None = None
    failed: tuple[str, ...] | None = None
    free_start: bool | None = None
    rivals: tuple[Rival, ...] | None = None
    ruled_out: tuple[Rival, ...] | None = None
    prior: PriorAgreement | None = None
    records: tuple[int, ...] | None = None
    means_removed: bool | None = None
    operating_point: Mapping[str, float] | None = None
    fit_percent: float | tuple[float | None, ...] | None = None


Verdict = Literal["met", "missed", "undecided"]


@dataclass(frozen=True)
class Neglected:
    """Holds a parameter that the model lacks, and its effect on G relative to the admitted error.

    `may_move` is an upper 95 % limit of this effect.
    """

    parameter: str
    probability: float
    moves: float
    may_move: float
    frequency: float


@dataclass(frozen=True)
class Nominal:
    """Holds the distance of the estimate from the plant of the spec."""

    deviations: float
    statistic: float
    degrees_of_freedom: int
    probability: float
    worst_difference: float | None = None
    opposite_sign: bool | None = None
    within_uncertainty: bool | None = None


@dataclass(frozen=True)
class Assessment:
    """Holds the verdict with its reasons, and the accuracy that a designed top-up would reach.

    `undecided` are the reasons against a verdict that explain all others, `causes` their causes, and `next`
    is the command to run then. `left` is the largest ratio after the top-up, `experiments` how often it has
    to be applied (`periods`: how many periods have to count).
    """

    verdict: Verdict
    met: bool
    requirements: tuple[RequirementMet, ...] = ()
    undecided: tuple[str, ...] | None = None
    causes: tuple[str, ...] | None = None
    next: str | None = None
    neglected: tuple[Neglected, ...] | None = None
    variations: tuple[Neglected, ...] | None = None
    nominal: Nominal | None = None
    frequency_response: MeasuredLines | None = None
    no_top_up: str | None = None
    top_up_status: str | None = None
    left: float | None = None
    experiments: int | None = None
    periods: int | None = None


Fit = float | tuple[float | None, ...] | None
"""Per cent of one output, or of each; None for an unstable model."""


@dataclass(frozen=True)
class Validation:
    """Holds fits of simulation and one-step prediction to data that the estimate has not seen."""

    simulation_fit_percent: Fit = field(default=None, metadata=NULL)
    prediction_fit_percent: Fit = field(default=None, metadata=NULL)
    reasons: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Structure:
    """Holds a structure that was tried: its orders and delays, and its fit.

    `failed` are the tests of its residuals that fail. `certain` is whether no standard deviation of a
    parameter of the plant exceeds half its value (for a dead time, it may be a sample).
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
    """Holds the structure that was chosen for an output, and all that were tried."""

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
    """Holds an input that may depend on the outputs, and the probability that this shows by chance."""

    input: str
    probability: float


@dataclass(frozen=True)
class Exploration:
    """Holds the preparation of the log, the structures tried, and whether the model deserves trust."""

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
