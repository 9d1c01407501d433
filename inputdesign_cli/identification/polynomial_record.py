"""Polynomials in q^-1 against one record: prediction errors, gradients, and what an unknown start adds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.identification.orders import OutputOrders
from inputdesign_cli.identification.predictor import errors_and_gradient
from inputdesign_cli.identification.problem import PredictionErrors
from inputdesign_cli.identification.structure import Structure
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.polynomial import Array

_STEP = 1e-30


@dataclass(frozen=True)
class PolynomialRecord:
    """Samples u (N, r), y (N, p), and the `structure` that is to explain them; see `Record`."""

    structure: Structure
    u: Array
    y: Array

    @property
    def size(self) -> int:
        """Number of parameters k."""
        return self.structure.size

    @cached_property
    def problem(self) -> PredictionErrors:
        """The same as a problem of one run, from rest."""
        return self.structure.problem(self.u[None], self.y[None])

    def errors_and_gradient(self, theta: Array) -> tuple[Array, NDArray[np.float64]]:
        """Prediction errors (N, p) from rest, and psi (k, N, p)."""
        errors, psi = np.empty(self.y.shape), np.zeros((self.size, *self.y.shape))
        for i, (row, place) in enumerate(zip(self.structure.rows, self.structure.places, strict=True)):
            e, own = errors_and_gradient(row, theta[None, place], self.problem.u, self.problem.y[i])
            errors[:, i], psi[place, :, i] = e[:, 0], own[:, :, 0]
        return errors, psi

    def free_responses(self, theta: Array) -> tuple[NDArray[np.float64], ...]:
        """Of each output (m, N): a level, and as many impulses as the filters remember samples.

        (D/C)(A y - sum_j (B_j/F_j) u_j) is off by impulses through 1/C where y, u and the noise before the
        record are missing, by impulses through D/(C F_j) where the state of an entry is, and by a step
        through it where the level of its input is: of a stable F_j the others make that up, of one that
        integrates or nearly does they cannot.
        """
        return tuple(
            _responses(row, theta[place], len(self.y))
            for row, place in zip(self.structure.rows, self.structure.places, strict=True)
        )

    def past_noise(self, theta: Array) -> tuple[NDArray[np.float64], ...]:
        """Of each output (m, N): impulses through 1/C, if there is a C."""
        return tuple(
            _past_noise(row, theta[place], len(self.y))
            for row, place in zip(self.structure.rows, self.structure.places, strict=True)
        )

    def lateness(self, theta: Array) -> int:
        """None: the delay is known, and among what the filters remember."""
        return 0

    @property
    def dead_times(self) -> NDArray[np.int64]:
        """None: delays are whole samples, and known."""
        return np.zeros(0, dtype=np.int64)

    def remembering(self, late: int) -> Self:
        """The same."""
        return self

    @property
    def in_starts(self) -> NDArray[np.int64]:
        """Those of C, D and F."""
        found = [
            place[block.columns]
            for row, place in zip(self.structure.rows, self.structure.places, strict=True)
            for letter in "cdf"
            for block in row.by_letter[letter]
        ]
        return np.unique(np.concatenate(found))

    def free_slopes(self, theta: Array, index: int) -> tuple[NDArray[np.float64], ...]:
        """By a step along the imaginary axis, which loses no digits to a difference ([squire-trapp-1998])."""
        step = np.zeros(theta.size, dtype=complex)
        step[index] = 1j * _STEP
        return tuple(responses.imag / _STEP for responses in self.free_responses(theta + step))

    def noise_in_regressors(self, theta: Array, errors: Array) -> NDArray[np.float64]:
        """(k, N, p): nothing; no instruments are used."""
        return np.zeros((self.size, *errors.shape))

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """(p, N, m): signals (N, m) through D/C of each output."""
        found = []
        for row, place in zip(self.structure.rows, self.structure.places, strict=True):
            p = row.polynomials(theta[None, place])
            found.append(filtered(p.D[0], p.C[0], signals, axis=0))
        return np.array(found)

    def stabilised(self, theta: Array) -> Array:
        """theta with the roots of C, D and F in the unit circle."""
        return self.problem.stabilised(theta[None])[0]


def _responses(row: OutputOrders, theta: Array, samples: int) -> NDArray[np.float64]:
    p = row.polynomials(theta[None])
    older = max([row.a, *(entry.b - entry.f for entry in row.entries)])
    impulses = np.eye(max([older + row.d, *(entry.f for entry in row.entries)], default=0), samples)
    through = [(p.D[0], p.C[0], np.ones((1, samples))), (np.ones(1), p.C[0], impulses[: older + row.d])]
    for entry, F in zip(row.entries, p.F, strict=True):
        if entry.f:
            entering = np.concatenate([impulses[: entry.f], np.ones((1, samples))])
            through.append((p.D[0], np.convolve(p.C[0], F[0]), entering))
    return np.concatenate([filtered(b, a, x) for b, a, x in through if len(x)])


def _past_noise(row: OutputOrders, theta: Array, samples: int) -> NDArray[np.float64]:
    impulses = np.eye(max(row.c, row.a + row.d) if row.c else 0, samples)
    return np.asarray(filtered(np.ones(1), row.polynomials(theta[None]).C[0], impulses))
