"""What is said of a design for the error of the loop with the controller designed on the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class LossMoments:
    """Mean, standard deviation and (of runs) standard error."""

    mean: float
    sd: float
    standard_error: float | None = None


@dataclass(frozen=True)
class TheoreticalLoss:
    """N E||y - y0||^2 of the model structure, and the moments of its root."""

    value: float
    loss: LossMoments


@dataclass(frozen=True)
class ActivePower:
    """A power limit of the design, what is attained, and its multiplier."""

    power: str
    max: float
    attained: float
    channel: int | None = None
    multiplier: float | None = None


@dataclass(frozen=True)
class ClosedLoopError:
    """The control law, the covariance that was used, and what theory expects; `band` in rad per time unit."""

    law: str
    covariance: str
    expected: float
    band: tuple[float, float]
    noise_model_part: float
    parametric: Mapping[str, TheoreticalLoss]
    limits: tuple[ActivePower, ...] = ()
