"""What is said of whether data meet what is asked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from inputdesign_cli.outcome.design import RequirementMet
from inputdesign_cli.outcome.response import MeasuredLines

Verdict = Literal["met", "missed", "undecided"]


@dataclass(frozen=True)
class Neglected:
    """A parameter that the model does without: how far it moves G over what is admitted.

    `may_move` is an upper limit of that, with 95 %.
    """

    parameter: str
    probability: float
    moves: float
    may_move: float
    frequency: float


@dataclass(frozen=True)
class Nominal:
    """How far the estimate lies from the plant of the spec."""

    deviations: float
    statistic: float
    degrees_of_freedom: int
    probability: float
    worst_difference: float | None = None
    opposite_sign: bool | None = None
    within_uncertainty: bool | None = None


@dataclass(frozen=True)
class Assessment:
    """The verdict with its reasons, and the accuracy that a designed top-up would reach.

    `undecided` are the reasons against a verdict, `causes` their kinds. `left` is the largest ratio after the
    top-up, `experiments` how often it has to be applied (`periods`: how many periods have to count).
    """

    verdict: Verdict
    met: bool
    requirements: tuple[RequirementMet, ...] = ()
    undecided: tuple[str, ...] | None = None
    causes: tuple[str, ...] | None = None
    neglected: tuple[Neglected, ...] | None = None
    variations: tuple[Neglected, ...] | None = None
    nominal: Nominal | None = None
    frequency_response: MeasuredLines | None = None
    no_top_up: str | None = None
    top_up_status: str | None = None
    left: float | None = None
    experiments: int | None = None
    periods: int | None = None
