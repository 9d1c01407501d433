"""Model error of one entry of G over the whole confidence ellipsoid of all parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

from numpy.typing import ArrayLike

from inputdesign_cli.accuracy.ellipsoid import EllipsoidError
from inputdesign_cli.accuracy.model_error_mimo import EntryOfPlant
from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.plant import Fraction


@dataclass(frozen=True)
class EllipsoidEntryError(EntryOfPlant, EllipsoidError):
    """The requirement for entry (`output`, `input`), counted from zero, a fraction affine in theta.

    The ellipsoid is that of the parameters of all entries, which share it.
    """

    experiment: ChannelExperiment  # type: ignore[assignment]
    output: int = 0
    input: int = 0

    def _fraction(self, w: ArrayLike) -> Fraction:
        part = self.experiment.model.entry_fraction(self.output, self.input, w)
        return replace(
            part,
            numerator_gradient=self.experiment.whiten_rows(part.numerator_gradient),
            denominator_gradient=self.experiment.whiten_rows(part.denominator_gradient),
        )
