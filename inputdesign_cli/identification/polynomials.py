"""Estimate polynomial models in q^-1 and their noise.

The covariance of e is estimated along with theta. The estimate minimises the determinant of the residuals'
covariance, which weighs each residual by its dependence on the others ([ljung-1999], Sections 7.2 and 15.2).
With one output it is the sum of squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from inputdesign_cli.arrays import Array, Rows
from inputdesign_cli.identification.gauss_newton import best_run, minimise
from inputdesign_cli.identification.kind import Batch, Extension, Kind, Mask, Parts, Starts
from inputdesign_cli.identification.polynomial_rows import (
    FromRest,
    Row,
    errors_and_gradients,
    owners,
    rows_of,
    stabilised,
)
from inputdesign_cli.identification.polynomial_starts import starting_points
from inputdesign_cli.identification.start import Start, each_later
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.plant.filtering import filtered


@dataclass(frozen=True)
class PolynomialKind(Kind):
    """A polynomial model in q^-1; see `Kind`."""

    model: PolynomialModel

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """Return a row for every output."""
        return rows_of(self.model)

    @property
    def recent(self) -> int:
        """Return the largest lag of the regressions."""
        return max(row.memory for row in self.rows)

    @property
    def explaining(self) -> Mask:
        """Return the mask (k,) of the coefficients of B and F."""
        return self._among("bf")

    def errors_and_gradient(self, theta: Array, u: Array, y: Array) -> tuple[Array, Array]:
        """Return prediction errors (N, p) from rest, and psi (k, N, p)."""
        errors, each = errors_and_gradients(self.rows, theta[None], u.T[None], y.T[None])
        psi = np.zeros((theta.size, *y.shape))
        for output, column, own in zip(*owners(self.rows), each[0], strict=True):
            psi[column, :, output] = own
        return errors[0].T, psi

    def batch(self, u: Array, y: Array) -> Batch:
        """Return the problem of records (runs, N, r), (runs, N, p) that begin at rest, noise as well."""
        return FromRest.of(self.model, u, y)

    def starts(self, theta: Array, samples: int, late: int, *, free: bool) -> tuple[Start, ...]:
        """Return the effect of the past on the prediction errors, output by output.

        The inverse noise model D/C filters A y - sum_j (B_j/F_j) u_j, which is wrong by impulses if earlier y
        and u are missing. An unknown state of an entry adds impulses through 1/F_j. An unknown level of its
        input adds a step, which the others make up for unless F_j integrates or nearly does. From rest only
        y is missing, moved by noise. That matters only if the predictor remembers y beyond its order.
        """
        return tuple(_start(row, theta, samples, free=free) for row in self.rows)

    def lateness(self, theta: Array) -> int:
        """Return the number of samples by which B looks back further than F."""
        entries = (entry for row in self.rows for entry in zip(row.b, row.f, strict=True))
        return max([0, *(b.lags.stop - f.lags.stop for b, f in entries)])

    def in_starts(self, late: int, *, free: bool) -> Mask:
        """Return the mask of the coefficients of C and D; of F as well if the states are free."""
        return self._among("cdf" if free else "cd")

    def _among(self, letters: str) -> Mask:
        return np.array([parameter.letter in letters for parameter in self.model.parameters], dtype=bool)

    def whitened(self, theta: Array, signals: Array) -> Array:
        """Return signals (N, m) filtered by D/C of each output, as (p, N, m)."""
        return np.array([filtered(*row.whitening(theta), signals, axis=0) for row in self.rows])

    def stabilised(self, theta: Array, samples: int) -> Array:
        """Return theta with the roots of C, D and F inside the unit circle."""
        return stabilised(self.rows, theta[None])[0]

    def starting_points(self, parts: Parts, given: Array | None, known: Mask | None = None) -> Starts:
        """Return each output's own estimate; shared parameters are weighted by the information of each."""
        listed = np.zeros((0, len(self.model.names))) if given is None else given[None]
        points, tried = list[Array](), 0
        for u, y in parts:
            alone = [
                np.concatenate([listed, starting_points(row, len(self.model.names), u, own)])
                for row, own in zip(self.rows, y.T, strict=True)
            ]
            tried = max(tried, *(len(starts) for starts in alone))
            single = len(alone) == 1
            points += [*alone] if single else [listed, self._one_by_one(u, y, alone)[None]]
        return Starts(np.concatenate(points), tried)

    def _one_by_one(self, u: Array, y: Array, starts: Sequence[Array]) -> Array:
        """Return theta (k,) from each output alone, combined by the sum of the information matrices."""
        size = len(self.model.names)
        total, moment = np.zeros((size, size)), np.zeros(size)
        for row, own, points in zip(self.rows, y.T, starts, strict=True):
            if row.size:
                inputs, output = (np.repeat(x[None], len(points), axis=0) for x in (u.T, own[None]))
                found = minimise(FromRest((row,), inputs, output), points)
                best = best_run(found)
                information = found.hessian[best] / max(found.cost[best], 1e-300)
                total += information
                moment += information @ found.theta[best]
        scale = np.sqrt(np.maximum(np.diag(total), 1e-300))
        scaled = np.linalg.lstsq(total / np.outer(scale, scale), moment / scale, rcond=None)[0]
        return np.asarray(scaled / scale)

    def extensions(self, theta: Array, *, feedback: bool) -> list[Extension]:
        """Return the extensions by a further coefficient in any of the polynomials, or by a shorter delay."""
        model, larger = self.model.at(theta), []
        for i, j in model.active:
            B, F = model.B[i][j], model.F[i][j]
            longer = replace(model, B=with_entry(model.B, i, j, np.append(B, 0.0)))
            larger.append((longer, "coefficient in B"))
            if model.row(model.A, i).size == 1 or F.size > 1:
                longer = replace(model, F=with_entry(model.F, i, j, np.append(F, 0.0)))
                larger.append((longer, "pole in F"))
            if model.first[i][j] > int(feedback):
                earlier = np.array(model.first)
                earlier[i, j] -= 1
                sooner = replace(model, delays=tuple(map(tuple, earlier.tolist())))
                larger.append((sooner, "coefficient in B before the others"))
        for i in (i for i, row in enumerate(model.A) if row.size > 1):
            larger.append((replace(model, A=_longer(model.A, i)), "pole in A"))
        for i in range(len(model.C)):
            larger.append((replace(model, C=_longer(model.C, i)), "coefficient in C"))
        for i in range(len(model.D)):
            larger.append((replace(model, D=_longer(model.D, i)), "coefficient in D"))
        return [Extension.of(model, one, what) for one, what in larger]

    def simulates(self, theta: Array) -> Sequence[bool]:
        """Return which rows of G are stable."""
        return self.model.at(theta).stable_outputs


