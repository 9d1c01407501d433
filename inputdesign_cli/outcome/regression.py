"""What is said of a design for the mean squared error of a reduced-order regression."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.codec import others


@dataclass(frozen=True)
class MeanSquaredError:
    """The error with its parts, squared bias and variance."""

    value: float
    bias_squared: float
    variance: float
    target: float | None = None
    others: Mapping[str, object] = others()


@dataclass(frozen=True)
class Moments:
    """The matrix R (n, n) of the regressors: summed over the samples."""

    structure: str
    estimated: int
    trace: float
    R: Array
    entries: Mapping[str, float]
    autocorrelations: Array | None = None


@dataclass(frozen=True)
class Sensitivity:
    """How the value `of` changes with what the design rests on."""

    of: str
    neglected_norm: float
    noise_deviation: float
    target: float | None = None
    energy: float | None = None
