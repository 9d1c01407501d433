"""Polynomials in q^-1 against one record: prediction errors, gradients, and what an unknown start adds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.orders import OutputOrders
from inputdesign_cli.identification.predictor import errors_and_gradient
from inputdesign_cli.identification.problem import PredictionErrors
from inputdesign_cli.identification.start import Start, density, each_later, noise_before
from inputdesign_cli.identification.structure import Structure
from inputdesign_cli.plant.filtering import filtered

_STEP = 1e-30


@dataclass(frozen=True)
class PolynomialRecord:
    """Samples u (N, r), y (N, p), and the `structure` that is to explain them; see `Record`."""

    structure: Structure
    u: Array
    y: Array

    @property
    def size(self) -> int:
        """Return the number of parameters k."""
        return self.structure.size

    @cached_property
    def problem(self) -> PredictionErrors:
        """Return the record as a problem of one run, from rest."""
        return self.structure.problem(self.u[None], self.y[None])

    def errors_and_gradient(self, theta: Array) -> tuple[Array, NDArray[np.float64]]:
        """Return prediction errors (N, p) from rest, and psi (k, N, p)."""
        errors, psi = np.empty(self.y.shape), np.zeros((self.size, *self.y.shape))
        for i, (row, place) in enumerate(zip(self.structure.rows, self.structure.places, strict=True)):
            e, own = errors_and_gradient(row, theta[None, place], self.problem.u, self.problem.y[i])
            errors[:, i], psi[place, :, i] = e[:, 0], own[:, :, 0]
        return errors, psi

    def starts(self, theta: Array, *, free: bool) -> tuple[Start, ...]:
        """Return the starts, output by output.

        The noise model D/C is applied to A y - sum_j (B_j/F_j) u_j. This sum is off by impulses if y and u
        before the record are missing. It is off by impulses through 1/F_j if the state of an entry is,
        and by a step through it if the level of its input is. For a stable F_j the others make up for the
        step, but not if F_j integrates or nearly does. From rest only y is missing, which noise has moved.
        That matters only if the predictor remembers y beyond its order.
        """
        return tuple(
            _start(row, theta[place], len(self.y), free=free)
            for row, place in zip(self.structure.rows, self.structure.places, strict=True)
        )

    def lateness(self, theta: Array) -> int:
        """Return by how many samples B looks back further than F."""
        entries = (entry for row in self.structure.rows for entry in row.entries)
        return max([0, *(entry.b - entry.f for entry in entries)])

    @property
    def dead_times(self) -> NDArray[np.int64]:
        """Return no indices: delays are whole samples, and known."""
        return np.zeros(0, dtype=np.int64)

    def crossings(self, theta: Array) -> Array:
        """Return no steps."""
        return np.zeros((0, 2, self.size))

    def remembering(self, late: int) -> Self:
        """Return the record unchanged: the filters remember known delays."""
        return self

    def in_starts(self, *, free: bool) -> NDArray[np.int64]:
        """Return the indices of the coefficients of C and D; of F as well if the states are free."""
        found = [
            place[block.columns]
            for row, place in zip(self.structure.rows, self.structure.places, strict=True)
            for letter in ("cdf" if free else "cd")
            for block in row.by_letter[letter]
        ]
        return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *found]))

    def start_slopes(self, theta: Array, indices: Sequence[int], *, free: bool) -> list[tuple[Start, ...]]:
        """By steps along the imaginary axis, which lose no digits to a difference ([squire-trapp-1998])."""
        still = (
            [start.still for start in self.starts(theta, free=free)] if len(self.structure.rows) > 1 else []
        )
        found = []
        for index in indices:
            step = np.zeros(theta.size, dtype=complex)
            step[index] = 1j * _STEP
            slopes = []
            for i, (row, place) in enumerate(zip(self.structure.rows, self.structure.places, strict=True)):
                if index in place:
                    start = _start(row, (theta + step)[place], len(self.y), free=free)
                    slopes.append(Start(*(block.imag / _STEP for block in start)))
                else:
                    slopes.append(still[i])
            found.append(tuple(slopes))
        return found

    def noise_in_regressors(self, theta: Array, errors: Array) -> NDArray[np.float64]:
        """Return zeros (k, N, p): no instruments are used."""
        return np.zeros((self.size, *errors.shape))

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """Return signals (N, m) through D/C of each output (p, N, m)."""
        found = []
        for row, place in zip(self.structure.rows, self.structure.places, strict=True):
            p = row.polynomials(theta[None, place])
            found.append(filtered(p.D[0], p.C[0], signals, axis=0))
        return np.array(found)

    def stabilised(self, theta: Array) -> Array:
        """Return theta with the roots of C, D and F in the unit circle."""
        return self.problem.stabilised(theta[None])[0]


def _start(row: OutputOrders, theta: Array, samples: int, *, free: bool) -> Start:
    """Impulses, and levels, with what 1/F makes of them; each is filtered once, and delayed."""
    p = row.polynomials(theta[None])
    C, D = p.C[0], p.D[0]
    impulse, level = np.eye(1, samples, dtype=theta.dtype)[0], np.ones(samples)
    if free:
        most = max([row.a, *(entry.b - entry.f for entry in row.entries)])
        parts = [(level, 1), (impulse, most)]
        for entry, F in zip(row.entries, p.F, strict=True):
            if entry.f:
                parts += [(filtered([1.0], F[0], impulse), entry.f), (filtered([1.0], F[0], level), 1)]
    else:
        parts = [(impulse, row.a if row.c else 0)]
    disturbance = np.concatenate([each_later(one, count) for one, count in parts])
    if C.size == D.size == 1:
        return Start.white(disturbance)
    through = np.concatenate([each_later(filtered(D, C, one), count) for one, count in parts])
    zeros = density(C) if row.c else np.zeros(())
    return Start(through, disturbance, noise_before(C, D, samples), zeros)
