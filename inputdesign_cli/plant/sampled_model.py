"""Transfer matrices in s behind a zero-order hold."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.plant.continuous_model import ContinuousModel
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.held import HeldEntry
from inputdesign_cli.plant.intersample import Intersample
from inputdesign_cli.plant.model import Fraction, WhiteNoise
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.plant.transfer import StateSpace


@dataclass(frozen=True)
class SampledModel(WhiteNoise):
    """A transfer matrix in s sampled at `sample_time` behind a zero-order hold; parameters stay those of s.

    Sampling is linear in G, so that the gradient of the sampled plant is the sampled gradient
    dG/da_k = -s^k b / a^2: each entry needs one state-space model of a^2, exact through one exponential.
    """

    continuous_plant: ContinuousModel
    sample_time: float

    continuous = False

    @property
    def outputs(self) -> int:
        """Number of outputs p."""
        return self.continuous_plant.outputs

    @property
    def inputs(self) -> int:
        """Number of inputs r."""
        return self.continuous_plant.inputs

    @property
    def covariance(self) -> Array:
        """(p, p) of e."""
        return self.continuous_plant.covariance

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the k parameters."""
        return self.continuous_plant.names

    @property
    def theta(self) -> Array:
        """(k,): values of the parameters."""
        return self.continuous_plant.theta

    @cached_property
    def _entries(self) -> dict[tuple[int, int], HeldEntry]:
        plant = self.continuous_plant
        return {
            (i, j): HeldEntry.of(plant.numerator[i][j], plant.denominator[i][j], self.sample_time)
            for i, j in plant.active
        }

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> SampledModel:
        """The same structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""
        return SampledModel(self.continuous_plant.at(theta, covariance), self.sample_time)

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """What u (.., n, r), held between samples, causes at the outputs (.., n, p), and e itself."""
        return self.continuous_plant.driven(u, Intersample(self.sample_time, hold=True)), e

    @cached_property
    def poles(self) -> ComplexArray:
        """Poles in z of all entries."""
        return np.exp(self.continuous_plant.poles * self.sample_time)

    @cached_property
    def realisation(self) -> StateSpace:
        """From inputs to outputs, an entry's states beside those of the others."""
        direct = np.zeros((self.outputs, self.inputs))
        blocks = []
        for (i, j), entry in self._entries.items():
            n = entry.order
            B, C = np.zeros((n, self.inputs)), np.zeros((self.outputs, n))
            B[:, j], C[i], direct[i, j] = entry.entry[:n], entry.gain[:n], entry.direct
            blocks.append((entry.transition[:n, :n], B, C))
        return StateSpace.of(blocks, direct)

    @cached_property
    def singularities(self) -> ComplexArray:
        """Poles of G and of all gradients, as points of the frequency plane."""
        return logarithmic_distance(self.poles)

    def entry_singularities(self, output: int, input: int) -> ComplexArray:
        """Poles and zeros of one entry of G, as points of the frequency plane."""
        entry = self._entries.get((output, input))
        return np.zeros(0, dtype=complex) if entry is None else logarithmic_distance(entry.roots)

    def is_fraction(self, output: int, input: int) -> bool:
        """Never: sampled coefficients depend on those of s through an exponential."""
        return False

    def entry_fraction(self, output: int, input: int, w: ArrayLike) -> Fraction:
        """There is none."""
        raise ValueError("a sampled entry is no fraction that is affine in the parameters of s")

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """G (n, p, r)."""
        z = np.exp(1j * np.asarray(w))
        G = np.zeros((z.size, self.outputs, self.inputs), dtype=complex)
        for (i, j), entry in self._entries.items():
            G[:, i, j] = entry.direct + entry.states(z) @ entry.gain
        return G

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """dG/dtheta (n, k, p, r)."""
        z = np.exp(1j * np.asarray(w))
        parameters = self.continuous_plant.parameters
        gradient = np.zeros((z.size, len(parameters), self.outputs, self.inputs), dtype=complex)
        states = {place: entry.states(z) for place, entry in self._entries.items()}
        for index, parameter in enumerate(parameters):
            for place in parameter.places:
                direct, row = self._entries[place].gradient(parameter.letter, parameter.power)
                gradient[:, index, place[0], place[1]] = direct + states[place] @ row
        return gradient
