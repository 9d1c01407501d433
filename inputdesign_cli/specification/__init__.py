"""Specifications: YAML in, frozen and validated objects out, every diagnostic with its line."""

from inputdesign_cli.specification.loading import load_spec, parse_spec
from inputdesign_cli.specification.models.accuracy import (
    Accuracy,
    Application,
    InformationTarget,
    MeanSquaredError,
    ModelError,
    Sensitivity,
    WeightedVariance,
)
from inputdesign_cli.specification.models.control import (
    ClosedLoopError,
    ContinuousMatrixTransfer,
    Control,
    DiscreteMatrix,
    Reference,
)
from inputdesign_cli.specification.models.experiment import Cost, Experiment, Noise, Prior, SimulationNoise
from inputdesign_cli.specification.models.limits import Limits, PowerLimit, SpectrumLimit, TableFile
from inputdesign_cli.specification.models.plant import (
    ContinuousMatrix,
    ContinuousPlant,
    PolynomialPlant,
    RegressionPlant,
    TrueParameters,
)
from inputdesign_cli.specification.models.realisation import Signal, Simulation, Solver
from inputdesign_cli.specification.models.report import Report
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.spectrum import (
    FirSpectrum,
    FreeSpectrum,
    GivenMultisine,
    GivenSignal,
    GivenSpectrum,
    GivenTable,
    GivenWhite,
    MomentsSpectrum,
    MultisineSpectrum,
    PointwiseSpectrum,
    PolynomialSpectrum,
    WhiteSpectrum,
)
from inputdesign_cli.specification.models.sweep import Sweep
from inputdesign_cli.specification.models.transfer import (
    ContinuousRatio,
    ContinuousTransfer,
    DiscreteTransfer,
)
from inputdesign_cli.specification.schema import json_schema
from inputdesign_cli.specification.template import SpecTemplate, read_template

__all__ = [
    "Accuracy",
    "Application",
    "ClosedLoopError",
    "ContinuousMatrix",
    "ContinuousMatrixTransfer",
    "ContinuousPlant",
    "ContinuousRatio",
    "ContinuousTransfer",
    "Control",
    "Cost",
    "DiscreteMatrix",
    "DiscreteTransfer",
    "Experiment",
    "FirSpectrum",
    "FreeSpectrum",
    "GivenMultisine",
    "GivenSignal",
    "GivenSpectrum",
    "GivenTable",
    "GivenWhite",
    "InformationTarget",
    "Limits",
    "MeanSquaredError",
    "ModelError",
    "MomentsSpectrum",
    "MultisineSpectrum",
    "Noise",
    "PointwiseSpectrum",
    "PolynomialPlant",
    "PolynomialSpectrum",
    "PowerLimit",
    "Prior",
    "Reference",
    "RegressionPlant",
    "Report",
    "Sensitivity",
    "Signal",
    "Simulation",
    "SimulationNoise",
    "Solver",
    "Spec",
    "SpecTemplate",
    "SpectrumLimit",
    "Sweep",
    "TableFile",
    "TrueParameters",
    "WeightedVariance",
    "WhiteSpectrum",
    "json_schema",
    "load_spec",
    "parse_spec",
    "read_template",
]