def _start(row: Row, theta: Array, samples: int, *, free: bool) -> Start:
    """Return the effect of an unknown past: impulses and levels, directly and through 1/F."""
    impulse, level = np.eye(1, samples)[0], np.ones(samples)
    if free:
        older = [b.lags.stop - f.lags.stop for b, f in zip(row.b, row.f, strict=True)]
        parts = [(level, 1), (impulse, max([row.a.lags.stop - 1, *older]))]
        for f in row.f:
            if f.lags:
                F = f.polynomial(theta[None])[0]
                parts += [(filtered([1.0], F, impulse), len(f.lags)), (filtered([1.0], F, level), 1)]
    else:
        parts = [(impulse, len(row.a.lags) if row.c.lags else 0)]
    D, C = row.whitening(theta)
    return Start.white(np.concatenate([each_later(one, count) for one, count in parts])).through(C, D)


def with_entry(rows: Rows, i: int, j: int, entry: Array) -> Rows:
    """Return a table with the entry at (i, j) replaced."""
    return tuple(
        tuple(entry if (o, n) == (i, j) else p for n, p in enumerate(row)) for o, row in enumerate(rows)
    )


def _longer(rows: tuple[Array, ...], i: int) -> tuple[Array, ...]:
    return (*rows[:i], np.append(rows[i], 0.0), *rows[i + 1 :])
