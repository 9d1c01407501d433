"""Transfer matrices in s behind a zero-order hold."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.continuous_model import ContinuousModel
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.held import HeldEntry, Intersample, integrators
from inputdesign_cli.plant.model import Parameter, WhiteNoise
from inputdesign_cli.plant.transfer import StateSpace


@dataclass(frozen=True)
class SampledModel(WhiteNoise):
    """A transfer matrix in s sampled at `sample_time` behind a zero-order hold; parameters stay in s.

    Sampling is linear in G: the gradient of the sampled plant is the sampled dG/da_k = -s^k b / a^2. Each
    entry needs one state-space model of a^2, exact through one exponential.
    """

    continuous_plant: ContinuousModel
    sample_time: float

    continuous = False
    integrates = False

    @property
    def outputs(self) -> int:
        """Return the number of outputs p."""
        return self.continuous_plant.outputs

    @property
    def inputs(self) -> int:
        """Return the number of inputs r."""
        return self.continuous_plant.inputs

    @property
    def covariance(self) -> Array:
        """Return the covariance (p, p) of e."""
        return self.continuous_plant.covariance

    @cached_property
    def at_once(self) -> NDArray[np.bool_]:
        """Return the entries of G that may act without delay, (p, r), see `Model`."""
        found = np.zeros((self.outputs, self.inputs), dtype=bool)
        for place, entry in self._entries.items():
            found[place] = entry.biproper and not entry.direct_lag
        return found

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return the k parameters, which belong to the plant in s."""
        return self.continuous_plant.parameters

    @cached_property
    def _entries(self) -> dict[tuple[int, int], HeldEntry]:
        plant = self.continuous_plant
        return {(i, j): plant.held(i, j, self.sample_time) for i, j in plant.active}

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> SampledModel:
        """Return the structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""
        return SampledModel(self.continuous_plant.at(theta, covariance), self.sample_time)

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """Return the outputs that u (.., n, r), held between samples, and e itself cause."""
        return self.continuous_plant.driven(u, Intersample(self.sample_time, hold=True)), e

    @cached_property
    def poles(self) -> ComplexArray:
        """Return the poles in z of all entries."""
        return np.exp(self.continuous_plant.poles * self.sample_time)

    @property
    def radius(self) -> float:
        """See `Model`."""
        return float(np.abs(self.poles).max(initial=0.0))

    @cached_property
    def repeated_integrators(self) -> int:
        """Return the excess of the integrators of single entries over the integrators of the plant.

        The plant has as many simple ones as their gains have rank. No feedback moves the others, for they
        take no part in G.
        """
        gains, simple = np.zeros((self.outputs, self.inputs)), 0
        for (i, j), entry in self._entries.items():
            count = integrators(entry.denominator)
            if count > 1:
                return 0
            gains[i, j] = count and entry.numerator[0] / entry.denominator[1]
            simple += count
        scale = max(float(np.abs(gains).max(initial=0.0)), 1e-300)
        return simple - int(np.linalg.matrix_rank(gains / scale))

    @cached_property
    def realisation(self) -> StateSpace:
        """Return a realisation whose states are the past of each input, then the states of each entry."""
        lags = [(j, entry.direct_lag) for (_, j), entry in self._entries.items()]
        past = [max((lag for other, lag in lags if other == j), default=0) for j in range(self.inputs)]
        first = np.concatenate([[0], np.cumsum(past)]).astype(int)
        orders = [entry.order for entry in self._entries.values()]
        size = int(first[-1]) + sum(orders)
        A, B = np.zeros((size, size)), np.zeros((size, self.inputs))
        C, D = np.zeros((self.outputs, size)), np.zeros((self.outputs, self.inputs))
        for j, length in enumerate(past):
            A[first[j] : first[j + 1], first[j] : first[j + 1]] = np.eye(length, k=-1)
            if length:
                B[first[j], j] = 1.0

        def read(into: Array, at_once: Array, j: int, lag: int, column: Array) -> None:
            """Let a column read u_j(k - lag), off the past or off the input itself."""
            if lag:
                into[:, first[j] + lag - 1] += column
            else:
                at_once[:, j] += column

        start = int(first[-1])
        for (i, j), entry in self._entries.items():
            own = slice(start, start + entry.order)
            start += entry.order
            A[own, own], C[i, own] = entry.transition[: entry.order, : entry.order], entry.gain[: entry.order]
            early, late = entry.entries[: entry.order].T
            read(A[own], B[own], j, entry.lag, early)
            if np.any(late):
                read(A[own], B[own], j, entry.lag + 1, late)
            read(C[i : i + 1], D[i : i + 1], j, entry.direct_lag, np.array([entry.direct]))
        return StateSpace(A, B, C, D)

    @property
    def noise_gain(self) -> Array:
        """See `SampledPlant`: e enters through the outputs alone."""
        return np.zeros((len(self.realisation.A), self.outputs))

    @property
    def predictor_poles(self) -> ComplexArray:
        """See `SampledPlant`."""
        return self.poles

    def left_at(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return I and G, which has no poles outside the unit circle."""
        return self.forcing_at(w), self.plant_at(w)

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return the poles of G and of all gradients, as points of the frequency plane."""
        return logarithmic_distance(self.poles)

    def entry_singularities(self, output: int, input: int) -> ComplexArray:
        """Return the poles and zeros of one entry of G, as points of the frequency plane."""
        entry = self._entries.get((output, input))
        return np.zeros(0, dtype=complex) if entry is None else logarithmic_distance(entry.roots)

    @property
    def memory(self) -> float:
        """Return the longest dead time in samples, its fraction of a sample counted as a whole one."""
        return max((entry.lag + 1.0 for entry in self._entries.values() if entry.delay), default=0.0)

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """Return the frequency response G as (n, p, r)."""
        z = np.exp(1j * np.asarray(w))
        G = np.zeros((z.size, self.outputs, self.inputs), dtype=complex)
        for (i, j), entry in self._entries.items():
            G[:, i, j] = entry.responses(z) @ entry.gain
        return G

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the gradient dG/dtheta as (n, k, p, r)."""
        z = np.exp(1j * np.asarray(w))
        gradient = np.zeros((z.size, len(self.parameters), self.outputs, self.inputs), dtype=complex)
        responses = {place: entry.responses(z) for place, entry in self._entries.items()}
        for index, parameter in enumerate(self.parameters):
            for place in parameter.places:
                row = self._entries[place].gradient(parameter.letter, parameter.power)
                gradient[:, index, place[0], place[1]] = responses[place] @ row
        return gradient
