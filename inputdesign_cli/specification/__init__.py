"""Specifications: YAML in, frozen and validated objects out, every diagnostic with its line."""

from inputdesign_cli.specification.loading import load_spec, parse_spec
from inputdesign_cli.specification.models.accuracy import ModelError
from inputdesign_cli.specification.models.control import ClosedLoopError
from inputdesign_cli.specification.models.experiment import Noise, SimulationNoise
from inputdesign_cli.specification.models.plant import (
    ContinuousPlant,
    PolynomialPlant,
    RegressionPlant,
    TrueParameters,
)
from inputdesign_cli.specification.models.realisation import Simulation
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.spectrum import (
    FreeSpectrum,
    MomentsSpectrum,
    PointwiseSpectrum,
    PolynomialSpectrum,
)
from inputdesign_cli.specification.models.sweep import Sweep
from inputdesign_cli.specification.models.transfer import (
    ContinuousMatrixTransfer,
    ContinuousTransfer,
    DiscreteMatrix,
    DiscreteTransfer,
)
from inputdesign_cli.specification.schema import json_schema
from inputdesign_cli.specification.template import SpecTemplate, read_template

__all__ = [
    "ClosedLoopError",
    "ContinuousMatrixTransfer",
    "ContinuousPlant",
    "ContinuousTransfer",
    "DiscreteMatrix",
    "DiscreteTransfer",
    "FreeSpectrum",
    "ModelError",
    "MomentsSpectrum",
    "Noise",
    "PointwiseSpectrum",
    "PolynomialPlant",
    "PolynomialSpectrum",
    "RegressionPlant",
    "Simulation",
    "SimulationNoise",
    "Spec",
    "SpecTemplate",
    "Sweep",
    "TrueParameters",
    "json_schema",
    "load_spec",
    "parse_spec",
    "read_template",
]
