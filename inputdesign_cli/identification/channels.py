"""Prediction-error estimates of polynomial models with several inputs and outputs, and of their noise.

The covariance of e is estimated along with theta: the estimate minimises the determinant of the residuals'
covariance, so that each residual is weighed by what the others tell of it; Ljung, System Identification
(1999), Sections 7.2 and 15.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.identification.channel_estimate import ChannelEstimate, concluded
from inputdesign_cli.identification.channel_structure import ChannelStructure
from inputdesign_cli.identification.checks import (
    check_apart,
    check_length,
    check_noisy,
    check_varying,
    fit_percent,
)
from inputdesign_cli.identification.predictor import prediction_errors
from inputdesign_cli.identification.problem import PredictionErrors, inverses
from inputdesign_cli.identification.search import best_run, minimise
from inputdesign_cli.identification.starts import starting_points
from inputdesign_cli.plant import PolynomialChannels, caused_by_inputs, stable_outputs
from inputdesign_cli.plant.polynomial import Array

# Many runs share the cost of a pass over time; with more than this the blocks no longer fit the cache.
_BATCH = 256


@dataclass(frozen=True)
class ChannelBatch:
    """Estimates of many runs.

    Attributes:
        theta: (runs, k).
        noise: (runs, p, p) covariance of e, unbiased to first order.
        information: (runs, k, k) sum of psi noise^-1 psi^T; its inverse is the covariance of theta.
        converged, steps: (runs,) of the search.
    """

    theta: Array
    noise: NDArray[np.float64]
    information: NDArray[np.float64]
    converged: NDArray[np.bool_]
    steps: NDArray[np.int64]


def identify_channels(
    model: PolynomialChannels,
    u: ArrayLike,
    y: ArrayLike,
    *,
    start: ArrayLike | None = None,
    noise: ArrayLike | None = None,
    feedback: bool = False,
) -> ChannelEstimate:
    """Prediction-error estimate from one record u (samples, r), y (samples, p).

    Each output is first estimated alone, from several starts (`start` among them if given). What outputs
    share is then weighed by how well each knows it, and the search for all of them begins there and at
    `start`. Without C, D and F (ARX) this is least squares, generalised by the covariance of e.

    Args:
        model: its orders and delays, zero entries and common polynomials are those of the estimate; its
            numbers mean nothing.
        start: (k,).
        noise: the covariance of e (p, p) if it is known; it is then not estimated.
        feedback: whether u(t) answers y(t), which a test of the residuals heeds.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output`, `noise-free-data` or
            `not-exciting`.
    """
    structure = ChannelStructure.of(model)
    inputs, outputs = np.asarray(u, dtype=float), np.asarray(y, dtype=float)
    check_length(len(outputs), structure.size, structure.memory, outputs=len(structure.rows))
    check_varying(structure.names, inputs, outputs)
    known = None if noise is None else np.asarray(noise, dtype=float)
    record = structure.problem(inputs[None], outputs[None], known)
    given = None if start is None else np.asarray(start, dtype=float)
    alone, tried = _one_by_one(structure, record, given)
    points = np.array([alone] if given is None else [given, alone])
    found = minimise(record.repeated(len(points)), points)
    best = best_run(found)
    theta = found.theta[best]
    errors = np.stack(
        [
            prediction_errors(row, theta[None, place], record.u, y_i)[:, 0]
            for row, place, y_i in zip(structure.rows, structure.places, record.y, strict=True)
        ],
        axis=1,
    )
    covariance = _covariances(structure, (errors.T @ errors)[None], len(errors))[0]
    check_noisy(np.diag(covariance), outputs)
    check_apart(covariance)
    if known is not None:
        covariance = known
    information, _ = record.gathered(record.sums(theta[None]), np.linalg.inv(covariance)[None])
    return concluded(
        structure.names,
        theta,
        information[0],
        covariance,
        errors,
        inputs,
        feedback=feedback,
        in_noise=structure.in_noise,
        in_plant=structure.in_plant,
        fit=_fits(model.at(theta), inputs, outputs),
        converged=bool(found.converged[best]),
        steps=int(found.steps[best]),
        starts=tried,
    )


def fit_channel_batch(
    model: PolynomialChannels, u: ArrayLike, y: ArrayLike, *, start: ArrayLike
) -> ChannelBatch:
    """Prediction-error estimates of many records in one pass.

    Args:
        model: of which the structure is meant, see `identify_channels`.
        u, y: (runs, samples, r), (runs, samples, p).
        start: (k,) for all runs, or (runs, k).
    """
    structure = ChannelStructure.of(model)
    inputs, outputs = np.asarray(u, dtype=float), np.asarray(y, dtype=float)
    begin = np.broadcast_to(np.asarray(start, dtype=float), (len(outputs), structure.size))
    parts = []
    for first in range(0, len(outputs), _BATCH):
        some = slice(first, first + _BATCH)
        record = structure.problem(inputs[some], outputs[some])
        found = minimise(record, begin[some])
        sums = record.sums(found.theta)
        noise = _covariances(structure, sums.errors, outputs.shape[1])
        information, _ = record.gathered(sums, inverses(noise)[0])
        parts.append((found.theta, noise, information, found.converged, found.steps))
    theta, noise, information, converged, steps = (
        np.concatenate([part[index] for part in parts]) for index in range(5)
    )
    return ChannelBatch(theta, noise, information, converged, steps)


def _one_by_one(
    structure: ChannelStructure, record: PredictionErrors, start: Array | None
) -> tuple[Array, int]:
    """theta (k,) from each output alone, and from how many starts: the information of all, added up."""
    inputs = [x[:, 0] for x in record.u]
    total, moment = np.zeros((structure.size, structure.size)), np.zeros(structure.size)
    tried = 0
    for row, place, y in zip(structure.rows, structure.places, record.y, strict=True):
        if not place.size:
            continue
        points = starting_points(row, inputs, y[:, 0])
        if start is not None:
            points = np.concatenate([start[None, place], points])
        single = PredictionErrors.single(row, record.u, y)
        found = minimise(single.repeated(len(points)), points)
        best = best_run(found)
        information = found.hessian[best] / max(found.cost[best], 1e-300)
        total[np.ix_(place, place)] += information
        moment[place] += information @ found.theta[best]
        tried = max(tried, len(points))
    scale = np.sqrt(np.maximum(np.diag(total), 1e-300))
    scaled = np.linalg.lstsq(total / np.outer(scale, scale), moment / scale, rcond=None)[0]
    return scaled / scale, tried


def _covariances(
    structure: ChannelStructure, squares: NDArray[np.float64], samples: int
) -> NDArray[np.float64]:
    """The covariance of e (runs, p, p) from sums of epsilon epsilon^T; every output's parameters count."""
    left = np.sqrt(np.maximum(samples - structure.own(), 1.0))
    return squares / np.outer(left, left)


def _fits(model: PolynomialChannels, u: Array, y: Array) -> tuple[float | None, ...]:
    """Per cent of the rms of each output that the simulation explains; None where it is unstable."""
    simulated = caused_by_inputs(model, u)
    return tuple(
        fit_percent(y[:, i], simulated[:, i]) if stable else None
        for i, stable in enumerate(stable_outputs(model))
    )
