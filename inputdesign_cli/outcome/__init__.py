"""What a question returns: typed results, and their form as JSON."""

from inputdesign_cli.outcome.assessment import Assessment, Neglected, Nominal
from inputdesign_cli.outcome.campaign import Campaign
from inputdesign_cli.outcome.codec import OutcomeError, read_plain, write_plain
from inputdesign_cli.outcome.design import (
    Baseline,
    Information,
    LimitUse,
    Loop,
    ModelError,
    Objective,
    Powers,
    RequirementMet,
    Solver,
    Spectrum,
    White,
)
from inputdesign_cli.outcome.estimate import Identification
from inputdesign_cli.outcome.exploration import Exploration, Validation
from inputdesign_cli.outcome.loop_error import ClosedLoopError
from inputdesign_cli.outcome.outcome import Outcome
from inputdesign_cli.outcome.regression import MeanSquaredError, Moments, Sensitivity
from inputdesign_cli.outcome.response import MeasuredLines
from inputdesign_cli.outcome.robust import Robust
from inputdesign_cli.outcome.signal import Signal
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
    "read_plain",
    "write_plain",
]
