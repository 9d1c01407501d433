"""Specifications: YAML in, frozen and validated objects out, every diagnostic with its line."""

from inputdesign_cli.specification.loading import (
    SpecTemplate,
    is_prior,
    load_estimate,
    load_spec,
    moved_names,
    parse_spec,
    read_template,
    relocated,
    renamed,
    same_content,
)
from inputdesign_cli.specification.models.accuracy import FrequencyResponse, ModelError
from inputdesign_cli.specification.models.experiment import Noise, SimulationNoise
from inputdesign_cli.specification.models.loop import ClosedLoopError
from inputdesign_cli.specification.models.plant import PolynomialPlant
from inputdesign_cli.specification.models.realisation import Simulation
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.sweep import Sweep
from inputdesign_cli.specification.python_control import from_control
from inputdesign_cli.specification.schema import json_schema

__all__ = [
    "ClosedLoopError",
    "FrequencyResponse",
    "ModelError",
    "Noise",
    "PolynomialPlant",
    "Simulation",
    "SimulationNoise",
    "Spec",
    "SpecTemplate",
    "Sweep",
    "from_control",
    "is_prior",
    "json_schema",
    "load_estimate",
    "load_spec",
    "moved_names",
    "parse_spec",
    "read_template",
    "relocated",
    "renamed",
    "same_content",
]
