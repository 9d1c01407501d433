"""State-space models with an innovations form, sampled behind a hold or in discrete time.

x(t + 1) = A x(t) + B u(t) + K e(t), y(t) = C x(t) + D u(t) + e(t) ([ljung-1999], Section 4.3). The predictor
x^(t + 1) = (A - K C) x^ + (B - K D) u + K y has the gradient

    dx^(t + 1) = (A - K C) dx^ + (dA - K dC) x^ + (dB - K dD) u + dK e ,   dy^ = C dx^ + dC x^ + dD u ,

stable with A - K C, whatever A is. Matrices in continuous time are sampled by a matrix exponential, with the
derivatives in its off-diagonal block ([van-loan-1978]); K is the gain of the sampled model.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.held import whole_samples
from inputdesign_cli.plant.model import DELAY, Parameter, Parametrised, Signals
from inputdesign_cli.plant.transfer import Drive, StateSpace

# Nearer to a pole at z = 1 than this, in rad/sample, the response at this distance is taken.
_BESIDE = 1e-8
_INTEGRATES = 1e-7


class Matrices(NamedTuple):
    """Holds A (n, n), B (n, r), C (p, n), D (p, r), K (n, p), and the dead time of the inputs."""

    A: Array
    B: Array
    C: Array
    D: Array
    K: Array
    delay: float


class Slope(NamedTuple):
    """Holds the derivatives of A, C, D and K, and of the gains of u(t - d) and u(t - d - 1) on the states."""

    A: Array
    early: Array
    late: Array
    C: Array
    D: Array
    K: Array


@dataclass(frozen=True)
class StateSpaceModel(Parametrised):
    """A state-space model as above; e is white with a full covariance (p, p).

    With a `sample_time` the matrices are in continuous time, behind a hold, otherwise of samples. The free
    `entries` are letter, row and column, and ("delay", 0, 0) for the dead time.
    """

    matrices: Matrices
    entries: tuple[tuple[str, int, int], ...]
    covariance: Array
    sample_time: float | None = None

    continuous = False
    integrates = False
    repeated_integrators = 0

    @property
    def outputs(self) -> int:
        """Return the number of outputs p."""
        return len(self.matrices.C)

    @property
    def inputs(self) -> int:
        """Return the number of inputs r."""
        return self.matrices.B.shape[1]

    @property
    def order(self) -> int:
        """Return the number of states n."""
        return len(self.matrices.A)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return the free entries."""
        found = []
        for letter, i, j in self.entries:
            value = self.matrices.delay if letter == DELAY else self._table[letter][i, j]
            label = "" if letter == DELAY else f"[{i + 1},{j + 1}]"
            found.append(Parameter(letter, 0, ((i, j),), label, float(value)))
        return tuple(found)

    @cached_property
    def at_once(self) -> NDArray[np.bool_]:
        """Return the entries of G that may act without delay, (p, r), see `Model`."""
        found = self.matrices.D != 0.0
        for letter, i, j in self.entries:
            if letter == "D":
                found[i, j] = True
        return found & (self.direct_lag == 0)

    @property
    def _table(self) -> dict[str, Array]:
        m = self.matrices
        return {"A": m.A, "B": m.B, "C": m.C, "D": m.D, "K": m.K}

    @cached_property
    def in_plant(self) -> NDArray[np.bool_]:
        """Return a mask (k,) of all entries except the entries of K."""
        return np.array([letter != "K" for letter, _, _ in self.entries], dtype=bool)

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> StateSpaceModel:
        """Return the structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""
        table, delay = {letter: M.copy() for letter, M in self._table.items()}, self.matrices.delay
        for (letter, i, j), value in zip(self.entries, np.asarray(theta, dtype=float), strict=True):
            if letter == DELAY:
                delay = float(value)
            else:
                table[letter][i, j] = value
        return replace(
            self,
            matrices=Matrices(**table, delay=delay),
            covariance=self.covariance if covariance is None else covariance,
        )

    @cached_property
    def _split(self) -> tuple[int, float]:
        """Return the whole samples of the dead time, and the remaining fraction."""
        return (0, 0.0) if self.sample_time is None else whole_samples(self.matrices.delay, self.sample_time)

    @property
    def lag(self) -> int:
        """Return d, the whole samples of the dead time."""
        return self._split[0]

    @property
    def direct_lag(self) -> int:
        """Return the delay of the direct gain, in samples."""
        return self.lag + (self._split[1] > 0.0)

    @cached_property
    def held(self) -> tuple[Array, Array, Array]:
        """Return A of the samples, and the matrices by which u(t - d) and u(t - d - 1) enter the states."""
        whole, early, _ = self._exponentials(None)
        return whole[0], early, whole[1] - early

    def _exponentials(self, moved: Array | None) -> tuple[tuple[Array, Array], Array, Array]:
        """Return A and B over a sample, B over its rest after the fraction, and A over that rest.

        If [A B] is `moved` in a direction (n, n + r), the derivatives in that direction instead.
        """
        n, m = self.order, self.matrices
        if self.sample_time is None:
            A, B = (m.A, m.B) if moved is None else (moved[:, :n], moved[:, n:])
            return (A, B), B, A
        size = n + self.inputs
        system = np.zeros((size, size))
        system[:n] = np.concatenate([m.A, m.B], axis=1)
        if moved is not None:
            slope = np.zeros((size, size))
            slope[:n] = moved
            system = np.block([[system, slope], [np.zeros((size, size)), system]])
        times = self.sample_time, self.sample_time - self._split[1]
        whole, rest = (scipy.linalg.expm(system * t)[:n, -size:] for t in times)
        return (whole[:, :n], whole[:, n:]), rest[:, n:], rest[:, :n]

    @cached_property
    def slopes(self) -> tuple[Slope, ...]:
        """Return the derivatives with respect to each parameter."""
        return tuple(self._slope(*entry) for entry in self.entries)

    def _slope(self, letter: str, i: int, j: int) -> Slope:
        m, n = self.matrices, self.order
        A, B = np.zeros((n, n)), np.zeros((n, self.inputs))
        zero = {letter: np.zeros_like(M) for letter, M in self._table.items()}
        if letter in ("C", "D", "K"):
            zero[letter][i, j] = 1.0
            return Slope(A, B, B, zero["C"], zero["D"], zero["K"])
        if letter == DELAY:
            _, _, rest = self._exponentials(None)
            early = -rest @ m.B
            return Slope(A, early, -early, zero["C"], zero["D"], zero["K"])
        moved = np.zeros((n, n + self.inputs))
        moved[i, j + (n if letter == "B" else 0)] = 1.0
        (A, whole), early, _ = self._exponentials(moved)
        return Slope(A, early, whole - early, zero["C"], zero["D"], zero["K"])

    @cached_property
    def poles(self) -> ComplexArray:
        """Return the poles in z of G."""
        return np.asarray(np.linalg.eigvals(self.held[0]), dtype=complex)

    @cached_property
    def predictor_poles(self) -> ComplexArray:
        """Return the poles in z of the predictor."""
        m = self.matrices
        return np.asarray(np.linalg.eigvals(self.held[0] - m.K @ m.C), dtype=complex)

    @property
    def radius(self) -> float:
        """See `Model`."""
        return float(np.abs(np.concatenate([self.poles, self.predictor_poles])).max(initial=0.0))

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return the poles of G and of all gradients, as points of the frequency plane."""
        near = logarithmic_distance(np.concatenate([self.poles, self.predictor_poles]))
        return np.where(np.abs(near) < _INTEGRATES, 0.0, near)

    @property
    def plant_points(self) -> ComplexArray:
        """Return the poles of G alone, as points of the frequency plane."""
        return logarithmic_distance(self.poles)

    def entry_singularities(self, output: int, input: int) -> ComplexArray:
        """Return the poles and zeros of one entry of G, as points of the frequency plane."""
        A, early, late = self.held
        m = self.matrices
        pencil = np.block([[A, (early + late)[:, [input]]], [m.C[[output]], m.D[[output]][:, [input]]]])
        unit = np.diag(np.append(np.ones(self.order), 0.0))
        zeros = np.asarray(scipy.linalg.eigvals(pencil, unit), dtype=complex)
        finite = zeros[np.isfinite(zeros) & (np.abs(zeros) < 1e6)]
        return np.concatenate([self.singularities, logarithmic_distance(finite)])

    @property
    def memory(self) -> float:
        """Return the dead time, in samples."""
        return float(self.direct_lag)

    @property
    def noise_gain(self) -> Array:
        """See `SampledPlant`: K, behind the past of the inputs."""
        K = self.matrices.K
        return np.pad(K, ((len(self.realisation.A) - len(K), 0), (0, 0)))

    def _points(self, w: ArrayLike) -> ComplexArray:
        """Return z (m,), beside one where the model integrates."""
        given = np.atleast_1d(np.asarray(w))
        if not np.iscomplexobj(given) and np.any(self.singularities == 0.0):
            given = np.where(np.abs(given) < _BESIDE, _BESIDE, given)
        return np.exp(1j * given).astype(complex)

    def _resolvent(self, z: ComplexArray, A: Array) -> ComplexArray:
        return np.linalg.inv(z[:, None, None] * np.eye(self.order) - A).astype(complex)

    def _entering(self, z: ComplexArray, early: Array, late: Array) -> ComplexArray:
        """Return the matrix by which u enters the states, (m, n, r)."""
        delayed = z[:, None, None] ** -float(self.lag)
        return np.asarray(delayed * (early + late / z[:, None, None]), dtype=complex)

    def _direct(self, z: ComplexArray, D: Array) -> ComplexArray:
        return np.asarray(z[:, None, None] ** -float(self.direct_lag) * D, dtype=complex)

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """Return the frequency response G as (n, p, r)."""
        z, (A, early, late), m = self._points(w), self.held, self.matrices
        return m.C @ self._resolvent(z, A) @ self._entering(z, early, late) + self._direct(z, m.D)

    def left_at(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return H^-1 (n, p, p) and H^-1 G (n, p, r), as the predictor has them."""
        z, (A, early, late), m = self._points(w), self.held, self.matrices
        read = m.C @ self._resolvent(z, A - m.K @ m.C)
        D = self._direct(z, m.D)
        return np.eye(self.outputs) - read @ m.K, read @ (self._entering(z, early, late) - m.K @ D) + D

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the gradient dG/dtheta as (n, k, p, r)."""
        z, (A, early, late) = self._points(w), self.held
        u = np.broadcast_to(np.eye(self.inputs, dtype=complex), (z.size, self.inputs, self.inputs))
        x = self._resolvent(z, A) @ self._entering(z, early, late)
        return self._gradient(z, x, u, None, np.zeros_like(self.matrices.K))

    def prediction_gradient(self, w: ArrayLike, y: Signals, u: Signals, e: Signals) -> ComplexArray:
        """Return the gradient of the prediction as (n, k, p, m), see `Model`."""
        z, (A, early, late), m = self._points(w), self.held, self.matrices
        driven = m.K @ np.asarray(e) if u is None else self._entering(z, early, late) @ u
        if y is not None and u is not None:
            driven = driven + m.K @ (y - self._direct(z, m.D) @ u)
            A = A - m.K @ m.C
        return self._gradient(z, self._resolvent(z, A) @ driven, u, e, m.K)

    def _gradient(self, z: ComplexArray, x: ComplexArray, u: Signals, e: Signals, K: Array) -> ComplexArray:
        """Return dy^ (n, k, p, m) from states x (n, order, m), inputs and errors of the predictor."""
        read = self.matrices.C @ self._resolvent(z, self.held[0] - K @ self.matrices.C)
        gradient = np.zeros((z.size, len(self.entries), self.outputs, x.shape[2]), dtype=complex)
        for index, d in enumerate(self.slopes):
            at_once = d.C @ x
            driven = d.A @ x
            if u is not None:
                at_once = at_once + self._direct(z, d.D) @ u
                driven = driven + self._entering(z, d.early, d.late) @ u
            driven = driven - K @ at_once
            if e is not None:
                driven = driven + d.K @ e
            gradient[:, index] = at_once + read @ driven
        return gradient

    @cached_property
    def realisation(self) -> StateSpace:
        """Return a realisation whose states are the past of the inputs, then the states of the model."""
        (A, early, late), m, drives = self.held, self.matrices, list[Drive]()
        for j in range(self.inputs):
            drives.append(Drive(j, self.lag, early[:, j], np.zeros(self.outputs)))
            drives.append(Drive(j, self.direct_lag, late[:, j], m.D[:, j]))
        return StateSpace.of_delayed_inputs(A, m.C, drives, self.inputs)

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """Return the outputs (.., n, p) that u (.., n, r) and e (.., n, p) cause, each from rest."""
        noise = StateSpace(self.held[0], self.matrices.K, self.matrices.C, np.eye(self.outputs))
        return self.realisation.from_rest(u), noise.from_rest(e)
