"""Estimate a model that is derived from a plant: with further noise, or in other parameters.

Prediction errors of the plant, their gradients and starts are filtered by D (1 - q^-1) / C: see
`plant.coloured`. Starting points of the plant are made from differences if the noise drifts. Starting points
of C and D are estimated from the residuals of the plant.

The chain rule turns gradients by the coefficients into gradients by the parameters, of which some may be
known. Starting points are estimates of all coefficients, mapped to the parameters by least squares,
weighted by the information matrix. For many samples these estimates are efficient already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import cast

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.kind import STEP, Extension, Kind, Mask, Parts, Starts
from inputdesign_cli.identification.polynomial_starts import noise_polynomials
from inputdesign_cli.identification.records import Point, Records, evaluate
from inputdesign_cli.identification.stability import is_stable, reflected
from inputdesign_cli.identification.start import Start
from inputdesign_cli.plant import Coloured, Model, Parametrisation
from inputdesign_cli.plant.filtering import filtered

# A point is moved halfway towards the nominal one at most this often before the nominal one replaces it.
_HALVINGS = 40
_RIDGE = 1e-9  # the least eigenvalue of a scaled Hessian, relative to its largest
_MOST_EVALUATIONS = 60
_OUT_OF_BOUNDS = 1e12  # stands for a distance that is not finite


@dataclass(frozen=True)
class Derived(Kind):
    """A structure of K coefficients, of the `plant` and then of C and D, that follow from the parameters."""

    model: Model
    plant: Kind
    coloured: Coloured | None = None  # the model, if it has C and D besides the plant
    by: Parametrisation | None = None  # from parameters to coefficients; None: they are the same

    @property
    def _first(self) -> int:
        """Return the number of coefficients of the plant, which come before C and D."""
        return len(self.plant.model.names)

    def _all(self, theta: Array) -> Array:
        """Return the coefficients (K,) at theta."""
        return theta if self.by is None else self.by.at(theta).coefficients

    def _of_plant(self, theta: Array) -> Array:
        return self._all(theta)[: self._first]

    def _noise(self, theta: Array) -> Coloured | None:
        return None if self.coloured is None else self.coloured.at(self._all(theta))

    def _moving(self, of_plant: Mask, own: bool) -> Mask:
        """Return the mask (k,) of the parameters that move a marked coefficient; `own` marks C and D."""
        size = 0 if self.coloured is None else len(self.coloured.own_parameters)
        marked = np.concatenate([of_plant, np.full(size, own)])
        return marked if self.by is None else np.any(self.by.moves[marked], axis=0)

    @property
    def recent(self) -> int:
        """Return the largest lag at which inputs act directly on the plant."""
        return self.plant.recent

    @property
    def explaining(self) -> Mask:
        """Return the mask (k,) of parameters that move an explaining coefficient of the plant."""
        return self._moving(self.plant.explaining, own=False)

    @property
    def whitening(self) -> Mask:
        """Return the mask (k,) of parameters that move a whitening coefficient, C or D."""
        return self._moving(self.plant.whitening, own=True)

    def errors_and_gradient(self, theta: Array, u: Array, y: Array) -> tuple[Array, Array]:
        """Return prediction errors (N, p) from rest, and psi (k, N, p); NaN if a coefficient is infinite."""
        here = None if self.by is None else self.by.at(theta)
        if here is not None and here.undefined is not None:
            return np.full(y.shape, np.nan), np.full((theta.size, *y.shape), np.nan)
        errors, psi = self._by_coefficients(theta, u, y)
        return errors, psi if here is None else np.tensordot(here.jacobian, psi, axes=(0, 0))

    def _by_coefficients(self, theta: Array, u: Array, y: Array) -> tuple[Array, Array]:
        """Return errors (N, p) from rest, and minus their derivatives (K, N, p) by the coefficients."""
        errors, psi = self.plant.errors_and_gradient(self._of_plant(theta), u, y)
        noise = self._noise(theta)
        return (errors, psi) if noise is None else _coloured(noise, errors, psi)

    def leaks(self, theta: Array, u: Array, y: Array) -> Array:
        """Return minus the derivatives by constant terms of denominators that are known to be zero."""
        if self.by is None:
            return super().leaks(theta, u, y)
        held = ~np.any(self.by.moves[: self._first], axis=1) & (self._of_plant(theta) == 0.0)
        last = [name.partition("[")[0] == "a0" for name in self.plant.model.names]  # plants in s
        leaks = np.flatnonzero(held & last)
        return self._by_coefficients(theta, u, y)[1][leaks] if leaks.size else super().leaks(theta, u, y)

    def starts(self, theta: Array, samples: int, late: int, *, free: bool) -> tuple[Start, ...]:
        """Return the starts of the plant, and the effect of noise before the record through C/D."""
        raw, noise = self.plant.starts(self._of_plant(theta), samples, late, free=free), self._noise(theta)
        if noise is None:
            return raw
        return tuple(start.through(C, D) for start, (D, C) in zip(raw, noise.inverse_filters, strict=True))

    def in_starts(self, late: int, *, free: bool) -> Mask:
        """Return the mask of parameters that move a coefficient on which the starts depend."""
        return self._moving(self.plant.in_starts(late, free=free), own=True)

    def start_steps(self, theta: Array, samples: int) -> Array:
        """Return the steps of the coefficients, or small shares of parameters, whose units may be any."""
        if self.by is not None:
            return STEP * np.where(theta == 0.0, 1.0, np.abs(theta))
        of_plant = self.plant.start_steps(theta[: self._first], samples)
        return np.concatenate([of_plant, super().start_steps(theta[self._first :], samples)])

    def lateness(self, theta: Array) -> int:
        """Return the number of samples in which earlier inputs act on the plant; see `Kind`."""
        return self.plant.lateness(self._of_plant(theta))

    def crossings(self, theta: Array, samples: int) -> Array:
        """Return the smallest steps of the parameters that move the dead times to their crossings."""
        late, coefficients = np.flatnonzero(self.plant.model.dead_times), self._all(theta)
        steps = self.plant.crossings(coefficients[: self._first], samples)[:, :, late]
        jacobian = np.eye(theta.size) if self.by is None else self.by.at(theta).jacobian
        back = np.linalg.pinv(jacobian[late], rcond=1e-12)
        return np.asarray(steps @ back.T) if steps.size else np.zeros((0, 2, theta.size))

    def whitened(self, theta: Array, signals: Array) -> Array:
        """Return signals (N, m) filtered by the inverse noise model of each output, as (p, N, m)."""
        raw, noise = self.plant.whitened(self._of_plant(theta), signals), self._noise(theta)
        if noise is None:
            return raw
        return np.array(
            [filtered(*own, x, axis=0) for own, x in zip(noise.inverse_filters, raw, strict=True)]
        )

    def stabilised(self, theta: Array, samples: int) -> Array:
        """Return theta if its predictor is stable, otherwise the nominal parameters moved towards it.

        They move one after the other, so that one at its bound, as a dead time of zero, blocks no other.
        If the parameters are the coefficients, unstable polynomials are mirrored instead.
        """
        if self.by is None:
            return self._stable(theta, samples)

        def is_usable(point: Array) -> bool:
            own = self._all(point)
            return bool(np.all(np.isfinite(own))) and np.array_equal(self._stable(own, samples), own)

        if is_usable(theta):
            return theta.copy()
        point = self.model.theta.copy()
        for index, home in enumerate(point.tolist()):
            for share in (*0.5 ** np.arange(_HALVINGS), 0.0):
                point[index] = home + share * (theta[index] - home)
                if share == 0.0 or is_usable(point):
                    break
        return point

    def _stable(self, coefficients: Array, samples: int) -> Array:
        """Return coefficients (K,), changed where the predictor would be unstable."""
        out = coefficients.copy()
        out[: self._first] = self.plant.stabilised(coefficients[: self._first], samples)
        if self.coloured is not None:
            groups: dict[tuple[str, tuple[tuple[int, int], ...]], list[int]] = {}
            for index, parameter in enumerate(self.coloured.own_parameters, start=self._first):
                if self.coloured.below(parameter.letter, parameter.places[0][0])[0] is not None:
                    groups.setdefault((parameter.letter, parameter.places), []).append(index)
            for columns in map(np.array, groups.values()):
                monic = np.append(1.0, coefficients[columns])
                if not is_stable(monic[None])[0]:
                    out[columns] = reflected(monic)[1:]
        return out

    def starting_points(self, parts: Parts, given: Array | None, known: Mask | None = None) -> Starts:
        """Return the starting points of all coefficients, mapped to the parameters, and the `given` one."""
        if self.by is not None:
            found = self.plant.starting_points(parts, None, ~np.any(self.by.moves, axis=1))
            about = Records(self.plant, tuple(parts))
            points = [brought_back(self.by, evaluate(about, theta)) for theta in found.points]
        else:
            noise = cast(Coloured, self.coloured)
            fixed = reduce(np.convolve, {tuple(p): p for p in noise.fixed}.values())
            clear = [(_filtered(fixed, u), _filtered(fixed, y)) for u, y in parts]
            start = None if given is None else given[: self._first]
            found = self.plant.starting_points(clear, start, None if known is None else known[: self._first])
            left = [self.plant.errors_and_gradient(theta, *parts[0])[0] for theta in found.points]
            pairs = zip(found.points, left, strict=True)
            points = [np.append(theta, _of_residuals(noise, errors)) for theta, errors in pairs]
        return Starts(np.array(points), found.tried).and_given(given)

    def extensions(self, theta: Array, *, feedback: bool) -> list[Extension]:
        """Return the extensions of the plant; the tests with many regressors cover C and D."""
        found, noise = self.plant.extensions(self._of_plant(theta), feedback=feedback), self._noise(theta)
        if noise is None:
            return found
        return [one._replace(model=replace(noise, plant=one.model)) for one in found]

    def simulates(self, theta: Array) -> Sequence[bool]:
        """Return which outputs of the plant can be simulated."""
        return self.plant.simulates(self._of_plant(theta))


def brought_back(at: Parametrisation, point: Point) -> Array:
    """Return the parameters (k,) whose coefficients are nearest to a point, weighted by its Hessian."""
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

    # Where the coefficients hardly depend on the parameters, a step may overflow; it is then rejected.
    with np.errstate(over="ignore", invalid="ignore"):
        found = scipy.optimize.least_squares(
            distance, at.theta / unit, jac=slope, x_scale="jac", max_nfev=_MOST_EVALUATIONS
        )
    return np.asarray(found.x * unit, dtype=float)


def _coloured(noise: Coloured, raw: Array, of_plant: Array) -> tuple[Array, Array]:
    """Return errors (N, p) and psi (K, N, p) of all coefficients from the plant's."""
    first, errors = len(of_plant), np.empty(raw.shape)
    psi = np.zeros((first + len(noise.own_parameters), *raw.shape))
    for i, (above, below) in enumerate(noise.inverse_filters):
        errors[:, i] = filtered(above, below, raw[:, i])
        psi[:first, :, i] = filtered(above, below, of_plant[:, :, i])
    for index, parameter in enumerate(noise.own_parameters, start=first):
        for i, _ in parameter.places:
            polynomial, sign = noise.below(parameter.letter, i)
            if polynomial is not None and parameter.power < len(errors):
                late = filtered([sign], polynomial, errors[:, i])
                psi[index, parameter.power :, i] = late[: len(errors) - parameter.power]
    return errors, psi


def _of_residuals(noise: Coloured, errors: Array) -> Array:
    """Return C and D from residuals (N, p) of the plant; shared ones are means over outputs."""
    own, values = noise.own_parameters, dict[tuple[str, int, int], float]()
    if not np.all(np.isfinite(errors)):
        return np.zeros(len(own))
    for i, fixed in enumerate(noise.fixed):
        c, d = (
            max((p.power for p in own if p.letter == letter and (i, i) in p.places), default=0)
            for letter in "cd"
        )
        for letter, row in zip("cd", noise_polynomials(_filtered(fixed, errors[:, i]), c, d), strict=True):
            values |= {(letter, lag, i): float(value) for lag, value in enumerate(row, start=1)}
    return np.array([np.mean([values[one.letter, one.power, i] for i, _ in one.places]) for one in own])


def _filtered(known: Array, signals: Array) -> Array:
    """Return signals (N, ..) filtered by a polynomial, without first samples, whose past is unknown."""
    return filtered(known, [1.0], signals, axis=0)[known.size - 1 :]
