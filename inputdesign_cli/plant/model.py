"""The protocol of models with several inputs and outputs, and the names of their parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, singledispatch
from typing import Protocol, Self, cast

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


Signals = NDArray | None


def _inner(model: object) -> SampledPlant:
    """Return the plant that a model is made of."""
    return cast(Derived, model).inner


class Model(Protocol):
    """A model y = G(theta) u + H(theta) e: p outputs, r inputs, k parameters, e of a full covariance.

    The methods with a body serve models that are made of another model, their `inner`, and derive from this.

    Frequencies `w` are in rad/sample, or in rad per time unit when `continuous`. Points of the frequency
    plane are frequency + j damping (see `logarithmic_distance`).
    """

    @property
    def continuous(self) -> bool:
        """Return whether frequencies are in rad per time unit."""
        return _inner(self).continuous

    @property
    def inputs(self) -> int:
        """Return the number of inputs r."""
        return _inner(self).inputs

    @property
    def outputs(self) -> int:
        """Return the number of outputs p."""
        return _inner(self).outputs

    @property
    def covariance(self) -> Array:
        """Return the covariance (p, p) of e; in continuous time of the noise on each output sample."""
        return _inner(self).covariance

    @property
    def at_once(self) -> NDArray[np.bool_]:
        """Return the entries of G that may act without delay at some parameters, (p, r)."""
        return _inner(self).at_once

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
        """Return whether G depends on each parameter, (k,)."""

    @property
    def dead_times(self) -> NDArray[np.bool_]:
        """Return whether each parameter moves a dead time, (k,)."""

    @property
    def singularities(self) -> ComplexArray:
        """Return the poles of G and of all gradients, as points of the frequency plane."""
        return _inner(self).singularities

    @property
    def plant_points(self) -> ComplexArray:
        """Return the poles of G alone, as points of the frequency plane."""
        return _inner(self).plant_points

    def entry_singularities(self, output: int, input: int) -> ComplexArray:
        """Return the poles and zeros of one entry of G, as points of the frequency plane."""
        return _inner(self).entry_singularities(output, input)

    @property
    def radius(self) -> float:
        """Return the modulus of the farthest pole of G, H and the predictor in z, below one if stable.

        In continuous time it is exp of the largest real part of a pole in s.
        """
        return _inner(self).radius

    @property
    def memory(self) -> float:
        """Return the samples, or time units, for which signals matter beyond the memory of the poles."""
        return _inner(self).memory

    def bends(self, output: int, input: int) -> NDArray[np.bool_]:
        """Return whether numerator or denominator of an entry of G is not affine in each parameter, (k,)."""

    def entry_fraction(self, output: int, input: int, w: ArrayLike) -> Fraction:
        """Return one entry of G as a `Fraction`, where no free parameter bends it."""

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """Return the frequency response G as (n, p, r)."""
        return _inner(self).plant_at(w)

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the gradient dG/dtheta as (n, k, p, r)."""

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> Self:
        """Return the structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """Return the outputs (.., n, p) that u (.., n, r) and e (.., n, p) cause, each from rest.

        The `step` is the time between samples of a plant in continuous time; sampled plants ignore it.
        """
        return _inner(self).simulate(u, e, step)

    def prediction_gradient(self, w: ArrayLike, y: Signals, u: Signals, e: Signals) -> ComplexArray:
        """Return psi = -d epsilon / d theta, the gradient of the one-step prediction, as (n, k, p, m).

        `y` (n, p, m), `u` (n, r, m) and `e` (n, p, m) are the transfer functions from m common sources to
        outputs, inputs and prediction errors epsilon, n or 1 where they are the same at all frequencies.
        Without `y` it is the response of the model to one of the others, which is then the only one: u = I
        gives H^-1 dG/dtheta, e = I gives H^-1 dH/dtheta.
        """


class SampledPlant(Model, Protocol):
    """A model of samples, as a loop is closed around it: R y = N u + R H e, with G = R^-1 N.

    R, N and R H have no poles on or outside the unit circle: unstable and integrating poles are zeros of R.
    """

    @property
    def realisation(self) -> StateSpace:
        """Return a state-space realisation of G."""
        return _inner(self).realisation

    @property
    def noise_gain(self) -> Array:
        """Return the gains by which R H e enters the states other than through the outputs, (states, p)."""
        return _inner(self).noise_gain

    @property
    def predictor_poles(self) -> ComplexArray:
        """Return the poles in z of the filters from y, u and e to the gradient of the prediction."""
        return _inner(self).predictor_poles

    @property
    def repeated_integrators(self) -> int:
        """Return the number of integrators of the realisation that take no part in G."""
        return _inner(self).repeated_integrators

    @property
    def integrates(self) -> bool:
        """Return whether some noise has infinite power at frequency zero."""
        return _inner(self).integrates

    def left_at(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return R (n, p, p) and N (n, p, r)."""
        return _inner(self).left_at(w)

    def forcing_at(self, w: ArrayLike) -> ComplexArray:
        """Return R H as (n, p, p)."""
        return _inner(self).forcing_at(w)

    def forcing(self, e: Array) -> Array:
        """Return R H e (.., n, p) of samples e, from rest."""
        return _inner(self).forcing(e)


