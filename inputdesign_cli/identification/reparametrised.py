"""Estimate a model in other parameters than its coefficients, some of which may be known.

The chain rule turns gradients by the coefficients into gradients by the parameters. Starting points are
estimates of all coefficients, brought back to the parameters by least squares weighed by the information
matrix. In the limit of many samples that is an efficient estimate already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.kind import Extension, Kind, Part, Starts
from inputdesign_cli.identification.records import Point, Records, evaluate
from inputdesign_cli.identification.start import Start
from inputdesign_cli.plant import Reparametrised

# So often a point is moved halfway towards the nominal one before that takes its place.
_HALVINGS = 40
_RIDGE = 1e-9
_MOST_EVALUATIONS = 60
_OUT_OF_BOUNDS = 1e12
_STEP = 1e-6


@dataclass(frozen=True)
class ReparametrisedKind(Kind):
    """The structure of `model`, whose coefficients have the structure `coefficients`; see `Kind`."""

    model: Reparametrised
    coefficients: Kind

    @property
    def recent(self) -> int:
        """Return the largest lag at which inputs act directly."""
        return self.coefficients.recent

    @property
    def explaining(self) -> NDArray[np.bool_]:
        """Return the mask (k,) of parameters that move an explaining coefficient."""
        return np.any(self._moved[self.coefficients.explaining], axis=0)

    @property
    def whitening(self) -> NDArray[np.bool_]:
        """Return the mask (k,) of parameters that move a whitening coefficient."""
        return np.any(self._moved[self.coefficients.whitening], axis=0)

    @property
    def _moved(self) -> NDArray[np.bool_]:
        """Return the mask (K, k) of the coefficients that each parameter moves."""
        return self.model.parametrisation.moves

    def _at(self, theta: Array) -> Array:
        """Return the coefficients (K,) at theta."""
        return self.model.parametrisation.at(theta).coefficients

    def errors_and_gradient(self, theta: Array, u: Array, y: Array) -> tuple[Array, NDArray[np.float64]]:
        """Return prediction errors (N, p) from rest, and psi (k, N, p); NaN if a coefficient is infinite."""
        here = self.model.parametrisation.at(theta)
        if not (np.all(np.isfinite(here.coefficients)) and np.all(np.isfinite(here.jacobian))):
            return np.full(y.shape, np.nan), np.full((theta.size, *y.shape), np.nan)
        errors, psi = self.coefficients.errors_and_gradient(here.coefficients, u, y)
        return errors, np.tensordot(here.jacobian, psi, axes=(0, 0))

    def starts(self, theta: Array, samples: int, late: int, *, free: bool) -> tuple[Start, ...]:
        """Return the effect of the past on the prediction errors, at the coefficients."""
        return self.coefficients.starts(self._at(theta), samples, late, free=free)

    def in_starts(self, late: int, *, free: bool) -> NDArray[np.int64]:
        """Return the indices of parameters that move a coefficient on which the starts depend."""
        return np.flatnonzero(np.any(self._moved[self.coefficients.in_starts(late, free=free)], axis=0))

    def start_step(self, theta: Array, index: int, samples: int) -> float:
        """Return a small share of the parameter, whose unit may be any."""
        return _STEP * (abs(float(theta[index])) or 1.0)

    def lateness(self, theta: Array) -> int:
        """Return the number of samples in which earlier inputs act, at the coefficients."""
        return self.coefficients.lateness(self._at(theta))

    def crossings(self, theta: Array, samples: int) -> Array:
        """Return the smallest steps of the parameters that move the dead times to their crossings."""
        late = np.flatnonzero(self.coefficients.model.dead_times)
        steps = self.coefficients.crossings(self._at(theta), samples)[:, :, late]
        if not steps.size:
            return np.zeros((0, 2, theta.size))
        back = np.linalg.pinv(self.model.parametrisation.at(theta).jacobian[late], rcond=1e-12)
        return np.asarray(steps @ back.T)

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """Return signals filtered by the inverse noise models at the coefficients."""
        return self.coefficients.whitened(self._at(theta), signals)

    def stabilised(self, theta: Array, samples: int) -> Array:
        """Return theta if its predictor is stable, otherwise the nominal parameters moved towards it.

        They move one after the other: one that has reached its end, as a dead time of zero, holds no other.
        """

        def is_stable(point: Array) -> bool:
            own = self._at(point)
            return bool(np.all(np.isfinite(own))) and np.array_equal(
                self.coefficients.stabilised(own, samples), own
            )

        if is_stable(theta):
            return theta.copy()
        point = self.model.theta.copy()
        for index, home in enumerate(point.tolist()):
            for share in (*0.5 ** np.arange(_HALVINGS), 0.0):
                point[index] = home + share * (theta[index] - home)
                if share == 0.0 or is_stable(point):
                    break
        return point

    def starting_points(self, parts: Sequence[Part], given: Array | None) -> Starts:
        """Return the starting points of all coefficients, mapped to the parameters, and the `given` one."""
        kind = self.coefficients.holding(~np.any(self._moved, axis=1))
        found, about = kind.starting_points(parts, None), Records(self.coefficients, tuple(parts))
        points = [self.brought_back(evaluate(about, theta)) for theta in found.points]
        return Starts(np.array(points), found.tried).and_given(given)

    def brought_back(self, point: Point) -> Array:
        """Return the parameters (k,) whose coefficients are nearest to a point, weighted by its Hessian."""
        at = self.model.parametrisation
        if not np.isfinite(point.cost):
            return at.theta
        scale = np.sqrt(np.maximum(np.diag(point.hessian), 1e-300))
        values, vectors = np.linalg.eigh(point.hessian / np.outer(scale, scale))
        root = np.sqrt(np.maximum(values, _RIDGE * values[-1]))[:, None] * vectors.T * scale
        unit = np.maximum(np.abs(at.theta), 1e-3 * max(float(np.max(np.abs(at.theta))), 1e-300))

        def distance(share: Array) -> Array:
            apart = root @ (at.at(share * unit).coefficients - point.theta)
            return np.where(np.isfinite(apart), apart, _OUT_OF_BOUNDS)

        def slope(share: Array) -> Array:
            jacobian = root @ at.at(share * unit).jacobian * unit
            return np.where(np.isfinite(jacobian), jacobian, 0.0)

        # A step may go far beyond what doubles hold where the coefficients hardly move; it is taken back.
        with np.errstate(over="ignore", invalid="ignore"):
            found = scipy.optimize.least_squares(
                distance, at.theta / unit, jac=slope, x_scale="jac", max_nfev=_MOST_EVALUATIONS
            )
        return np.asarray(found.x * unit, dtype=float)

    def extensions(self, theta: Array, *, feedback: bool) -> tuple[Extension, ...]:
        """Return the extensions of the structure of the coefficients."""
        found = self.coefficients.extensions(self._at(theta), feedback=feedback)
        return tuple(extension._replace(nested=False) for extension in found)

    def simulates(self, theta: Array) -> Sequence[bool]:
        """Return whether each output can be simulated at the coefficients."""
        return self.coefficients.simulates(self._at(theta))
