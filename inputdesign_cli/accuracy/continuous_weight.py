"""A weight in s, for what is required of a plant in continuous time."""

from inputdesign_cli.plant import ContinuousRational as ContinuousWeight
from inputdesign_cli.plant import ScalarTransfer
from inputdesign_cli.plant.polynomial import ComplexArray

__all__ = ["ContinuousWeight", "weight_singularities"]


def weight_singularities(weight: ScalarTransfer) -> ComplexArray:
    """Poles and zeros as points frequency + j damping."""
    return weight.singularities
