"""Inputs for the model that a controller is designed on: asymptotic theory, limits, exact covariance."""

from inputdesign_cli.design.loop_error.closed_form import best_spectrum as best_spectrum
from inputdesign_cli.design.loop_error.design import (
    LoopErrorDesign as LoopErrorDesign,
    design_loop_error as design_loop_error,
)
from inputdesign_cli.design.loop_error.laws import (
    ControlLaw as ControlLaw,
    InternalModel as InternalModel,
    MinimumVariance as MinimumVariance,
    ModelReference as ModelReference,
)
from inputdesign_cli.design.loop_error.limits import (
    LimitedDesign as LimitedDesign,
    design_within as design_within,
)
from inputdesign_cli.design.loop_error.parametric import ParametricCriterion as ParametricCriterion
from inputdesign_cli.design.loop_error.plant import MatrixPlant as MatrixPlant
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem as LoopErrorProblem
