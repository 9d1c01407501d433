"""Estimate polynomial models in q^-1 and their noise.

The covariance of e is estimated along with theta. The estimate minimises the determinant of the residuals'
covariance, which weighs each residual by its dependence on the others ([ljung-1999], Sections 7.2 and 15.2).
With one output it is the sum of squares.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, Rows
from inputdesign_cli.identification.gauss_newton import best_run, minimise
from inputdesign_cli.identification.kind import Echo, Echoes, Extension, Kind, Part, Starts, shares
from inputdesign_cli.identification.noise_first import late_echo
from inputdesign_cli.identification.polynomial_rows import Row, errors_and_sources
from inputdesign_cli.identification.problem import weighing
from inputdesign_cli.identification.stability import is_stable, reflected, without_integrators
from inputdesign_cli.identification.start import Start, density, each_later, noise_before
from inputdesign_cli.identification.starts import starting_points
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.plant.filtering import filtered

_STEP = 1e-30
# Samples of as many runs stay in the cache.
_NUMBERS_AT_ONCE = 16_000


@dataclass(frozen=True)
class PolynomialKind(Kind):
    """Polynomials in q^-1; see `Kind`."""

    model: PolynomialModel

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """Return a row for every output."""
        return tuple(Row.of(self.model, output) for output in range(self.outputs))

    @property
    def recent(self) -> int:
        """Return how far back the regressions look."""
        return max(row.memory for row in self.rows)

    @property
    def explaining(self) -> NDArray[np.bool_]:
        """Return the mask (k,) of the coefficients of B and F."""
        return np.array([parameter.letter in "bf" for parameter in self.model.parameters], dtype=bool)

    def own(self) -> Array:
        """Return the number of parameters of each output (p,)."""
        return shares(self.model.parameters, self.outputs)

    def errors_and_gradient(self, theta: Array, u: Array, y: Array) -> tuple[Array, NDArray[np.float64]]:
        """Return prediction errors (N, p) from rest, and psi (k, N, p)."""
        errors, psi = np.empty(y.shape), np.zeros((theta.size, *y.shape))
        for i, row in enumerate(self.rows):
            own, sources = errors_and_sources(row, theta[None], u.T[None], y[None, :, i])
            errors[:, i] = own[0]
            for one, source in sources:
                for column, lag in zip(one.columns, one.lags, strict=True):
                    psi[column, lag:, i] = source[0, : len(y) - lag]
        return errors, psi

    def starts(self, theta: Array, samples: int, late: int, *, free: bool) -> tuple[Start, ...]:
        """Return the starts, output by output.

        The noise model D/C is applied to A y - sum_j (B_j/F_j) u_j. This sum is off by impulses if y and u
        before the record are missing. It is off by impulses through 1/F_j if the state of an entry is,
        and by a step through it if the level of its input is. For a stable F_j the others make up for the
        step, but not if F_j integrates or nearly does. From rest only y is missing, which noise has moved.
        That matters only if the predictor remembers y beyond its order.
        """
        return tuple(_start(row, theta, samples, free=free) for row in self.rows)

    def lateness(self, theta: Array) -> int:
        """Return by how many samples B looks back further than F."""
        entries = (entry for row in self.rows for entry in zip(row.b, row.f, strict=True))
        return max([0, *(b.lags.stop - f.lags.stop for b, f in entries)])

    def in_starts(self, late: int, *, free: bool) -> NDArray[np.int64]:
        """Return the indices of the coefficients of C and D; of F as well if the states are free."""
        letters = "cdf" if free else "cd"
        return np.flatnonzero([parameter.letter in letters for parameter in self.model.parameters])

    def start_slopes(
        self, theta: Array, indices: Sequence[int], samples: int, late: int, *, free: bool
    ) -> list[tuple[Start, ...]]:
        """By steps along the imaginary axis, which lose no digits to a difference ([squire-trapp-1998])."""
        here, found = self.starts(theta, samples, late, free=free), []
        still = [Start(*(np.zeros_like(block) for block in start)) for start in here]
        for index in indices:
            moved = theta + 1j * _STEP * (np.arange(theta.size) == index)
            slopes = []
            for row, none in zip(self.rows, still, strict=True):
                acts = any(index in one.columns for one in row.all)
                start = _start(row, moved, samples, free=free) if acts else none
                slopes.append(Start(*(np.imag(block) / _STEP for block in start)))
            found.append(tuple(slopes))
        return found

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """Return signals (N, m) through D/C of each output (p, N, m)."""
        return np.array([filtered(*row.whitening(theta), signals, axis=0) for row in self.rows])

    def stabilised(self, theta: Array, samples: int) -> Array:
        """Return theta with the roots of C, D and F in the unit circle."""
        return stabilised(self.rows, theta[None])[0]

    def starting_points(self, parts: Sequence[Part], given: Array | None) -> Starts:
        """Each output estimated alone, then what outputs share weighed by how well each knows it."""
        found = [self._starting_points(*part, given) for part in parts]
        points = np.concatenate([p for p, _ in found])
        return Starts(points, np.zeros(len(points), dtype=np.int64), max(tried for _, tried in found))

    def _starting_points(self, u: Array, y: Array, given: Array | None) -> tuple[Array, int]:
        """Return points (points, k) from one record, and how many starts an output alone has had."""
        listed = np.zeros((0, len(self.names))) if given is None else given[None]
        alone = [
            np.concatenate([listed, starting_points(row, len(self.names), u, own)])
            for row, own in zip(self.rows, y.T, strict=True)
        ]
        tried = max(len(points) for points in alone)
        if len(alone) == 1:
            return alone[0], tried
        return np.concatenate([listed, self._one_by_one(u, y, alone)[None]]), tried

    def _one_by_one(self, u: Array, y: Array, starts: Sequence[Array]) -> Array:
        """Return theta (k,) from each output alone: the information of all, added up."""
        size = len(self.names)
        total, moment = np.zeros((size, size)), np.zeros(size)
        for row, own, points in zip(self.rows, y.T, starts, strict=True):
            if not row.size:
                continue
            inputs, output = (np.repeat(x[None], len(points), axis=0) for x in (u.T, own[None]))
            found = minimise(FromRest((row,), inputs, output), points)
            best = best_run(found)
            information = found.hessian[best] / max(found.cost[best], 1e-300)
            total += information
            moment += information @ found.theta[best]
        scale = np.sqrt(np.maximum(np.diag(total), 1e-300))
        scaled = np.linalg.lstsq(total / np.outer(scale, scale), moment / scale, rcond=None)[0]
        return np.asarray(scaled / scale)

    def extensions(self, theta: Array, *, feedback: bool) -> tuple[Extension, ...]:
        """Return the extensions by a further coefficient in any of the polynomials."""
        found = []
        for larger, what in _larger(self.model.at(theta), feedback=feedback):
            (name,) = set(larger.names) - set(self.names)
            found.append(
                Extension(larger, PolynomialKind(larger), name, what, through=partial(_echo, larger, name))
            )
        return tuple(found)

    def echoes(self, theta: Array, lengths: Sequence[int]) -> Echoes | None:
        """Return the echoes of the coefficients of A, C and D."""
        model = self.model.at(theta)
        found = ((k, _echo(model, name, lengths)) for k, name in enumerate(model.names))
        return tuple((k, through) for k, through in found if through is not None)

    def simulates(self, theta: Array) -> Sequence[bool]:
        """Return which rows of G are stable."""
        return self.model.at(theta).stable_outputs


@dataclass(frozen=True)
class FromRest:
    """The problem of fitting many records that begin at rest, noise as well; see `gauss_newton.Problem`.

    Attributes:
        rows: one an output.
        u, y: (runs, r, N), (runs, p, N).
    """

    rows: tuple[Row, ...]
    u: NDArray[np.float64]
    y: NDArray[np.float64]

    @property
    def errors(self) -> int:
        """Return the number of prediction errors of a run."""
        return self.y[0].size

    def kept(self, runs: NDArray[np.bool_]) -> FromRest:
        """Return the problem with some of the runs only."""
        return replace(self, u=self.u[runs], y=self.y[runs])

    def stabilised(self, theta: Array) -> Array:
        """Return theta (runs, k) with stable predictors."""
        return stabilised(self.rows, theta)

    def at(self, theta: Array) -> tuple[Array, NDArray[np.float64], Array]:
        """Return cost (runs,), psi^T W psi (runs, k, k) and psi^T W e (runs, k); overflow costs infinity."""
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            sums = self.sums(theta)
            cost, weights = weighing(sums.errors / self.y.shape[2], self.y.shape[2])
            hessian, slope = sums.weighed(weights)
        finite = np.isfinite(cost) & np.isfinite(hessian).all(axis=(1, 2)) & np.isfinite(slope).all(axis=1)
        if not np.all(finite):
            cost = np.where(finite, cost, np.inf)
            hessian[~finite], slope[~finite] = np.eye(theta.shape[1]), 0.0
        return cost, hessian, slope

    def sums(self, theta: Array) -> Sums:
        """Return the sums from which the cost and its derivatives at theta (runs, k) are computed."""
        size = max(_NUMBERS_AT_ONCE // self.y[0].size, 1)
        some = [slice(first, first + size) for first in range(0, len(theta), size)]
        found = [self._products(theta[one], self.u[one], self.y[one]) for one in some]
        columns = np.concatenate([one.columns for row in self.rows for one in row.all])
        owner = np.repeat(np.arange(len(self.rows)), [row.size for row in self.rows])
        each = (np.concatenate(parts) for parts in zip(*found, strict=True))
        return Sums(owner, np.eye(theta.shape[1])[columns], *each)

    def _products(self, theta: Array, u: Array, y: Array) -> tuple[NDArray[np.float64], ...]:
        """Return e e^T, psi e^T and psi psi^T of few runs, see `Sums`."""
        samples, runs = y.shape[2], len(theta)
        errors, psi = np.empty(y.shape), np.zeros((runs, sum(row.size for row in self.rows), samples))
        number = 0
        for i, row in enumerate(self.rows):
            errors[:, i], sources = errors_and_sources(row, theta, u, y[:, i])
            of = {id(one): source for one, source in sources}
            for one in row.all:
                for lag in one.lags:
                    psi[:, number, lag:] = of[id(one)][:, : samples - lag]
                    number += 1
        turned = errors.swapaxes(1, 2)
        return errors @ turned, psi @ turned, psi @ psi.swapaxes(1, 2)


@dataclass(frozen=True)
class Sums:
    """Sums of products of residuals and gradients over the samples, for each run.

    Attributes:
        owner: (m,), the output that each gradient is of; `spread` (m, k), its parameter.
        errors, slopes, products: e e^T (runs, p, p), psi e^T (runs, m, p) and psi psi^T (runs, m, m).
    """

    owner: NDArray[np.int64]
    spread: Array
    errors: NDArray[np.float64]
    slopes: NDArray[np.float64]
    products: NDArray[np.float64]

    def weighed(self, weights: NDArray[np.float64]) -> tuple[NDArray[np.float64], Array]:
        """Return psi^T W psi (runs, k, k) and psi^T W e (runs, k) for weights (runs, p, p)."""
        products = self.products * weights[:, self.owner[:, None], self.owner[None, :]]
        slopes = np.sum(self.slopes * weights[:, self.owner, :], axis=2)
        return self.spread.T @ products @ self.spread, slopes @ self.spread


def stabilised(rows: Sequence[Row], theta: Array) -> Array:
    """Return theta (runs, k) with the roots of C, D and F mirrored into the unit circle if they leave it.

    Roots of F that are exactly one belong to integrators, and stay.
    """
    theta = theta.copy()
    monic = {tuple(one.columns): one for row in rows for one in (row.c, row.d, *row.f) if one.lags}
    for one in monic.values():
        polynomials = one.polynomial(theta)
        for run in np.flatnonzero(~is_stable(polynomials)):
            own = polynomials[run]
            moving = without_integrators(own) if one.letter == "f" else own
            if not is_stable(moving[None])[0]:
                theta[run, one.columns] = reflected(own)[1:]
    return theta


def _start(row: Row, theta: Array, samples: int, *, free: bool) -> Start:
    """Impulses, and levels, with what 1/F makes of them; each is filtered once, and delayed."""
    D, C = row.whitening(theta)
    impulse, level = np.eye(1, samples, dtype=theta.dtype)[0], np.ones(samples)
    if free:
        most = max(
            [row.a.lags.stop - 1, *(b.lags.stop - f.lags.stop for b, f in zip(row.b, row.f, strict=True))]
        )
        parts = [(level, 1), (impulse, most)]
        for f in row.f:
            if f.lags:
                F = f.polynomial(theta[None])[0]
                parts += [(filtered([1.0], F, impulse), len(f.lags)), (filtered([1.0], F, level), 1)]
    else:
        parts = [(impulse, len(row.a.lags) if row.c.lags else 0)]
    disturbance = np.concatenate([each_later(one, count) for one, count in parts])
    if C.size == D.size == 1:
        return Start.white(disturbance)
    through = np.concatenate([each_later(filtered(D, C, one), count) for one, count in parts])
    zeros = density(C) if row.c.lags else np.zeros(())
    return Start(through, disturbance, noise_before(C, D, samples), zeros)


def _echo(larger: PolynomialModel, name: str, lengths: Sequence[int]) -> Echo | None:
    """What past errors add to the gradient of a coefficient of A, C or D; None for others.

    epsilon = (D/C)(A y - ..): -d epsilon / d theta is epsilon(t - k) through 1/C for a c_k, through -1/D for
    a d_k and, by the noise in y, through -1/A for an a_k. Where that grows nothing is known of it: what holds
    the plant is not 1/A.
    """
    rows = {"a": (larger.A, -1.0), "c": (larger.C, 1.0), "d": (larger.D, -1.0)}
    parameter = next(one for one in larger.parameters if one.name == name)
    if parameter.letter not in rows:
        return None
    polynomials, sign = rows[parameter.letter]
    below = {i: (larger.row(polynomials, i), sign) for i, _ in parameter.places}
    if any(np.any(np.abs(np.roots(polynomial)) >= 1.0) for polynomial, _ in below.values()):
        return None
    return late_echo(below, parameter.power, lengths)


def _larger(model: PolynomialModel, *, feedback: bool) -> Iterator[tuple[PolynomialModel, str]]:
    """Yield models with a further coefficient in B, F (or A), C or D, or a shorter delay, and its name.

    Args:
        feedback: whether u(t) depends on y(t), so that it cannot act at once.
    """
    for i, j in model.active:
        B, F = model.B[i][j], model.F[i][j]
        yield replace(model, B=with_entry(model.B, i, j, np.append(B, 0.0))), "coefficient in B"
        if model.row(model.A, i).size == 1 or F.size > 1:
            yield replace(model, F=with_entry(model.F, i, j, np.append(F, 0.0))), "pole in F"
        if model.first[i][j] > int(feedback):
            earlier = np.array(model.first) - (np.arange(model.outputs)[:, None] == i) * (
                np.arange(model.inputs) == j
            )
            delays = tuple(map(tuple, earlier.tolist()))
            yield replace(model, delays=delays), "coefficient in B before the others"
    for i, A in enumerate(model.A):
        if A.size > 1:
            yield replace(model, A=_longer(model.A, i)), "pole in A"
    for i in range(len(model.C)):
        yield replace(model, C=_longer(model.C, i)), "coefficient in C"
    for i in range(len(model.D)):
        yield replace(model, D=_longer(model.D, i)), "coefficient in D"


def with_entry(rows: Rows, i: int, j: int, entry: Array) -> Rows:
    """Return a table with another entry."""
    return tuple(
        tuple(entry if (o, n) == (i, j) else p for n, p in enumerate(row)) for o, row in enumerate(rows)
    )


def _longer(rows: tuple[Array, ...], i: int) -> tuple[Array, ...]:
    return tuple(np.append(p, 0.0) if o == i else p for o, p in enumerate(rows))
