"""The protocol of models with several inputs and outputs, and the names of their parameters."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, singledispatch
from typing import TYPE_CHECKING, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.transfer import StateSpace


@dataclass(frozen=True)
class Fraction:
    """An entry numerator / denominator of G, both affine in theta, (n,), with their gradients (n, k)."""

    numerator: ComplexArray
    denominator: ComplexArray
    numerator_gradient: ComplexArray
    denominator_gradient: ComplexArray


class Model(Protocol):
    """A model y = G(theta) u + H(theta) e: p outputs, r inputs, k parameters, e of a full covariance.

    Frequencies `w` are in rad/sample, or in rad per time unit when `continuous`. Points of the frequency
    plane are frequency + j damping (see `logarithmic_distance`).
    """

    @property
    def continuous(self) -> bool:
        """Return whether frequencies are in rad per time unit."""

    @property
    def inputs(self) -> int:
        """Return the number of inputs r."""

    @property
    def outputs(self) -> int:
        """Return the number of outputs p."""

    @property
    def covariance(self) -> Array:
        """Return the covariance (p, p) of e; in continuous time of the noise on each output sample."""

    @property
    def at_once(self) -> NDArray[np.bool_]:
        """Return the entries of G that may act without delay at some parameters, (p, r)."""

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the k parameters."""

    @property
    def theta(self) -> Array:
        """Return the values of the parameters (k,)."""

    @property
    def flaw(self) -> str | None:
        """Return why the parameters are invalid (a negative dead time, for example), or None."""

    @property
    def in_plant(self) -> NDArray[np.bool_]:
        """Return a mask (k,) in which all parameters act in the plant."""

    @property
    def dead_times(self) -> NDArray[np.bool_]:
        """Return whether each parameter moves a dead time, (k,)."""

    @property
    def singularities(self) -> ComplexArray:
        """Return the poles of G and of all gradients, as points of the frequency plane."""

    def entry_singularities(self, output: int, input: int) -> ComplexArray:
        """Return the poles and zeros of one entry of G, as points of the frequency plane."""

    @property
    def radius(self) -> float:
        """Return the modulus of the farthest pole of G, H and the predictor in z, below one if stable.

        In continuous time exp of the largest real part in s.
        """

    @property
    def memory(self) -> float:
        """Return the samples, or time units, for which signals matter beyond the memory of the poles."""

    def bends(self, output: int, input: int) -> NDArray[np.bool_]:
        """Return whether numerator or denominator of an entry of G is not affine in each parameter, (k,)."""

    def entry_fraction(self, output: int, input: int, w: ArrayLike) -> Fraction:
        """Return one entry of G as a `Fraction`, where no free parameter bends it."""

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """Return the frequency response G as (n, p, r)."""

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the gradient dG/dtheta as (n, k, p, r)."""

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> Self:
        """Return the structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """Return the outputs (.., n, p) that u (.., n, r) and e (.., n, p) cause, each from rest.

        Args:
            step: time between samples of a plant in continuous time; sampled plants ignore it.
        """

    def input_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return H^-1 dG/dtheta as (n, k, p, r), the gradient of the one-step prediction due to u."""

    def noise_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return H^-1 dH/dtheta as (n, k, p, p), the gradient of the one-step prediction due to e."""

    def prediction_gradient(self, w: ArrayLike, y: NDArray, u: NDArray, e: NDArray) -> ComplexArray:
        """Return psi = -d epsilon / d theta, the gradient of the one-step prediction, as (n, k, p, m).

        `y` (n, p, m), `u` (n, r, m) and `e` (n, p, m) are the transfer functions from m common sources to
        outputs, inputs and prediction errors epsilon.
        """


