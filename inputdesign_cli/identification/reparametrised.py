"""Estimate a model in other parameters than its coefficients, some of which may be known.

The records belong to the coefficients; gradients follow by the chain rule. Starts are estimates of all
coefficients, brought back to the parameters by least squares weighed by the information matrix. In the limit
of many samples that is an efficient estimate already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.extensions import Extension
from inputdesign_cli.identification.kind import Kind, Part, Starts
from inputdesign_cli.identification.of_model import OfModel, OverRecord
from inputdesign_cli.identification.record_problem import Point, evaluate
from inputdesign_cli.identification.records import Records
from inputdesign_cli.identification.search import Search
from inputdesign_cli.identification.start import Start
from inputdesign_cli.identification.white import Echo, Echoes
from inputdesign_cli.plant import Parametrisation, Reparametrised

# So often a point is moved halfway towards the nominal one before that takes its place.
_HALVINGS = 40
_RIDGE = 1e-9
_MOST_EVALUATIONS = 60
_OUT_OF_BOUNDS = 1e12


@dataclass(frozen=True)
class ReparametrisedRecord(OverRecord):
    """A record of the coefficients against parameters (k,); see `Record`."""

    parametrisation: Parametrisation

    @property
    def size(self) -> int:
        """Return the number of parameters k."""
        return len(self.parametrisation.names)

    def errors_and_gradient(self, theta: Array) -> tuple[Array, NDArray[np.float64]]:
        """Prediction errors (N, p) from rest, and psi (k, N, p); not a number where a coefficient is not."""
        here = self.parametrisation.at(theta)
        if not (np.all(np.isfinite(here.coefficients)) and np.all(np.isfinite(here.jacobian))):
            return np.full(self.y.shape, np.nan), np.full((self.size, *self.y.shape), np.nan)
        errors, psi = self.record.errors_and_gradient(here.coefficients)
        return errors, np.tensordot(here.jacobian, psi, axes=(0, 0))

    def starts(self, theta: Array, *, free: bool) -> tuple[Start, ...]:
        """Return the starts at the coefficients."""
        return self.record.starts(self.parametrisation.at(theta).coefficients, free=free)

    @property
    def dead_times(self) -> NDArray[np.int64]:
        """Return the indices of the parameters that move a dead time."""
        rows = self.parametrisation.jacobian[self.record.dead_times]
        return np.flatnonzero(np.any(rows != 0.0, axis=0))

    def crossings(self, theta: Array) -> Array:
        """Return the smallest steps of the parameters that move the dead times to their crossings."""
        here, late = self.parametrisation.at(theta), self.record.dead_times
        steps = self.record.crossings(here.coefficients)[:, :, late]
        if not steps.size:
            return np.zeros((0, 2, theta.size))
        back = np.linalg.pinv(here.jacobian[late], rcond=1e-12)
        return np.asarray(steps @ back.T)

    def lateness(self, theta: Array) -> int:
        """Return the lateness at the coefficients."""
        return self.record.lateness(self.parametrisation.at(theta).coefficients)

    def start_slopes(self, theta: Array, indices: Sequence[int], *, free: bool) -> list[tuple[Start, ...]]:
        """Return the derivatives of the starts with respect to these parameters, by the chain rule."""
        here = self.parametrisation.at(theta)
        slopes = here.jacobian[:, indices]
        moved = [c for c in self.record.in_starts(free=free).tolist() if np.any(slopes[c])]
        if not moved:
            return [tuple(start.still for start in self.starts(theta, free=free))] * len(indices)
        of_moved = self.record.start_slopes(here.coefficients, moved, free=free)
        # Of every output and block the derivatives (moved, ..), weighed for all parameters at once.
        weighed = [
            [np.tensordot(slopes[moved].T, np.array(blocks), 1) for blocks in zip(*same, strict=True)]
            for same in zip(*of_moved, strict=True)
        ]
        return [tuple(Start(*(b[k] for b in blocks)) for blocks in weighed) for k in range(len(indices))]

    def in_starts(self, *, free: bool) -> NDArray[np.int64]:
        """Return the indices of parameters that move a coefficient on which the starts depend."""
        moved = self.parametrisation.moves[self.record.in_starts(free=free)]
        return np.flatnonzero(np.any(moved, axis=0))

    def noise_in_regressors(self, theta: Array, errors: Array) -> NDArray[np.float64]:
        """(k, N, p), see `Record`."""
        here = self.parametrisation.at(theta)
        own = self.record.noise_in_regressors(here.coefficients, errors)
        return np.tensordot(here.jacobian, own, axes=(0, 0))

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """(p, N, m), see `Record`."""
        return self.record.whitened(self.parametrisation.at(theta).coefficients, signals)

    def stabilised(self, theta: Array) -> Array:
        """theta; where its predictor is not stable, the nominal parameters moved there as far as it is.

        One after the other, so that one which has reached its end, as a dead time of zero, holds no other.
        """
        if self._is_stable(theta):
            return theta.copy()
        point = self.parametrisation.theta.copy()
        for index in range(theta.size):
            home, share = point[index], 1.0
            for _ in range(_HALVINGS):
                point[index] = home + share * (theta[index] - home)
                if self._is_stable(point):
                    break
                share *= 0.5
            else:
                point[index] = home
        return point

    def _is_stable(self, theta: Array) -> bool:
        coefficients = self.parametrisation.at(theta).coefficients
        return bool(
            np.all(np.isfinite(coefficients))
            and np.array_equal(self.record.stabilised(coefficients), coefficients)
        )


@dataclass(frozen=True)
class ReparametrisedKind(OfModel):
    """The structure of `model`, whose coefficients have the structure `coefficients`; see `Kind`."""

    model: Reparametrised
    coefficients: Kind

    @property
    def recent(self) -> int:
        """Return the lag up to which the structure looks at the inputs."""
        return self.coefficients.recent

    @property
    def explaining(self) -> NDArray[np.bool_]:
        """Return the mask (k,) of parameters that move an explaining coefficient."""
        return np.any(self._moved[self.coefficients.explaining], axis=0)

    @property
    def whitening(self) -> NDArray[np.bool_]:
        """Return the mask (k,) of parameters that move a whitening coefficient."""
        return np.any(self._moved[self.coefficients.whitening], axis=0)

    @cached_property
    def _moved(self) -> NDArray[np.bool_]:
        """Return which parameter moves which coefficient (K, k)."""
        return self.model.parametrisation.moves

    def echoes(self, theta: Array, lengths: Sequence[int]) -> Echoes | None:
        """Return the echoes of the coefficients, by the chain rule."""
        here = self.model.parametrisation.at(theta)
        of_all = self.coefficients.echoes(here.coefficients, lengths)
        if of_all is None:
            return None

        def chained(j: int) -> Echo:
            parts = [(here.jacobian[index, j], through) for index, through in of_all]
            return lambda errors: sum((w * through(errors) for w, through in parts if w), 0.0 * errors)

        moved = [index for index, _ in of_all]
        return tuple((j, chained(j)) for j in np.flatnonzero(np.any(self._moved[moved], axis=0)).tolist())

    def own(self) -> Array:
        """(p,): as many parameters as there are, shared by the outputs as the coefficients are."""
        of_all = self.coefficients.own()
        return of_all * (len(self.names) / max(float(np.sum(of_all)), 1.0))

    def record(self, u: Array, y: Array) -> ReparametrisedRecord:
        """Return the record of samples u (N, r), y (N, p) that the structure is to explain."""
        return ReparametrisedRecord(self.coefficients.record(u, y), self.model.parametrisation)

    def starts(self, parts: Sequence[Part], given: Array | None) -> Starts:
        """Return the starts of all coefficients, brought back to the parameters, and the `given` one."""
        found = self.coefficients.holding(~np.any(self._moved, axis=1)).starts(parts, None)
        about = Records(tuple(self.coefficients.record(*part) for part in parts))
        points = [self._brought_back(evaluate(about, theta)) for theta in found.points]
        listed = [given] if given is not None else []
        return Starts(
            np.array([*listed, *points]),
            np.append(np.zeros(len(listed), dtype=np.int64), found.steps),
            found.tried + len(listed),
        )

    def _brought_back(self, point: Point) -> Array:
        """Return the parameters (k,) whose coefficients are nearest to a point, weighed by its Hessian."""
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
        """Return the extensions of the coefficients."""
        coefficients = self.model.parametrisation.at(theta).coefficients
        found = self.coefficients.extensions(coefficients, feedback=feedback)
        return tuple(replace(extension, nested=False) for extension in found)

    def simulated(
        self, found: Search, y: Array, lengths: Sequence[int] | None
    ) -> tuple[Array, Sequence[bool]]:
        """Return the simulation of the coefficients."""
        return self.coefficients.simulated(self._of_coefficients(found), y, lengths)

    def _of_coefficients(self, found: Search) -> Search:
        """Return the search with its point given by the coefficients."""
        theta = self.model.parametrisation.at(found.point.theta).coefficients
        return replace(found, point=replace(found.point, theta=theta))