class Derived(SampledPlant, Protocol):
    """A model that is made of another one, and has its properties unless they are defined anew."""

    @property
    def inner(self) -> SampledPlant:
        """Return the other model."""


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

    Each table has a polynomial for each output, or one for all, or rows of columns of them.
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
def prediction_gradients(
    model: Model, models: Sequence[Model], w: ArrayLike, y: Signals, u: Signals, e: Signals
) -> ComplexArray:
    """Return `prediction_gradient` (S, n, k, p, m) of models of one structure, `model` the first of them.

    Signals (S, n, ., m) may be one for all (1, n, ., m). A kind of plant that computes all at once faster
    registers its own function.
    """
    every = ([x] * len(models) if x is None or len(x) == 1 else x[:, None] for x in (y, u, e))
    signals = ((None if x is None else x[0] for x in own) for own in zip(*every, strict=True))
    return np.stack([one.prediction_gradient(w, *own) for one, own in zip(models, signals, strict=True)])


def input_gradients(models: Sequence[Model], w: ArrayLike) -> ComplexArray:
    """Return H^-1 dG/dtheta, the part of u in the predictions of models of one structure, (S, n, k, p, r)."""
    u = np.eye(models[0].inputs, dtype=complex)[None, None]
    return prediction_gradients(models[0], models, w, None, u, None)


def noise_gradients(models: Sequence[Model], w: ArrayLike) -> ComplexArray:
    """Return H^-1 dH/dtheta, the part of e in the predictions of models of one structure, (S, n, k, p, p)."""
    e = np.eye(models[0].outputs, dtype=complex)[None, None]
    return prediction_gradients(models[0], models, w, None, None, e)


class Listed(Model, Protocol):
    """A model that knows its parameters one by one."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters in the order of theta, (k,)."""


class Parametrised:
    """Derives the properties of a model from its list of `parameters`."""

    @cached_property
    def names(self: Listed) -> tuple[str, ...]:
        """Return the names of the k parameters."""
        return tuple(parameter.name for parameter in self.parameters)

    @cached_property
    def theta(self: Listed) -> Array:
        """Return the values of the parameters (k,)."""
        return np.array([parameter.value for parameter in self.parameters])

    @cached_property
    def dead_times(self: Listed) -> NDArray[np.bool_]:
        """Return whether each parameter is a dead time, (k,)."""
        return np.array([parameter.letter == DELAY for parameter in self.parameters], dtype=bool)

    @property
    def flaw(self: Listed) -> str | None:
        """See `Model`."""
        for parameter in self.parameters:
            if not np.isfinite(parameter.value):
                return f"{parameter.name} has no finite value"
            if parameter.letter == DELAY and parameter.value < 0.0:
                return f"the dead time {parameter.name} is negative"
        return None

    def bends(self: Listed, output: int, input: int) -> NDArray[np.bool_]:
        """Return a mask (k,) of all parameters: no entry of G is taken to be affine in them."""
        return np.ones(len(self.parameters), dtype=bool)

    def entry_fraction(self, output: int, input: int, w: ArrayLike) -> Fraction:
        """Raise an error: no entry is a fraction that is affine in its parameters."""
        raise ValueError("an entry of this model is no fraction that is affine in its parameters")

    def forcing_at(self: Listed, w: ArrayLike) -> ComplexArray:
        """Return I: R is the inverse of H unless a model says otherwise; see `SampledPlant`."""
        return np.broadcast_to(np.eye(self.outputs, dtype=complex), (np.size(w), self.outputs, self.outputs))

    def forcing(self, e: Array) -> Array:
        """See `SampledPlant`."""
        return e


class WhiteNoise(Parametrised):
    """Predicts G u, since H = I: e reaches the gradient of the prediction through u alone."""

    @property
    def in_plant(self: Model) -> NDArray[np.bool_]:
        """Return a mask (k,) in which all parameters act in the plant."""
        return np.ones(self.theta.size, dtype=bool)

    def prediction_gradient(self: Model, w: ArrayLike, y: Signals, u: Signals, e: Signals) -> ComplexArray:
        """Return dG/dtheta u as (n, k, p, m), see `Model`; zero without u."""
        if u is not None:
            return np.asarray(self.plant_gradient(w) @ u[:, None])
        return np.zeros((np.size(w), self.theta.size, self.outputs, self.outputs), dtype=complex)
