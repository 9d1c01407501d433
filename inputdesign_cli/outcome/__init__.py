"""Typed results of a question, and their form as JSON."""

from inputdesign_cli.outcome.codec import (
    OutcomeError as OutcomeError,
    plain as plain,
    read_plain as read_plain,
)
from inputdesign_cli.outcome.design import (
    Baseline as Baseline,
    ClosedLoopError as ClosedLoopError,
    Information as Information,
    LimitUse as LimitUse,
    Loop as Loop,
    MeanSquaredError as MeanSquaredError,
    ModelError as ModelError,
    Moments as Moments,
    Objective as Objective,
    Powers as Powers,
    RequirementMet as RequirementMet,
    Sensitivity as Sensitivity,
    Signal as Signal,
    Solver as Solver,
    Spectrum as Spectrum,
    White as White,
)
from inputdesign_cli.outcome.estimate import (
    Assessment as Assessment,
    Identification as Identification,
    MeasuredLines as MeasuredLines,
    Neglected as Neglected,
    Nominal as Nominal,
)
from inputdesign_cli.outcome.results import Outcome as Outcome
from inputdesign_cli.outcome.simulation import Simulation as Simulation
