"""Compute prediction-error estimates of polynomial models in q^-1, and of their noise.

The covariance of e is estimated along with theta. The estimate minimises the determinant of the residuals'
covariance, which weighs each residual by its dependence on the others ([ljung-1999], Sections 7.2 and 15.2).
With one output it is the sum of squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.identification.estimate import BatchEstimate, Estimate
from inputdesign_cli.identification.extensions import Extension, echo_of, larger_polynomials, new_name
from inputdesign_cli.identification.gauss_newton import Minimum, best_run, minimise
from inputdesign_cli.identification.kind import Part, Starts, identify_records
from inputdesign_cli.identification.of_model import OfModel
from inputdesign_cli.identification.orders import OutputOrders
from inputdesign_cli.identification.polynomial_record import PolynomialRecord
from inputdesign_cli.identification.problem import PredictionErrors, inverses
from inputdesign_cli.identification.search import Search
from inputdesign_cli.identification.starts import starting_points
from inputdesign_cli.identification.structure import Structure
from inputdesign_cli.identification.white import Echoes
from inputdesign_cli.plant import PolynomialModel

# Many runs share the cost of a pass over time; with more outputs at once the blocks no longer fit the cache.
_OUTPUTS_AT_ONCE = 512


@dataclass(frozen=True)
class PolynomialKind(OfModel):
    """Polynomials in q^-1; see `Kind`."""

    model: PolynomialModel
    structure: Structure

    @property
    def recent(self) -> int:
        """Return how far back the regressions look."""
        return self.structure.memory

    @property
    def explaining(self) -> NDArray[np.bool_]:
        """Return the mask (k,) of the coefficients of B and F."""
        return np.array([parameter.letter in "bf" for parameter in self.model.parameters], dtype=bool)

    @property
    def whitening(self) -> NDArray[np.bool_]:
        """Return the mask (k,) of the coefficients of A, C and D."""
        return ~self.explaining

    def own(self) -> Array:
        """Return the number of parameters of each output (p,)."""
        return self.structure.own()

    def record(self, u: Array, y: Array) -> PolynomialRecord:
        """Return the record of samples u (N, r), y (N, p) that the structure is to explain."""
        return PolynomialRecord(self.structure, u, y)

    def starts(self, parts: Sequence[Part], given: Array | None) -> Starts:
        """Each output estimated alone, then what outputs share weighed by how well each knows it."""
        found = [
            _starts(self.structure, self.structure.problem(*(x[None] for x in part)), given) for part in parts
        ]
        points = np.concatenate([p for p, _ in found])
        return Starts(points, np.zeros(len(points), dtype=np.int64), max(tried for _, tried in found))

    def extensions(self, theta: Array, *, feedback: bool) -> tuple[Extension, ...]:
        """Return the extensions by a further coefficient in any of the polynomials."""
        found = []
        for larger, what in larger_polynomials(self.model.at(theta), feedback=feedback):
            name, record = new_name(larger, self.model), partial(PolynomialRecord, Structure.of(larger))
            found.append(Extension(larger, name, what, record, through=partial(echo_of, larger, name)))
        return tuple(found)

    def echoes(self, theta: Array, lengths: Sequence[int]) -> Echoes | None:
        """Return the echoes of the coefficients of A, C and D."""
        model = self.model.at(theta)
        found = ((k, echo_of(model, name, lengths)) for k, name in enumerate(model.names))
        return tuple((k, through) for k, through in found if through is not None)

    def simulated(
        self, found: Search, y: Array, lengths: Sequence[int] | None
    ) -> tuple[Array, Sequence[bool]]:
        """Return the response of the estimate to the inputs, and the part that unknown starts explain."""
        return self.caused(found, y, lengths), self.model.at(found.point.theta).stable_outputs


def identify_polynomials(
    model: PolynomialModel,
    u: ArrayLike,
    y: ArrayLike,
    *,
    start: ArrayLike | None = None,
    noise: ArrayLike | None = None,
    feedback: bool = False,
    lengths: Sequence[int] | None = None,
    rest: bool | None = None,
    earlier: Earlier | None = None,
) -> Estimate:
    """Return the prediction-error estimate from one record; in closed loop by the direct method.

    Each output is first estimated alone, from several starts (`start` among them if given). Shared
    parameters are then averaged, weighed by the information of each output. The joint search begins there
    and at `start`. Without C, D and F (ARX) this is least squares, generalised by the covariance of e.

    Args:
        model: gives the orders and delays, zero entries and common polynomials; its numbers are not used.
        u, y: (samples, r), (samples, p).
        start: (k,).
        noise: the covariance of e (p, p) if it is known; it is then not estimated.
        feedback: whether u(t) depends on y(t); the tests of the residuals account for it.
        lengths: of the records that follow each other in u and y; None for one.
        rest: whether each begins at rest about zero; None: as the data say.
        earlier: an estimate from other data, which counts along.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output`, `noise-free-data` or
            `not-exciting`.
    """
    return identify_records(
        PolynomialKind(model, Structure.of(model)),
        np.asarray(u, dtype=float),
        np.asarray(y, dtype=float),
        start=None if start is None else np.asarray(start, dtype=float),
        feedback=feedback,
        lengths=lengths,
        rest=rest,
        earlier=earlier,
        weights=None if noise is None else np.linalg.inv(np.asarray(noise, dtype=float)),
    )


def fit_polynomials(model: PolynomialModel, u: ArrayLike, y: ArrayLike, *, start: ArrayLike) -> BatchEstimate:
    """Return prediction-error estimates of many records in one pass.

    Args:
        model: of which the structure is meant, see `identify_polynomials`.
        u, y: (runs, samples, r), (runs, samples, p).
        start: (k,) for all runs, or (runs, k).
    """
    structure = Structure.of(model)
    inputs, outputs = np.asarray(u, dtype=float), np.asarray(y, dtype=float)
    begin = np.broadcast_to(np.asarray(start, dtype=float), (len(outputs), structure.size))
    size = max(1, _OUTPUTS_AT_ONCE // len(structure.rows))
    parts = []
    for first in range(0, len(outputs), size):
        some = slice(first, first + size)
        record = structure.problem(inputs[some], outputs[some])
        found = minimise(record, begin[some])
        noise, information = _noise_and_information(structure, record, found)
        parts.append((found.theta, noise, information, found.converged, found.steps))
    theta, noise, information, converged, steps = (
        np.concatenate([part[index] for part in parts]) for index in range(5)
    )
    return BatchEstimate(theta, noise, information, converged, steps)


def _starts(structure: Structure, record: PredictionErrors, start: Array | None) -> tuple[Array, int]:
    """Where the search for all outputs begins (points, k), and how many starts an output alone has had."""
    own = [
        _starts_alone(row, place, record, y, start) if place.size else np.zeros((0, 0))
        for row, place, y in zip(structure.rows, structure.places, record.y, strict=True)
    ]
    tried = max(len(points) for points in own)
    if len(own) == 1:
        points = np.empty_like(own[0])
        points[:, structure.places[0]] = own[0]
        return points, tried
    alone = _one_by_one(structure, record, own)
    return np.array([alone] if start is None else [start, alone]), tried


def _starts_alone(
    row: OutputOrders, place: NDArray[np.int64], record: PredictionErrors, y: Array, start: Array | None
) -> Array:
    """Return the starting points (points, own k) of one output alone."""
    points = starting_points(row, [x[:, 0] for x in record.u], y[:, 0])
    return points if start is None else np.concatenate([start[None, place], points])


def _one_by_one(structure: Structure, record: PredictionErrors, starts: list[Array]) -> Array:
    """Return theta (k,) from each output alone: the information of all, added up."""
    total, moment = np.zeros((structure.size, structure.size)), np.zeros(structure.size)
    for row, place, y, points in zip(structure.rows, structure.places, record.y, starts, strict=True):
        if not place.size:
            continue
        single = PredictionErrors.single(row, record.u, y)
        found = minimise(single.repeated(len(points)), points)
        best = best_run(found)
        information = found.hessian[best] / max(found.cost[best], 1e-300)
        total[np.ix_(place, place)] += information
        moment[place] += information @ found.theta[best]
    scale = np.sqrt(np.maximum(np.diag(total), 1e-300))
    scaled = np.linalg.lstsq(total / np.outer(scale, scale), moment / scale, rcond=None)[0]
    return np.asarray(scaled / scale)


def _noise_and_information(
    structure: Structure, record: PredictionErrors, found: Minimum
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the covariance of e (runs, p, p) and the information of theta (runs, k, k) at the minima."""
    samples = record.y[0].shape[0]
    if len(structure.rows) == 1:  # the search has computed it already
        noise = _covariances(structure, found.cost[:, None, None], samples)
        return noise, found.hessian / np.maximum(noise, 1e-300)
    sums = record.sums(found.theta)
    noise = _covariances(structure, sums.errors, samples)
    return noise, record.gathered(sums, inverses(noise)[0])[0]


def _covariances(structure: Structure, squares: NDArray[np.float64], samples: int) -> NDArray[np.float64]:
    """The covariance of e (runs, p, p) from sums of epsilon epsilon^T; every output's parameters count."""
    left = np.sqrt(np.maximum(samples - structure.own(), 1.0))
    return squares / np.outer(left, left)
