"""Model error of a plant with several channels, entry by entry: r_u,ij(w) <= r_adm,ij(w) at every frequency.

Every entry of G is held to its own bound, one requirement each, with the confidence factor alpha of all
parameters of G together, so that all entries hold at once with that probability. A bound on the
largest singular value of the error follows: it is at most sqrt(sum of r_u,ij^2).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.accuracy.admissible import AdmissibleError
from inputdesign_cli.accuracy.model_error import ModelError, real_rows, row_norms
from inputdesign_cli.accuracy.over_frequency import OverFrequency
from inputdesign_cli.accuracy.requirement import inverse_factor
from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.plant import ChannelModel, graded_grid
from inputdesign_cli.plant.polynomial import Array, ComplexArray

_NOWHERE = np.zeros(0)


@dataclass(frozen=True)
class RelativeEntry:
    """r_adm = fraction |G_ij|."""

    model: ChannelModel
    fraction: float
    output: int
    input: int
    knots = _NOWHERE

    @cached_property
    def singularities(self) -> ComplexArray:
        return self.model.entry_singularities(self.output, self.input)

    def at(self, w: ArrayLike) -> Array:
        return self.fraction * np.abs(self.model.plant_at(w)[:, self.output, self.input])


class EntryOfPlant(OverFrequency):
    """What requirements on the model error of an entry have in common: its name, its grid and its r_u."""

    experiment: ChannelExperiment  # type: ignore[assignment]
    admissible: AdmissibleError
    alpha: float
    band: tuple[float, float]
    output: int
    input: int

    @property
    def label(self) -> str:
        """`[2,1]`, as in the names of parameters."""
        return f"[{self.output + 1},{self.input + 1}]"

    @cached_property
    def grid(self) -> Array:
        """Frequencies that see every resonance of the entry, of r_adm and of the noise filter."""
        return entry_grid(
            self.experiment, self.output, self.input, self.own_singularities, self.band, self.knots
        )

    def error_bound(self, information: Array, w: ArrayLike) -> Array:
        """r_u,ij (n,) at frequencies `w`, inside or outside the band, to first order."""
        rows = entry_rows(self.experiment, w, self.output, self.input)
        return self.alpha * row_norms(rows @ inverse_factor(information).T)


@dataclass(frozen=True)
class EntryError(EntryOfPlant, ModelError):
    """The requirement for entry (`output`, `input`), counted from zero; `band` in the experiment's unit."""

    experiment: ChannelExperiment  # type: ignore[assignment]
    output: int = 0
    input: int = 0

    def rows(self, w: ArrayLike) -> NDArray[np.float64]:
        """(n, 2, k): V(w)^T = (alpha / r_adm) T_ij, so that the requirement reads M >= V V^T."""
        rows = entry_rows(self.experiment, w, self.output, self.input)
        return rows * (self.alpha / self.admissible.at(w))[:, None, None]


def entry_rows(experiment: ChannelExperiment, w: ArrayLike, output: int, input: int) -> NDArray[np.float64]:
    """(n, 2, k): real and imaginary parts of the gradient of one entry of G."""
    return real_rows(experiment.plant_gradient(w)[:, :, output, input])


def entry_grid(
    experiment: ChannelExperiment,
    output: int,
    input: int,
    singularities: ComplexArray,
    band: tuple[float, float],
    knots: Array,
) -> Array:
    """Frequencies of a band that see every resonance of one entry of G, of its noise and of a requirement."""
    own = experiment.model.entry_singularities(output, input)
    singular = np.concatenate([own, experiment.singularities, singularities])
    return graded_grid(singular, *band, knots=knots)


def active_entries(model: ChannelModel, highest: float) -> list[tuple[int, int]]:
    """The entries of G that are not zero, probed below the frequency `highest`."""
    probe = np.abs(model.plant_at(np.array([0.12, 0.39]) * highest)).max(axis=0)
    return [(i, j) for i in range(model.outputs) for j in range(model.inputs) if probe[i, j] > 0.0]
