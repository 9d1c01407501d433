"""Transfer matrices in s from sampled records: one estimate, or many."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.identification.checks import (
    check_apart,
    check_length,
    check_noisy,
    check_varying,
    fit_percent,
)
from inputdesign_cli.identification.estimate import BatchEstimate, Estimate, concluded
from inputdesign_cli.identification.gauss_newton import best_run, minimise
from inputdesign_cli.identification.problem import inverses
from inputdesign_cli.identification.refined_iv import refine
from inputdesign_cli.identification.transfer_problem import Point, TransferProblem, evaluate, rounding
from inputdesign_cli.identification.transfer_record import TransferRecord
from inputdesign_cli.identification.transfer_starts import starting_points
from inputdesign_cli.plant import ContinuousModel, Intersample
from inputdesign_cli.plant.polynomial import Array

# Of the starts made from the data, as many are followed to the end: the likeliest after the instruments.
_FOLLOWED = 3


def identify_transfer_matrix(
    model: ContinuousModel,
    u: ArrayLike,
    y: ArrayLike,
    between: Intersample,
    *,
    start: ArrayLike | None = None,
    feedback: bool = False,
) -> Estimate:
    """Maximum-likelihood estimate of a transfer matrix in s from one record, white noise on the outputs.

    The noise of the samples has an unknown full covariance. From each start refined instrumental variables
    iterate first, then Gauss and Newton with damping on the same equations; poles are kept in the left
    half plane. `refined_iv.py` tells why both have the same solutions.

    Args:
        model: the structure, and with it the names and the order of theta; its numbers are not used.
        u, y: (N, r), (N, p).
        between: the time between samples, and whether u is held there.
        start: (k,), tried besides starts made from the data.
        feedback: whether u(t) answers y(t), which a test of the residuals heeds.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output`, `noise-free-data` or
            `not-exciting`.
    """
    inputs, outputs = np.asarray(u, dtype=float), np.asarray(y, dtype=float)
    check_length(len(outputs), len(model.names), 0, outputs=model.outputs)
    check_varying(model.names, inputs, outputs)
    record = TransferRecord(model, inputs, outputs, between)
    made = [refine(record, evaluate(record, theta)) for theta in starting_points(record)]
    refined = sorted(made, key=lambda end: end[0].cost)[:_FOLLOWED]
    if start is not None:
        given = record.stabilised(np.asarray(start, dtype=float))
        refined.append(refine(record, evaluate(record, given)))
    found = minimise(
        TransferProblem((record,) * len(refined)), np.array([point.theta for point, _ in refined])
    )
    best = best_run(found)
    point = evaluate(record, found.theta[best])
    noise, information = _noise_and_information(record, point)
    check_noisy(np.diag(noise), outputs)
    check_apart(noise)
    return concluded(
        model.names,
        point.theta,
        information,
        noise,
        point.errors,
        inputs,
        feedback=feedback,
        in_noise=0,
        in_plant=len(model.names),
        fit=tuple(fit_percent(y_i, y_i - e_i) for y_i, e_i in zip(outputs.T, point.errors.T, strict=True)),
        converged=bool(found.converged[best]),
        steps=refined[best][1] + int(found.steps[best]),
        starts=len(made) + (start is not None),
    )


def fit_transfer_matrices(
    model: ContinuousModel, u: ArrayLike, y: ArrayLike, between: Intersample, *, start: ArrayLike
) -> BatchEstimate:
    """The estimates of `identify_transfer_matrix` for many records, each from its one start, without checks.

    Args:
        model, between: see `identify_transfer_matrix`.
        u: (N, r) common to all runs, or (runs, N, r).
        y: (runs, N, p).
        start: (k,) for all runs, or (runs, k).
    """
    outputs = np.asarray(y, dtype=float)
    inputs = np.broadcast_to(np.asarray(u, dtype=float), (*outputs.shape[:2], model.inputs))
    begin = np.broadcast_to(np.asarray(start, dtype=float), (len(outputs), len(model.names)))
    records = tuple(TransferRecord(model, inputs[run], outputs[run], between) for run in range(len(outputs)))
    theta, refined = [], []
    for record, row in zip(records, begin, strict=True):
        point, steps = refine(record, evaluate(record, record.stabilised(row)))
        theta.append(point.theta)
        refined.append(steps)
    found = minimise(TransferProblem(records), np.array(theta))
    described = [
        _noise_and_information(record, evaluate(record, theta))
        for record, theta in zip(records, found.theta, strict=True)
    ]
    return BatchEstimate(
        theta=found.theta,
        noise=np.array([noise for noise, _ in described]),
        information=np.array([information for _, information in described]),
        converged=found.converged,
        steps=found.steps + np.array(refined),
    )


def _noise_and_information(record: TransferRecord, point: Point) -> tuple[Array, Array]:
    """(p, p) covariance of the noise, and (k, k) sum over the samples of psi noise^-1 psi^T.

    Every output's parameters count; those that several share count by their share.
    """
    taken = np.zeros(record.structure.outputs)
    for parameter in record.structure.parameters:
        rows = sorted({i for i, _ in parameter.places})
        taken[rows] += 1.0 / len(rows)
    freedom = np.sqrt(record.samples - taken)
    noise = point.errors.T @ point.errors / np.outer(freedom, freedom)
    return noise, replace(point, weights=inverses((noise + rounding(record))[None])[0][0]).hessian
