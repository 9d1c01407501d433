"""Transfer matrices in s behind a zero-order hold."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.continuous_model import ContinuousModel
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.held import HeldEntry, Intersample, integrators
from inputdesign_cli.plant.model import Parameter, WhiteNoise
from inputdesign_cli.plant.transfer import Drive, StateSpace

_KEPT = 2**14  # responses at more points of the unit circle are not cached


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
        """Return the response (.., n, p) to u (.., n, r), held between samples, and e itself."""
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

        The number of simple integrators of the plant is the rank of their gains. Feedback does not move the
        others, which take no part in G.
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
        entries = self._entries.values()
        blocks = [entry.transition[: entry.order, : entry.order] for entry in entries]
        states, drives, start = np.eye(sum(map(len, blocks))), list[Drive](), 0
        C = np.zeros((self.outputs, len(states)))
        for (i, j), entry in self._entries.items():
            own, direct = slice(start, start + entry.order), np.eye(self.outputs)[i] * entry.direct
            start, C[i, own] = own.stop, entry.gain[: entry.order]
            early, late = (states[:, own] @ entry.entries[: entry.order]).T
            drives.append(Drive(j, entry.lag, early, 0.0 * direct))
            drives.append(Drive(j, entry.direct_lag, late, direct))
        return StateSpace.of_delayed_inputs(
            scipy.linalg.block_diag(np.zeros((0, 0)), *blocks), C, drives, self.inputs
        )

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

    @property
    def plant_points(self) -> ComplexArray:
        """Return the poles of G alone, as points of the frequency plane."""
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
        for place, responses in self._responses(z).items():
            G[:, place[0], place[1]] = responses @ self._entries[place].gain
        return G

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the gradient dG/dtheta as (n, k, p, r)."""
        z = np.exp(1j * np.asarray(w))
        gradient = np.zeros((z.size, len(self.parameters), self.outputs, self.inputs), dtype=complex)
        responses = self._responses(z)
        for index, parameter in enumerate(self.parameters):
            for place in parameter.places:
                row = self._entries[place].gradient(parameter.letter, parameter.power)
                gradient[:, index, place[0], place[1]] = responses[place] @ row
        return gradient

    def _responses(self, z: ComplexArray) -> dict[tuple[int, int], ComplexArray]:
        """Return the responses (n, columns) of each entry at points z of the unit circle.

        A loop needs G and its gradient at the same points, one after the other: the last ones are cached.
        """
        key = z.tobytes()
        if key not in self._latest:
            self._latest.clear()
            responses = {place: entry.responses(z) for place, entry in self._entries.items()}
            if z.size > _KEPT:
                return responses
            self._latest[key] = responses
        return self._latest[key]

    @cached_property
    def _latest(self) -> dict[bytes, dict[tuple[int, int], ComplexArray]]:
        return {}
