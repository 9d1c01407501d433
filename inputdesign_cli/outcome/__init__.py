"""What a question returns: typed results, and their form as JSON."""

from inputdesign_cli.outcome.campaign import Campaign
from inputdesign_cli.outcome.codec import OutcomeError, plain, read_plain
from inputdesign_cli.outcome.design import (
    Baseline,
    ClosedLoopError,
    Information,
    LimitUse,
    Loop,
    MeanSquaredError,
    ModelError,
    Moments,
    Objective,
    Powers,
    RequirementMet,
    Sensitivity,
    Signal,
    Solver,
    Spectrum,
    White,
)
from inputdesign_cli.outcome.estimate import (
    Assessment,
    Exploration,
    Identification,
    Neglected,
    Nominal,
    Validation,
)
from inputdesign_cli.outcome.outcome import Outcome
from inputdesign_cli.outcome.response import MeasuredLines
from inputdesign_cli.outcome.robust import Robust
from inputdesign_cli.outcome.simulation import Simulation

__all__ = [
    "Assessment",
    "Baseline",
    "Campaign",
    "ClosedLoopError",
    "Exploration",
    "Identification",
    "Information",
    "LimitUse",
    "Loop",
    "MeanSquaredError",
    "MeasuredLines",
    "ModelError",
    "Moments",
    "Neglected",
    "Nominal",
    "Objective",
    "Outcome",
    "OutcomeError",
    "Powers",
    "RequirementMet",
    "Robust",
    "Sensitivity",
    "Signal",
    "Simulation",
    "Solver",
    "Spectrum",
    "Validation",
    "White",
    "plain",
    "read_plain",
]
