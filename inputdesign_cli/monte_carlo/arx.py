"""ARX models of many simulated experiments at once: data, least squares, the estimated polynomials."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.signal

from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.plant.polynomial import Array


@dataclass(frozen=True)
class ArxStudy:
    """A y = B u + e with a plant whose F, C and D are 1; arrays are (channels, runs, samples)."""

    plant: MatrixPlant

    @staticmethod
    def fits(plant: MatrixPlant) -> bool:
        """Whether least squares is the prediction-error estimate of this plant."""
        each = [*plant.C, *plant.D, *(f for row in plant.F for f in row)]
        return all(p.size == 1 or not np.any(p[1:]) for p in each)

    def noise(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        """What e contributes to y, (n, runs, samples), from rest."""
        plant = self.plant
        v = rng.standard_normal((plant.outputs, runs, samples))
        root = np.linalg.cholesky(plant.covariance)
        # From the last output up, so that each row of the root still finds the white channels above it.
        for i in reversed(range(plant.outputs)):
            v[i] *= root[i, i]
            for j in np.flatnonzero(root[i, :i]):
                v[i] += root[i, j] * v[j]
        for i, a in enumerate(plant.per_output(plant.A)):
            v[i] = scipy.signal.lfilter([1.0], a, v[i])
        return v

    def outputs(self, u: Array, noise: Array) -> Array:
        """y (n, runs, samples): the response to u from rest, and the noise."""
        plant, y = self.plant, np.empty_like(noise)
        for i, (a, row) in enumerate(zip(plant.per_output(plant.A), plant.B, strict=True)):
            source = np.zeros_like(noise[i])
            for b, channel in zip(row, u, strict=True):
                for lag in np.flatnonzero(b):
                    source[:, lag:] += b[lag] * channel[:, : channel.shape[1] - lag]
            y[i] = scipy.signal.lfilter([1.0], a, source) + noise[i]
        return y

    @cached_property
    def _regressors(self) -> list[list[tuple[str, int, int, int]]]:
        """For each output: (kind, channel, lag, index of the parameter)."""
        plant, names = self.plant, self.plant.names
        single = plant.outputs == plant.inputs == 1
        rows = []
        for i in range(plant.outputs):
            row = []
            for index, name in enumerate(names):
                letter, rest = name[0], name[1:]
                lag, _, place = rest.partition("[")
                channels = [int(c) - 1 for c in place.rstrip("]").split(",")] if place else []
                if letter == "a" and (not channels or channels[0] == i):
                    row.append(("y", i, int(lag), index))
                if letter == "b" and (single or channels[0] == i):
                    row.append(("u", 0 if single else channels[1], int(lag), index))
            rows.append(row)
        return rows

    def estimate(self, u: Array, y: Array) -> Array:
        """theta (runs, k) by least squares, outputs weighted with the inverse covariance of the noise."""
        k, runs, samples = len(self.plant.names), u.shape[1], u.shape[2]
        longest = max(lag for row in self._regressors for _, _, lag, _ in row)
        inverse = np.linalg.inv(self.plant.covariance)
        normal, right = np.zeros((runs, k, k)), np.zeros((runs, k))
        rows = [
            [
                (
                    (-y[channel] if kind == "y" else u[channel])[:, longest - lag : samples - lag],
                    index,
                )
                for kind, channel, lag, index in row
            ]
            for row in self._regressors
        ]
        for i, left in enumerate(rows):
            target = y[:, :, longest:]
            for j, other in enumerate(rows):
                if inverse[i, j] == 0:
                    continue
                for signal, index in left:
                    right[:, index] += inverse[i, j] * _dot(signal, target[j])
                    for again, column in other:
                        if i != j or column >= index:
                            product = inverse[i, j] * _dot(signal, again)
                            normal[:, index, column] += product
                            if i == j and column > index:
                                normal[:, column, index] += product
        return np.asarray(np.linalg.solve(normal, right[:, :, None])[:, :, 0], dtype=float)

    def polynomials(self, theta: Array) -> tuple[Array, Array]:
        """A (runs, n, p) and B (runs, n, m, q) of the estimates, ascending in q^-1."""
        plant = self.plant
        A = np.zeros((theta.shape[0], plant.outputs, max(a.size for a in plant.A)))
        A[:, :, 0] = 1.0
        width = max(b.size for row in plant.B for b in row)
        B = np.zeros((theta.shape[0], plant.outputs, plant.inputs, width))
        for i, row in enumerate(self._regressors):
            for kind, channel, lag, index in row:
                if kind == "y":
                    A[:, i, lag] = theta[:, index]
                else:
                    B[:, i, channel, lag] = theta[:, index]
        return A, B


def _dot(left: Array, right: Array) -> Array:
    return np.einsum("rt,rt->r", left, right)
