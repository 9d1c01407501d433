"""A transfer matrix in s against one sampled record: output errors, gradients, regressors, free responses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.start import Start
from inputdesign_cli.plant import ContinuousModel, Intersample
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.held import HeldEntry, integrators, polynomial_roots
from inputdesign_cli.plant.model import DELAY

# A mode that loses less than this over the whole record is not distinguishable from one on the limit.
_LEAST_DECAY = 0.01
# A mode that decays or oscillates this many radians within a sample is a static gain to rounding.
_FASTEST = 1e4
_STEP = 1e-6
# Of a sample: a dead time of zero would be none, and no parameter.
_LEAST_DELAY = 1e-12


def late_samples(dead_time: float, sample_time: float) -> int:
    """Return the samples of a record in which inputs before it act through a dead time; none without one."""
    return int(np.ceil(dead_time / sample_time - 1e-9)) if dead_time > 0.0 else 0


def crossings_of(theta: Array, dead_times: NDArray[np.int64], step: float, samples: int) -> Array:
    """Return steps (m, 2, k) that take a dead time to nearby sampling instants, and half a sample beyond.

    Args:
        theta: (k,), of which `dead_times` are the dead times.
        step, samples: the sample time, and how many there are.
    """
    found = []
    for index in dead_times:
        begun = np.floor(theta[index] / step)
        for instant, beyond in ((begun - 1, -0.5), (begun, -0.5), (begun + 1, 0.5), (begun + 2, 0.5)):
            if 0.0 < instant < samples - 1:
                there = (instant * step - theta[index], (instant + beyond) * step - theta[index])
                found.append(np.outer(there, np.eye(theta.size)[index]))
    return np.array(found).reshape(-1, 2, theta.size)


@dataclass(frozen=True)
class TransferRecord:
    """Samples u (N, r), y (N, p), and the `structure` that is to explain them by parameters theta (k,).

    Unknown inputs before the record act for `late` samples of it, where it does not begin at rest.
    """

    structure: ContinuousModel
    u: Array
    y: Array
    intersample: Intersample
    late: int = 0

    @property
    def samples(self) -> int:
        """Return the number of samples N."""
        return len(self.y)

    @property
    def size(self) -> int:
        """Return the number of parameters k."""
        return len(self.structure.parameters)

    def errors_and_gradient(self, theta: Array) -> tuple[Array, NDArray[np.float64]]:
        """y - G(theta) u (N, p), and the gradient psi (k, N, p) of G(theta) u."""
        model = self.structure.at(theta)
        errors, psi = self.y.copy(), np.zeros((self.size, *self.y.shape))
        for i, j in self.structure.active:
            entry, u = self._entry(model, i, j), self.u[:, j]
            columns = self.intersample.responses(entry, u, hold=self.intersample.hold)
            errors[:, i] -= columns @ entry.gain
            for index, parameter in enumerate(self.structure.parameters):
                if (i, j) in parameter.places:
                    psi[index, :, i] += columns @ entry.gradient(parameter.letter, parameter.power)
        return errors, psi

    def starts(self, theta: Array, *, free: bool) -> tuple[Start, ...]:
        """What the past of each output adds: a level, and what the states of its entries do without an input.

        A level of the input is unknown as well: level and states make it up where poles are stable, not the
        ramp that an integrator makes of it, nor nearly. Inputs before the record that come late by a dead
        time move the states, sample by sample, as if from anywhere.
        """
        if not free:
            return (Start.white(np.zeros((0, self.samples))),) * self.structure.outputs
        model = self.structure.at(theta)
        found = [[np.ones((1, self.samples))] for _ in range(model.outputs)]
        for i, j in model.active:
            found[i].append(self._begun(model, i, j))
        return tuple(Start.white(np.concatenate(parts)) for parts in found)

    def _entering(self, order: int) -> NDArray[np.float64]:
        """Return the unknown signals (m, N) into an entry of `order` poles: impulses, and a level."""
        impulses = np.eye(min(order + self.late, self.samples), self.samples)
        return np.concatenate([impulses, np.ones((int(order > 0), self.samples))])

    def _begun(self, model: ContinuousModel, i: int, j: int) -> NDArray[np.float64]:
        """(m, N): what that adds to the output."""
        entry = self._entry(model, i, j)
        entering = self._entering(entry.order)
        if not len(entering):
            return entering
        poles = np.poly(entry.transition[: entry.order, : entry.order]) if entry.order else np.ones(1)
        return filtered([1.0], poles, entering)

    def lateness(self, theta: Array) -> int:
        """Return the longest dead time in samples, rounded up."""
        return late_samples(self.structure.at(theta).memory, self.intersample.sample_time)

    @cached_property
    def dead_times(self) -> NDArray[np.int64]:
        """Return where the dead times stand in theta."""
        return np.flatnonzero([parameter.letter == DELAY for parameter in self.structure.parameters])

    def crossings(self, theta: Array) -> Array:
        """Return the crossings of the dead times of held inputs; other inputs make none."""
        late = self.dead_times if self.intersample.hold else self.dead_times[:0]
        return crossings_of(theta, late, self.intersample.sample_time, self.samples)

    def remembering(self, late: int) -> Self:
        """Return the record with free responses to inputs before it, which act for `late` samples."""
        return replace(self, late=late)

    def in_starts(self, *, free: bool) -> NDArray[np.int64]:
        """Return the indices of the coefficients of the denominators if the states are free."""
        return np.flatnonzero([free and parameter.letter == "a" for parameter in self.structure.parameters])

    def start_slopes(self, theta: Array, indices: Sequence[int], *, free: bool) -> list[tuple[Start, ...]]:
        """By central differences; of no start from rest."""
        return [self._start_slope(theta, index) for index in indices]

    def _start_slope(self, theta: Array, index: int) -> tuple[Start, ...]:
        parameter = self.structure.parameters[index]
        i, j = parameter.places[0]
        order = self._order(i, j)
        slowest = 1.0 / (self.samples * self.intersample.sample_time)
        size = _STEP * max(abs(theta[index]), slowest ** (order - parameter.power))
        step = size * np.eye(self.size)[index]
        ends = self.structure.at(theta + step), self.structure.at(theta - step)
        found = [[np.zeros((1, self.samples))] for _ in range(self.structure.outputs)]
        for place in self.structure.active:
            if place in parameter.places:
                above, below = (self._begun(end, *place) for end in ends)
                found[place[0]].append((above - below) / (2.0 * size))
            else:
                found[place[0]].append(np.zeros_like(self._entering(self._order(*place))))
        return tuple(Start.white(np.concatenate(parts)) for parts in found)

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """Return the signals (N, m) unchanged for each output (p, N, m), since the noise is white."""
        return np.repeat(signals[None], self.structure.outputs, axis=0)

    def noise_in_regressors(self, theta: Array, errors: Array) -> NDArray[np.float64]:
        """(k, N, p): s^k / a through the errors of the output, for the coefficient a_k of an entry.

        That is what regressors made of measured outputs have beyond those made of the model's. The errors are
        interpolated within their band, and no dead time is between them. Entries of an output with a common
        denominator share it.
        """
        model = self.structure.at(theta)
        found = np.zeros((self.size, *errors.shape))
        filtered: dict[tuple[int, int], NDArray[np.float64]] = {}
        for index, parameter in enumerate(self.structure.parameters):
            if parameter.letter != "a":
                continue
            for i, j in {place[0]: place for place in parameter.places}.values():
                entry = replace(self._entry(model, i, j), delay=None)
                if (i, j) not in filtered:
                    filtered[i, j] = self.intersample.responses(entry, errors[:, i], hold=False)
                power = np.eye(entry.order)[parameter.power]
                found[index, :, i] = filtered[i, j] @ entry.row(power, 1)
        return found

    def stabilised(self, theta: Array) -> Array:
        """Return theta with poles in the right half plane mirrored, and kept off its edge and off infinity.

        Poles that are exactly zero belong to integrators, and stay. Dead times are kept
        positive and below the length of the record.
        """
        step = self.intersample.sample_time
        slowest, fastest = _LEAST_DECAY / (self.samples * step), _FASTEST / step
        out = theta.copy()
        late = self.dead_times
        out[late] = np.clip(out[late], _LEAST_DELAY * step, (self.samples - 1) * step)
        for every in self._denominators:
            columns = every[integrators(np.append(theta[every], 1.0)) :]
            poles = polynomial_roots(np.append(theta[columns], 1.0))
            if np.all(poles.real <= -slowest) and np.all(np.abs(poles) <= fastest):
                continue
            poles = poles * np.minimum(1.0, fastest / np.maximum(np.abs(poles), slowest))
            poles = -np.maximum(np.abs(poles.real), slowest) + 1j * poles.imag
            out[columns] = np.poly(poles).real[:0:-1]
        return out

    def _order(self, i: int, j: int) -> int:
        return self.structure.denominator[i][j].size - 1

    def _entry(self, model: ContinuousModel, i: int, j: int) -> HeldEntry:
        return model.held(i, j, self.intersample.sample_time)

    @cached_property
    def _denominators(self) -> list[NDArray[np.int64]]:
        """Return where the coefficients of each denominator stand in theta."""
        groups: dict[tuple[tuple[int, int], ...], list[int]] = {}
        for index, parameter in enumerate(self.structure.parameters):
            if parameter.letter == "a":
                groups.setdefault(parameter.places, []).append(index)
        return [np.array(indices) for indices in groups.values()]
