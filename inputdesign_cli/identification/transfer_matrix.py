"""Transfer matrices in s from sampled records: one estimate, or many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.identification.checks import check_length, check_varying
from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.identification.estimate import (
    BatchEstimate,
    Estimate,
    concluded,
    information_of,
    noise_of,
)
from inputdesign_cli.identification.gauss_newton import minimise
from inputdesign_cli.identification.record_problem import RecordProblem, evaluate
from inputdesign_cli.identification.records import Records, centred, longest, split
from inputdesign_cli.identification.refined_iv import refine
from inputdesign_cli.identification.search import Search, from_rest_or_free, search
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
    lengths: Sequence[int] | None = None,
    rest: bool | None = None,
    earlier: Earlier | None = None,
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
        feedback: whether u(t) answers y(t), which the tests of the residuals heed.
        lengths: of the records that follow each other in u and y; None for one.
        rest: whether each begins at rest about zero; None: as the data say.
        earlier: an estimate from other data, which counts along.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output`, `noise-free-data` or
            `not-exciting`.
    """
    inputs, outputs = np.asarray(u, dtype=float), np.asarray(y, dtype=float)
    check_length(len(outputs), len(model.names), 0, outputs=model.outputs)
    check_varying(model.names, inputs, outputs)
    parts = split(inputs, outputs, lengths)
    before = None if earlier is None else earlier.theta

    def records_of(signals: Sequence[tuple[Array, Array]]) -> tuple[TransferRecord, ...]:
        return tuple(TransferRecord(model, *part, between) for part in signals)

    def searched(records: Records, known: Array | None) -> Search:
        # Instruments from rest, on deviations from the means, begin near enough to what unknown starts allow.
        chosen = longest(parts)
        singles = records_of(centred(chosen) if records.free else chosen)
        about = Records(singles)
        made = [
            refine(about, evaluate(about, theta)) for single in singles for theta in starting_points(single)
        ]
        refined = sorted(made, key=lambda end: end[0].cost)[:_FOLLOWED]
        for given in (start, known, before):
            if given is not None:
                refined.append(refine(about, evaluate(about, about.stabilised(np.array(given)))))
        return search(
            records,
            np.array([point.theta for point, _ in refined]),
            starts=len(made) + (start is not None) + (before is not None),
            before=np.array([steps for _, steps in refined]),
        )

    together = Records(records_of(parts), earlier=earlier)
    deviations = replace(together, parts=records_of(centred(parts)))
    best = from_rest_or_free(together, deviations, rest, searched)
    return concluded(
        model.names,
        best,
        outputs,
        outputs - best.point.errors,
        (True,) * model.outputs,
        own=_own(model),
        in_noise=0,
        in_plant=len(model.names),
        recent=0,
        feedback=feedback,
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
    records = tuple(
        Records((TransferRecord(model, *run, between),)) for run in zip(inputs, outputs, strict=True)
    )
    theta, refined = [], []
    for record, row in zip(records, begin, strict=True):
        point, steps = refine(record, evaluate(record, record.stabilised(row)))
        theta.append(point.theta)
        refined.append(steps)
    found = minimise(RecordProblem(records), np.array(theta))
    points = [evaluate(record, theta) for record, theta in zip(records, found.theta, strict=True)]
    noise = np.array([noise_of(point, _own(model)) for point in points])
    return BatchEstimate(
        theta=found.theta,
        noise=noise,
        information=np.array([information_of(*each) for each in zip(records, points, noise, strict=True)]),
        converged=found.converged,
        steps=found.steps + np.array(refined),
    )


def _own(model: ContinuousModel) -> Array:
    """(p,): how many parameters each output has; those that several share count by their share."""
    taken = np.zeros(model.outputs)
    for parameter in model.parameters:
        rows = sorted({i for i, _ in parameter.places})
        taken[rows] += 1.0 / len(rows)
    return taken
