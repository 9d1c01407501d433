"""What is said of an estimate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from inputdesign_cli.outcome.design import Rival


@dataclass(frozen=True)
class Test:
    """A chi-squared test: statistic, degrees of freedom, and the probability of more by chance."""

    statistic: float
    degrees_of_freedom: int
    probability: float
    lag: int | None = None


@dataclass(frozen=True)
class PriorAgreement:
    """The probability that prior and data differ as much by chance."""

    probability: float


@dataclass(frozen=True)
class Identification:
    """Parameters by name with standard deviations, variance of the noise, and tests of the residuals.

    A measurement without a model has its `method` alone. `fit_percent` is None for an unstable model.
    """

    method: str | None = None
    theta: Mapping[str, float] | None = None
    standard_deviation: Mapping[str, float] | None = None
    variance: float | tuple[tuple[float, ...], ...] | None = None
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
