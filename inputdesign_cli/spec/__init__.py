"""The spec room: YAML in, frozen and validated objects out, every complaint with its line."""

from inputdesign_cli.spec.accuracy import (
    Accuracy,
    Application,
    InformationTarget,
    MeanSquaredError,
    ModelError,
    Sensitivity,
    WeightedVariance,
)
from inputdesign_cli.spec.control import (
    ClosedLoopError,
    ContinuousMatrixTransfer,
    Control,
    DiscreteMatrix,
    Reference,
)
from inputdesign_cli.spec.draft import Draft, read_draft
from inputdesign_cli.spec.experiment import Cost, Experiment, Noise, Prior, SimulationNoise
from inputdesign_cli.spec.limits import Limits, PowerLimit, SpectrumLimit, TableFile
from inputdesign_cli.spec.loading import load_spec, parse_spec
from inputdesign_cli.spec.model import Spec
from inputdesign_cli.spec.plant import (
    ContinuousMatrix,
    ContinuousPlant,
    PolynomialPlant,
    RegressionPlant,
    TrueParameters,
)
from inputdesign_cli.spec.realisation import Signal, Simulation, Solver
from inputdesign_cli.spec.report import Report
from inputdesign_cli.spec.schema import json_schema
from inputdesign_cli.spec.spectrum import (
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
from inputdesign_cli.spec.sweep import Sweep
from inputdesign_cli.spec.transfer import ContinuousRatio, ContinuousTransfer, DiscreteTransfer

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
    "Draft",
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
    "SpectrumLimit",
    "Sweep",
    "TableFile",
    "TrueParameters",
    "WeightedVariance",
    "WhiteSpectrum",
    "json_schema",
    "load_spec",
    "parse_spec",
    "read_draft",
]