class SampledPlant(Model, Protocol):
    """A model of samples, as a loop is closed around it: R y = N u + R H e, with G = R^-1 N.

    R, N and R H have no poles on or outside the unit circle: unstable and integrating poles are zeros of R.
    """

    @property
    def realisation(self) -> StateSpace:
        """Return a state-space realisation of G."""

    @property
    def noise_gain(self) -> Array:
        """Return the gains by which R H e enters the states besides the way by the outputs, (states, p)."""

    @property
    def predictor_poles(self) -> ComplexArray:
        """Return the poles in z of the filters from y, u and e to the gradient of the prediction."""

    @property
    def repeated_integrators(self) -> int:
        """Return the number of integrators of the realisation that take no part in G."""

    @property
    def integrates(self) -> bool:
        """Return whether some noise has infinite power at frequency zero."""

    def left_at(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return R (n, p, p) and N (n, p, r)."""

    def forcing_at(self, w: ArrayLike) -> ComplexArray:
        """Return R H as (n, p, p)."""

    def forcing(self, e: Array) -> Array:
        """Return R H e (.., n, p) of samples e, from rest."""


DELAY = "delay"
"""The letter of a dead time, which has no powers."""


@dataclass(frozen=True)
class Parameter:
    """A coefficient: its polynomial, its power, and its channels; a common one acts in several places."""

    letter: str
    power: int
    places: tuple[tuple[int, int], ...]  # (output, input); (output, output) for noise polynomials
    label: str
    value: float

    @property
    def name(self) -> str:
        """Return letter, power and channels, as `b1`, `f2[1,2]` or `delay[1,2]`."""
        return f"{self.letter}{'' if self.letter == DELAY else self.power}{self.label}"


def entry_label(output: int, input: int, *, single: bool) -> str:
    """Return the channels of a parameter in its name, counted from one: `[2,1]`; empty if `single`."""
    return "" if single else f"[{output + 1},{input + 1}]"


def row_parameters(letter: str, rows: Sequence[Array], outputs: int, inputs: int) -> list[Parameter]:
    """Return the coefficients of A, C or D after the first, common to all outputs or output by output."""
    found = []
    for i, values in enumerate(rows):
        common = len(rows) == 1
        acting = range(outputs) if common else [i]
        places = (
            tuple((o, j) for o in acting for j in range(inputs))
            if letter == "a"
            else tuple((o, o) for o in acting)
        )
        label = "" if common else f"[{i + 1}]"
        found += [Parameter(letter, lag, places, label, float(values[lag])) for lag in range(1, len(values))]
    return found


def tables_at(
    parameters: Sequence[Parameter], theta: ArrayLike, tables: Mapping[str, Sequence[Array | Sequence[Array]]]
) -> dict[str, tuple]:
    """Return copies of polynomials by letter, with other values (k,) of the parameters in them.

    Args:
        tables: a polynomial for each output, or one for all, or rows of columns of them.
    """
    found = {
        letter: [p.copy() if isinstance(p, np.ndarray) else tuple(one.copy() for one in p) for p in rows]
        for letter, rows in tables.items()
    }
    for parameter, value in zip(parameters, np.asarray(theta, dtype=float), strict=True):
        rows = found[parameter.letter]
        for i, j in parameter.places:
            row = rows[min(i, len(rows) - 1)]
            (row if isinstance(row, np.ndarray) else row[j])[parameter.power] = value
    return {letter: tuple(rows) for letter, rows in found.items()}


@singledispatch
def input_gradients(model: Model, models: Sequence[Model], w: ArrayLike) -> ComplexArray:
    """Return `input_gradient` of models of one structure, `model` the first of them, (S, n, k, p, r).

    A kind of plant that computes all at once faster registers its own function.
    """
    return np.stack([each.input_gradient(w) for each in models])


@singledispatch
def noise_gradients(model: Model, models: Sequence[Model], w: ArrayLike) -> ComplexArray:
    """Return `noise_gradient` of models of one structure, (S, n, k, p, p)."""
    return np.stack([each.noise_gradient(w) for each in models])


@singledispatch
def prediction_gradients(
    model: Model, models: Sequence[Model], w: ArrayLike, y: NDArray, u: NDArray, e: NDArray
) -> ComplexArray:
    """Return `prediction_gradient` (S, n, k, p, m) of models of one structure, for y, u, e (S, n, ., m)."""
    each = zip(models, y, u, e, strict=True)
    return np.stack([one.prediction_gradient(w, *signals) for one, *signals in each])


@singledispatch
def lefts_at(
    model: SampledPlant, models: Sequence[SampledPlant], w: ArrayLike
) -> tuple[ComplexArray, ComplexArray]:
    """Return R (S, n, p, p) and N (S, n, p, r) of models of one structure, see `left_at`."""
    R, N = zip(*(each.left_at(w) for each in models), strict=True)
    return np.stack(R), np.stack(N)


@singledispatch
def forcings_at(model: SampledPlant, models: Sequence[SampledPlant], w: ArrayLike) -> ComplexArray:
    """Return `forcing_at` of models of one structure, (S, n, p, p)."""
    return np.stack([each.forcing_at(w) for each in models])


class Listed(Model, Protocol):
    """A model that knows its parameters one by one."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters in the order of theta, (k,)."""


class Parametrised:
    """Derives the properties of a model from its list of `parameters`."""

    if TYPE_CHECKING:

        @property
        def parameters(self) -> tuple[Parameter, ...]:
            """Return all parameters, in the order of theta."""

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Return the names of the k parameters."""
        return tuple(parameter.name for parameter in self.parameters)

    @cached_property
    def theta(self) -> Array:
        """Return the values of the parameters (k,)."""
        return np.array([parameter.value for parameter in self.parameters])

    @property
    def integrates(self) -> bool:
        """See `SampledPlant`."""
        return False

    @property
    def repeated_integrators(self) -> int:
        """See `SampledPlant`."""
        return 0

    @cached_property
    def dead_times(self) -> NDArray[np.bool_]:
        """Return whether each parameter is a dead time, (k,)."""
        return np.array([parameter.letter == DELAY for parameter in self.parameters], dtype=bool)

    @property
    def flaw(self) -> str | None:
        """See `Model`."""
        for parameter in self.parameters:
            if not np.isfinite(parameter.value):
                return f"{parameter.name} has no finite value"
            if parameter.letter == DELAY and parameter.value < 0.0:
                return f"the dead time {parameter.name} is negative"
        return None


class WhiteNoise:
    """Predicts G u, since H = I: e reaches the gradient of the prediction through u alone."""

    if TYPE_CHECKING:

        @property
        def outputs(self) -> int:
            """Return the number of outputs p."""

        @property
        def theta(self) -> Array:
            """Return the values of the parameters (k,)."""

        def plant_gradient(self, w: ArrayLike) -> ComplexArray:
            """Return the gradient dG/dtheta as (n, k, p, r)."""

    @property
    def in_plant(self) -> NDArray[np.bool_]:
        """Return a mask (k,) in which all parameters act in the plant."""
        return np.ones(self.theta.size, dtype=bool)

    def input_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the gradient dG/dtheta as (n, k, p, r)."""
        return self.plant_gradient(w)

    def noise_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return zero (n, k, p, p)."""
        return np.zeros((np.size(w), self.theta.size, self.outputs, self.outputs), dtype=complex)

    def prediction_gradient(self, w: ArrayLike, y: NDArray, u: NDArray, e: NDArray) -> ComplexArray:
        """Return dG/dtheta u as (n, k, p, m), see `Model`."""
        return np.asarray(self.plant_gradient(w) @ u[:, None])


class Around(ABC):
    """A model that is made of another one, `inner`, and answers like that one unless it says otherwise."""

    @property
    @abstractmethod
    def inner(self) -> SampledPlant:
        """Return the other model."""

    @property
    def continuous(self) -> bool:
        """See `SampledPlant`."""
        return self.inner.continuous

    @property
    def inputs(self) -> int:
        """See `SampledPlant`."""
        return self.inner.inputs

    @property
    def outputs(self) -> int:
        """See `SampledPlant`."""
        return self.inner.outputs

    @property
    def covariance(self) -> Array:
        """See `SampledPlant`."""
        return self.inner.covariance

    @property
    def at_once(self) -> NDArray[np.bool_]:
        """See `SampledPlant`."""
        return self.inner.at_once

    @property
    def singularities(self) -> ComplexArray:
        """See `SampledPlant`."""
        return self.inner.singularities

    @property
    def radius(self) -> float:
        """See `SampledPlant`."""
        return self.inner.radius

    @property
    def memory(self) -> float:
        """See `SampledPlant`."""
        return self.inner.memory

    @property
    def realisation(self) -> StateSpace:
        """See `SampledPlant`."""
        return self.inner.realisation

    @property
    def noise_gain(self) -> Array:
        """See `SampledPlant`."""
        return self.inner.noise_gain

    @property
    def predictor_poles(self) -> ComplexArray:
        """See `SampledPlant`."""
        return self.inner.predictor_poles

    @property
    def repeated_integrators(self) -> int:
        """See `SampledPlant`."""
        return self.inner.repeated_integrators

    @property
    def integrates(self) -> bool:
        """See `SampledPlant`."""
        return self.inner.integrates

    def entry_singularities(self, output: int, input: int) -> ComplexArray:
        """See `SampledPlant`."""
        return self.inner.entry_singularities(output, input)

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """See `SampledPlant`."""
        return self.inner.plant_at(w)

    def left_at(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """See `SampledPlant`."""
        return self.inner.left_at(w)

    def forcing_at(self, w: ArrayLike) -> ComplexArray:
        """See `SampledPlant`."""
        return self.inner.forcing_at(w)

    def forcing(self, e: Array) -> Array:
        """See `SampledPlant`."""
        return self.inner.forcing(e)

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """See `SampledPlant`."""
        return self.inner.simulate(u, e, step)
