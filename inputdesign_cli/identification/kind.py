"""The interface of a kind of model to its estimator: prediction errors, their gradient, starts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.gauss_newton import Problem
from inputdesign_cli.identification.start import Start
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.model import Listed

Part = tuple[Array, Array]
"""u (N, r) and y (N, p) of one record."""
Parts = Sequence[Part]
Mask = NDArray[np.bool_]

STEP = 1e-6
"""The step of central differences, in shares of the size of a parameter."""
FADED = 2000
"""Samples after which the response of a stable noise model counts as zero."""


class Starts(NamedTuple):
    """The starting points (n, k) of a search, and the number of points that were tried."""

    points: Array
    tried: int

    def and_given(self, given: Array | None) -> Starts:
        """Return the starts, preceded by the `given` one (k,) if there is one."""
        if given is None:
            return self
        return Starts(np.concatenate([given[None], self.points.reshape(-1, given.size)]), self.tried + 1)


class Extension(NamedTuple):
    """A larger model, whose additional parameter is zero."""

    model: Listed  # in its coefficients
    name: str  # the additional parameter
    what: str  # its description, for example "pole in F"

    @classmethod
    def of(cls, model: Model, larger: Listed, what: str) -> Self:
        """Return the extension of a model to a larger one, which has a further name."""
        (name,) = set(larger.names) - set(model.names)
        return cls(larger, name, what)


class Batch(Problem, Protocol):
    """A problem of many records that knows the noise and the information at its minima."""

    def concluded(self, theta: Array) -> tuple[Array, Array]:
        """Return the covariance (runs, p, p) of e and the information (runs, k, k) at theta (runs, k)."""


@dataclass(frozen=True)
class Kind(ABC):
    """A structure of k parameters and p outputs that records are to determine, here with white noise.

    Samples are u (N, r), y (N, p). Where a record does not begin at rest (`free`), unknown inputs before it
    act for `late` samples.
    """

    model: Model

    @property
    def recent(self) -> int:
        """Return the largest lag at which an input enters directly; older inputs act through the poles."""
        return 0

    @property
    def explaining(self) -> Mask:
        """Return the mask (k,) of the parameters that make residuals look independent of past inputs."""
        return self.model.in_plant

    @property
    def whitening(self) -> Mask:
        """Return the mask (k,) of the parameters that make residuals look whiter."""
        return ~self.explaining

    @abstractmethod
    def errors_and_gradient(self, theta: Array, u: Array, y: Array) -> tuple[Array, Array]:
        """Return prediction errors (N, p) from rest, and psi = -d errors / d theta (k, N, p)."""

    def batch(self, u: Array, y: Array) -> Batch | None:
        """Return a fast problem of records (runs, N, r), (runs, N, p) from rest, noise too, if it exists."""
        return None

    @abstractmethod
    def starts(self, theta: Array, samples: int, late: int, *, free: bool) -> tuple[Start, ...]:
        """Return for each output the effect of the past of a record on its prediction errors.

        Args:
            free: whether level and states are unknown; else the plant is at rest at zero, but not the noise.
        """

    @abstractmethod
    def in_starts(self, late: int, *, free: bool) -> Mask:
        """Return the mask (k,) of the parameters on which the starts depend."""

    def start_steps(self, theta: Array, samples: int) -> Array:
        """Return the steps (k,) of the parameters in the numerical derivative of the starts."""
        return STEP * np.maximum(np.abs(theta), 1.0)

    def lateness(self, theta: Array) -> int:
        """Return the number of samples in which inputs before a record act other than through the states."""
        return 0

    @property
    def instants(self) -> float | None:
        """Return the time between sampling instants, where dead times make kinks of the cost; else None."""
        return None

    def crossings(self, theta: Array, samples: int) -> Array:
        """Return steps (m, 2, k) of a dead time to nearby sampling instants, and half a sample beyond."""
        found, step = [], self.instants
        for index in np.flatnonzero(self.model.dead_times) if step else ():
            begun = np.floor(theta[index] / step)
            for instant, beyond in ((begun - 1, -0.5), (begun, -0.5), (begun + 1, 0.5), (begun + 2, 0.5)):
                if 0.0 < instant < samples - 1:
                    there = (instant * step - theta[index], (instant + beyond) * step - theta[index])
                    found.append(np.outer(there, np.eye(theta.size)[index]))
        return np.array(found).reshape(-1, 2, theta.size)

    def whitened(self, theta: Array, signals: Array) -> Array:
        """Return signals (N, m) filtered by the inverse noise model of each output, as (p, N, m)."""
        return np.repeat(signals[None], self.model.outputs, axis=0)

    @abstractmethod
    def stabilised(self, theta: Array, samples: int) -> Array:
        """Return theta (k,), changed where its predictor would be unstable."""

    @abstractmethod
    def starting_points(self, parts: Parts, given: Array | None, known: Mask | None = None) -> Starts:
        """Return starting points from records at rest about zero, and the `given` one (k,).

        Args:
            known: the mask (k,) of parameters that need not be looked for; None for none.
        """

    def leaks(self, theta: Array, u: Array, y: Array) -> Array:
        """Return minus the derivatives (m, N, p) of the errors by the leaks of integrators, from rest.

        They belong to poles that are known to be zero, so that no parameter of the model is a leak.
        """
        return np.zeros((0, *y.shape))

    def extensions(self, theta: Array, *, feedback: bool) -> list[Extension]:
        """Return the extensions of the structure at theta (k,) by one parameter.

        Args:
            feedback: whether u(t) depends on y(t).
        """
        return []

    def echoes(self, theta: Array, samples: int) -> Array:
        """Return the responses of gradients to past errors, (k, lags, p, p): parameter, lag, output, error.

        They are zero for parameters of the plant alone. They count as zero if the response does not fade:
        then a controller stabilises the plant, not the noise model.
        """
        samples = min(samples, FADED)
        found = np.zeros((theta.size, samples, self.model.outputs, self.model.outputs))
        if not np.any(self.whitening):
            return found
        u = np.zeros((samples, self.model.inputs))
        with np.errstate(over="ignore", invalid="ignore"):
            for j in range(self.model.outputs):
                e = np.outer(np.arange(samples) == 0, np.arange(self.model.outputs) == j).astype(float)
                y = sum(self.model.at(theta).simulate(u, e, 1.0))
                found[..., j] = self.errors_and_gradient(theta, u, np.asarray(y))[1]
            early, late = (np.abs(part) for part in np.array_split(found, 2, axis=1))
            fades = np.max(late, axis=(1, 2, 3), initial=0.0) < np.max(early, axis=(1, 2, 3))
        return np.where(fades[:, None, None, None], found, 0.0)

    def simulates(self, theta: Array) -> Sequence[bool]:
        """Return whether each output is stable, so that it can be simulated."""
        return (True,) * self.model.outputs


def late_samples(dead_time: float, sample_time: float) -> int:
    """Return the number of samples in which inputs before a record act through a dead time; 0 without one."""
    return int(np.ceil(dead_time / sample_time - 1e-9)) if dead_time > 0.0 else 0
