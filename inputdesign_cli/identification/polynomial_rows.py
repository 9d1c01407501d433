"""Prediction errors of polynomial models, output by output, and the estimates of many runs at once.

epsilon = (D/C)(A y - sum_j (B_j/F_j) u_j) and psi = -d epsilon / d theta ([ljung-1999], Section 10.3).
Signals are (runs, N), and start from rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg.blas
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.records import inverses, shares, weighing
from inputdesign_cli.identification.stability import is_stable, reflected, without_integrators
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.plant.polynomial import stack

# Runs are processed together up to this number of samples, which stay in the cache.
_NUMBERS_AT_ONCE = 16_000


@dataclass(frozen=True)
class Coefficients:
    """The free coefficients of one polynomial: their lags, and their `columns` in theta (k,)."""

    letter: str
    lags: range
    columns: NDArray[np.int64]

    @classmethod
    def of(cls, model: PolynomialModel, letter: str, place: tuple[int, int]) -> Coefficients:
        """Return the coefficients of a polynomial that acts at this output and input."""
        own = [
            (parameter.power, column)
            for column, parameter in enumerate(model.parameters)
            if parameter.letter == letter and place in parameter.places
        ]
        first = own[0][0] if own else 1
        columns = np.array([column for _, column in own], dtype=np.int64)
        return cls(letter, range(first, first + len(own)), columns)

    def polynomial(self, theta: Array) -> Array:
        """Return the polynomials (runs, order + 1) of parameters (runs, k), ascending in q^-1."""
        found = np.zeros((len(theta), self.lags.stop), dtype=theta.dtype)
        found[:, 0] = self.letter != "b"
        found[:, self.lags.start :] = theta[:, self.columns]
        return found


@dataclass(frozen=True)
class Row:
    """A y = sum_j (B_j / F_j) u_j + (C / D) e; B and F have one polynomial for each of the `inputs`."""

    inputs: tuple[int, ...]
    a: Coefficients
    b: tuple[Coefficients, ...]
    c: Coefficients
    d: Coefficients
    f: tuple[Coefficients, ...]

    @classmethod
    def of(cls, model: PolynomialModel, output: int) -> Row:
        """Return the row of an output; absent entries are left out."""
        inputs = tuple(j for i, j in model.active if i == output)
        at = {"a": (output, 0), "c": (output, output), "d": (output, output)}
        a, c, d = (Coefficients.of(model, letter, place) for letter, place in at.items())
        b, f = (tuple(Coefficients.of(model, letter, (output, j)) for j in inputs) for letter in "bf")
        return cls(inputs, a, b, c, d, f)

    @property
    def all(self) -> tuple[Coefficients, ...]:
        """Return the coefficients of all polynomials."""
        return (self.a, *self.b, self.c, self.d, *self.f)

    @property
    def size(self) -> int:
        """Return the number of coefficients."""
        return sum(len(one.lags) for one in self.all)

    @property
    def memory(self) -> int:
        """Return the largest lag of the regression, recursions aside."""
        return max(one.lags.stop for one in (self.a, *self.b)) - 1

    def whitening(self, theta: Array) -> tuple[Array, Array]:
        """Return the coefficients of D and C, (order + 1,) each, at parameters (k,)."""
        return self.d.polynomial(theta[None])[0], self.c.polynomial(theta[None])[0]


def rows_of(model: PolynomialModel) -> tuple[Row, ...]:
    """Return a row for every output."""
    return tuple(Row.of(model, output) for output in range(model.outputs))


def owners(rows: Sequence[Row]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the output (among these rows) and the index in theta of each coefficient, (m,)."""
    columns = np.concatenate([one.columns for row in rows for one in row.all])
    return np.repeat(np.arange(len(rows)), [row.size for row in rows]), columns


def errors_and_gradients(rows: Sequence[Row], theta: Array, u: Array, y: Array) -> tuple[Array, Array]:
    """Return errors epsilon (runs, p, N), and gradients psi (runs, m, N) of every coefficient in its output.

    Each of the p rows is for one output; theta (runs, k), u (runs, r, N) of all inputs, y (runs, p, N).
    """
    samples, number = y.shape[2], 0
    errors, psi = np.empty(y.shape), np.zeros((len(theta), sum(row.size for row in rows), samples))
    for i, row in enumerate(rows):
        A, C, D = (one.polynomial(theta) for one in (row.a, row.c, row.d))
        v, of_b, of_f = _multiplied(A, y[:, i]), [], []
        for j, b, f in zip(row.inputs, row.b, row.f, strict=True):
            B, F = b.polynomial(theta), f.polynomial(theta)
            x = _divided(F, u[:, j])
            v = v - _multiplied(B, x)
            of_b.append(_multiplied(D, _divided(C, x)))
            of_f.append(_multiplied(-B, _divided(F, of_b[-1])) if f.lags else x)
        shaped = _divided(C, v)
        errors[:, i] = _multiplied(D, shaped)
        of_a = _multiplied(-D, _divided(C, y[:, i])) if row.a.lags else shaped
        of_c = _divided(C, errors[:, i]) if row.c.lags else shaped
        # The gradients are delayed copies of these signals.
        for one, source in zip(row.all, (of_a, *of_b, of_c, -shaped, *of_f), strict=True):
            for lag in one.lags:
                psi[:, number, lag:] = source[:, : max(samples - lag, 0)]  # a short segment has no such past
                number += 1
    return errors, psi


