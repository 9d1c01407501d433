"""Entries for many simulated experiments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.codec import others
from inputdesign_cli.outcome.design import LossMoments, Powers, TheoreticalLoss
from inputdesign_cli.outcome.estimate import Variance

Limits = tuple[float, float]


@dataclass(frozen=True)
class Spread:
    """Holds the mean over the runs, and the value that 95 % of them stay below."""

    mean: float
    quantile_95: float | None = None
    at_most_one: float | None = None


@dataclass(frozen=True)
class Range:
    """Holds the least, largest and mean ratio over lines and entries."""

    least: float
    largest: float
    mean: float


@dataclass(frozen=True)
class Violations:
    """Holds runs beyond r_adm: number, quantiles 0.05, 0.5, 0.95 of their frequency, the largest ratio."""

    runs: int
    frequency_quantiles: Array
    largest_ratio: float


@dataclass(frozen=True)
class RatioAt:
    """Holds a largest ratio and its frequency."""

    worst_ratio: float
    frequency: float


@dataclass(frozen=True)
class TheoryOfError:
    """Holds the mean squared error and the mean estimate in theory."""

    mse: float
    mean_estimate: tuple[float, ...]


@dataclass(frozen=True)
class OnDesignModel:
    """Holds fractions of runs in which the true system is the design model."""

    within_r_adm: float | None = None
    within_r_adm_limits: Limits | None = None
    within_r_u: float | None = None
    within_r_u_limits: Limits | None = None
    within_promised_r_u: float | None = None
    within_promised_r_u_limits: Limits | None = None


@dataclass(frozen=True)
class ExactLoss:
    """Holds the loss and its square for each run by H2 norms."""

    loss: LossMoments
    squared: LossMoments


@dataclass(frozen=True)
class Searched:
    """Holds the numbers of records searched from several starts, ended elsewhere, and with rival minima."""

    runs: int
    elsewhere: int
    rivals: int


@dataclass(frozen=True)
class TriedInput(OnDesignModel):
    """Holds the results of the runs with one input; each kind of question fills its own fields.

    `within_*` are fractions of runs whose error stays within a bound at all frequencies, with 95 % limits.
    """

    within_r_adm_true: float | None = None
    within_r_adm_true_limits: Limits | None = None
    within_r_adm_estimate: float | None = None
    within_r_adm_estimate_limits: Limits | None = None
    on_design_model: OnDesignModel | None = None
    mean_estimate: Mapping[str, float] | Array | None = None
    mean_estimate_standard_error: Array | None = None
    covariance_eigenvalues: Array | None = None
    rms_over_theory: Mapping[str, float] | None = None
    theory_on_truth: RatioAt | None = None
    violations: Violations | None = None
    cost: float | None = None
    power: Powers | tuple[float, ...] | None = None
    total_power: Powers | None = None
    not_converged: int | None = None
    loss: LossMoments | None = None
    squared: LossMoments | None = None
    exact: ExactLoss | None = None
    theory: TheoreticalLoss | TheoryOfError | None = None
    unstable: int | None = None
    mse: float | None = None
    mse_standard_error: float | None = None
    energy: Spread | float | None = None
    deviation_ratio: Range | None = None
    chance: Limits | None = None
    worst_ratio: float | None = None
    bias: float | None = None
    true_ratio: Spread | None = None
    cost_over_oracle: Spread | None = None
    cost_over_oracle_record: Spread | None = None
    samples: Spread | None = None
    stopped: int | None = None
    missed: int | None = None
    undecided: int | None = None
    unplanned: int | None = None
    parts: Spread | None = None
    shrunk: int | None = None
    searched: Searched | None = None


@dataclass(frozen=True)
class Improvement:
    """Holds one minus the loss of the design over that of white noise: in the runs and in theory."""

    measured: float
    theory: float


@dataclass(frozen=True)
class Simulation:
    """Holds the Monte Carlo study: its settings, and the results with each input."""

    runs: int
    seed: int
    inputs: Mapping[str, TriedInput]
    samples: int | None = None
    excitation: str | None = None
    parameters: tuple[str, ...] | None = None
    true_parameters: Mapping[str, float] | None = None
    true_variance: Variance | None = None
    wishart_range: tuple[float, ...] | None = None
    improvement: Improvement | None = None
    oracle_cost: float | None = None
    oracle_record_cost: float | None = None
    others: Mapping[str, object] = others()