def _multiplied(polynomials: Array, x: Array) -> Array:
    """Return sum_i p_i x(t - i) for polynomials p (runs, order + 1) and signals x (runs, N)."""
    out = polynomials[:, :1] * x
    for lag in range(1, min(polynomials.shape[1], x.shape[1])):
        out[:, lag:] += polynomials[:, lag, None] * x[:, :-lag]
    return out


def _divided(monic: Array, x: Array) -> Array:
    """Return x / D for monic polynomials D (runs, order + 1) and signals x (runs, N).

    All runs, one after the other, form one banded triangular system.
    """
    order = min(monic.shape[1], x.shape[1]) - 1
    if not order:
        return x
    diagonals = np.zeros((*x.shape, order + 1))
    for lag in range(1, order + 1):
        diagonals[:, :-lag, lag] = monic[:, lag, None]
    flat = scipy.linalg.blas.dtbsv(order, diagonals.reshape(-1, order + 1).T, x.ravel(), lower=1, diag=1)
    return np.asarray(flat).reshape(x.shape)


@dataclass(frozen=True)
class FromRest:
    """The problem of fitting many records that begin at rest, noise as well; see `gauss_newton.Problem`."""

    rows: tuple[Row, ...]  # one for each output
    u: Array  # (runs, r, N)
    y: Array  # (runs, p, N)
    skipped: int = 0  # errors at the beginning of each run that do not count

    @classmethod
    def of(cls, model: PolynomialModel, u: Array, y: Array, skipped: int = 0) -> FromRest:
        """Return the problem of fitting a model to records u (runs, N, r), y (runs, N, p)."""
        inputs, outputs = (np.ascontiguousarray(x.swapaxes(1, 2)) for x in (u, y))
        return cls(rows_of(model), inputs, outputs, skipped)

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

    def at(self, theta: Array) -> tuple[Array, Array, Array]:
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

    def concluded(self, theta: Array) -> tuple[Array, Array]:
        """Return the covariance (runs, p, p) of e, unbiased, and the information (runs, k, k) at theta."""
        sums = self.sums(theta)
        left = np.sqrt(np.maximum(self.y.shape[2] - sums.own, 1.0))
        noise = sums.errors / np.outer(left, left)
        return noise, sums.weighed(inverses(noise)[0])[0]

    def sums(self, theta: Array) -> Sums:
        """Return the sums from which the cost and its derivatives at theta (runs, k) are computed."""
        size = max(_NUMBERS_AT_ONCE // self.y[0].size, 1)
        found, kept = [], slice(self.skipped, None)
        for first in range(0, len(theta), size):
            some = slice(first, first + size)
            every = errors_and_gradients(self.rows, theta[some], self.u[some], self.y[some])
            errors, psi = (x[:, :, kept] for x in every)
            turned = errors.swapaxes(1, 2)
            found.append((errors @ turned, psi @ turned, psi @ psi.swapaxes(1, 2)))
        owner, columns = owners(self.rows)
        each = (np.concatenate(parts) for parts in zip(*found, strict=True))
        return Sums(owner, np.eye(theta.shape[1])[columns], *each)


@dataclass(frozen=True)
class Sums:
    """Sums of products of residuals and gradients over the samples, for each run."""

    owner: NDArray[np.int64]  # (m,), the output of each gradient
    spread: Array  # (m, k), one at the parameter of each gradient
    errors: Array  # e e^T (runs, p, p)
    slopes: Array  # psi e^T (runs, m, p)
    products: Array  # psi psi^T (runs, m, m)

    @property
    def own(self) -> Array:
        """Return the number of parameters of each output (p,); one that n outputs share counts as 1/n."""
        outputs = self.errors.shape[1]
        return shares(np.array([self.spread[self.owner == i].any(axis=0) for i in range(outputs)]).T)

    def weighed(self, weights: Array) -> tuple[Array, Array]:
        """Return psi^T W psi (runs, k, k) and psi^T W e (runs, k) for weights (runs, p, p)."""
        products = self.products * weights[:, self.owner[:, None], self.owner[None, :]]
        slopes = np.sum(self.slopes * weights[:, self.owner, :], axis=2)
        return self.spread.T @ products @ self.spread, slopes @ self.spread


def stabilised(rows: Sequence[Row], theta: Array) -> Array:
    """Return theta (runs, k) with roots of C, D and F outside the unit circle mirrored into it.

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


def is_arx(model: PolynomialModel) -> bool:
    """Return whether least squares is the prediction-error estimate: C, D and F are 1."""
    return all(parameter.letter in "ab" for parameter in model.parameters)


def least_squares(model: PolynomialModel, u: Array, y: Array) -> Array:
    """Return estimates (runs, k) of an ARX model in one step, weighted by its covariance ([ljung-1999], 4.2).

    Samples before u (runs, samples, r) and y (runs, samples, p) are unknown.
    """
    longest = max(parameter.power for parameter in model.parameters)
    nowhere, weights = np.zeros((len(y), model.theta.size)), np.linalg.inv(model.covariance)
    sums = FromRest.of(model, u, y, skipped=longest).sums(nowhere)
    normal, right = sums.weighed(np.broadcast_to(weights, (len(y), *weights.shape)))
    return np.asarray(np.linalg.solve(normal, right[:, :, None])[:, :, 0], dtype=float)


def estimated_polynomials(model: PolynomialModel, theta: Array) -> tuple[Array, Array]:
    """Return A (runs, p, l) and B (runs, p, r, m) of ARX estimates (runs, k), ascending in q^-1."""
    models = [model.at(row) for row in theta]
    A = [stack([one.per_output(one.A)])[0] for one in models]
    return np.array(A), np.array([stack(one.B) for one in models])
