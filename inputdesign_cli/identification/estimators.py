"""Estimate models of any kind from records: one estimate with its tests, or many at once.

A new kind of model registers what it supplies with `estimator`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.watching import Counted, tell
from inputdesign_cli.identification.checks import check_length, check_varying
from inputdesign_cli.identification.coloured import ColouredKind
from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.identification.estimate import (
    BatchEstimate,
    Estimate,
    concluded,
    information_of,
    noise_of,
)
from inputdesign_cli.identification.gauss_newton import minimise
from inputdesign_cli.identification.kind import Kind, Starts
from inputdesign_cli.identification.polynomial_rows import FromRest
from inputdesign_cli.identification.polynomials import PolynomialKind
from inputdesign_cli.identification.records import (
    RecordProblem,
    Records,
    centred,
    evaluate,
    inverses,
    longest,
    split,
)
from inputdesign_cli.identification.reparametrised import ReparametrisedKind
from inputdesign_cli.identification.search import Search, from_rest_or_free, search
from inputdesign_cli.identification.state_space import StateSpaceKind
from inputdesign_cli.identification.transfer_matrix import TransferKind
from inputdesign_cli.plant import (
    Coloured,
    ContinuousModel,
    Intersample,
    Model,
    PolynomialModel,
    Reparametrised,
    SampledModel,
    StateSpaceModel,
)

# Of records that follow each other; None for one.
Lengths = Sequence[int] | None

# Numbers that unknown starts may take up: inputs of long dead times are taken for known beyond.
_MOST = 2e7


@singledispatch
def estimator(model: Model, step: float) -> Kind:
    """Return what models of this kind supply to be estimated, from samples `step` apart.

    Models in discrete time have their own step.

    Raises:
        TypeError: none is registered.
    """
    raise TypeError(f"no estimator is registered for {type(model).__name__}")


estimator.register(PolynomialModel, lambda model, step: PolynomialKind(model))
estimator.register(StateSpaceModel, lambda model, step: StateSpaceKind(model))
estimator.register(ContinuousModel, lambda model, step: TransferKind(model, Intersample(step, hold=False)))
estimator.register(
    SampledModel,
    lambda model, step: TransferKind(model.continuous_plant, Intersample(model.sample_time, hold=True)),
)
estimator.register(
    Reparametrised, lambda model, step: ReparametrisedKind(model, estimator(model.coefficients, step))
)
estimator.register(Coloured, lambda model, step: ColouredKind(model, estimator(model.plant, step)))


def identify(
    model: Model,
    u: ArrayLike,
    y: ArrayLike,
    step: float = 1.0,
    *,
    start: Array | None = None,
    feedback: bool = False,
    lengths: Lengths = None,
    rest: bool | None = None,
    earlier: Earlier | None = None,
    experiments: Lengths = None,
    near: bool = False,
    ramp: bool = False,
) -> Estimate:
    """Return the maximum-likelihood estimate of a structure from one record, or jointly from several.

    Args:
        model: gives the orders, zero entries, common polynomials and known parameters; its other numbers
            are not used.
        u, y: (N, r), (N, p).
        step: time between samples of a plant in continuous time.
        start: (k,), tried besides starts that are made from the data.
        feedback: whether u(t) depends on y(t); the tests of the residuals account for it.
        lengths: of the records that follow each other in u and y; None for one.
        rest: whether each begins at rest about zero; otherwise its start and its level are unknown and
            estimated along. None: as the data say.
        earlier: an estimate from other data, which counts along.
        experiments: the samples of each experiment, of one or several records; None: all are of one.
        near: whether `start` is an estimate of such data already, so that no others are made.
        ramp: whether outputs may drift along a line in every record, whose slope is estimated along; no
            record then begins at rest.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output`, `noise-free-data` or
            `not-exciting`.
    """
    kind, inputs, outputs = estimator(model, step), np.asarray(u, dtype=float), np.asarray(y, dtype=float)
    check_length(len(outputs), len(kind.names), kind.recent, outputs=kind.outputs)
    check_varying(kind.names, inputs, outputs)
    parts = tuple(split(inputs, outputs, lengths))

    def searched(records: Records, known: Array | None) -> Search:
        chosen = longest(parts)
        if near and start is not None:
            begin = Starts(start[None], 1)
        else:
            begin = kind.starting_points(centred(chosen) if records.free else chosen, start)
        others = [theta[None] for theta in (known, earlier and earlier.theta) if theta is not None]
        points = np.concatenate([begin.points, *others])
        tell(Counted("starting points followed to a minimum", 0, len(points)))
        return search(records, points, starts=begin.tried + (earlier is not None))

    records = Records(kind, parts, earlier=earlier, ramp=ramp)
    best = from_rest_or_free(records, False if ramp else rest, searched, start)
    return concluded(best, outputs, experiments=experiments or (len(outputs),), feedback=feedback)


def fit_batch(
    model: Model, u: ArrayLike, y: ArrayLike, step: float = 1.0, *, start: ArrayLike
) -> BatchEstimate:
    """Estimate many records in one pass, each from a single start, without checks.

    Args:
        model, step: see `identify`.
        u: (N, r) common to all runs, or (runs, N, r).
        y: (runs, N, p).
        start: (k,) for all runs, or (runs, k).
    """
    kind, outputs = estimator(model, step), np.asarray(y, dtype=float)
    inputs = np.broadcast_to(np.asarray(u, dtype=float), (*outputs.shape[:2], model.inputs))
    begin = np.broadcast_to(np.asarray(start, dtype=float), (len(outputs), len(kind.names)))
    return _fitted(kind, inputs, outputs, np.array(begin))


@singledispatch
def _fitted(kind: Kind, u: Array, y: Array, start: Array) -> BatchEstimate:
    """Return the estimates of records (runs, N, r), (runs, N, p) from starts (runs, k)."""
    records = tuple(Records(kind, (run,)) for run in zip(u, y, strict=True))
    found = minimise(RecordProblem(records), start)
    points = [evaluate(record, theta) for record, theta in zip(records, found.theta, strict=True)]
    noise = np.array([noise_of(*each) for each in zip(records, points, strict=True)])
    information = np.array([information_of(*each) for each in zip(records, points, noise, strict=True)])
    return BatchEstimate(found.theta, noise, information, found.converged, found.steps)


@_fitted.register
def _(kind: PolynomialKind, u: Array, y: Array, start: Array) -> BatchEstimate:
    """Return the estimates from records at rest, noise as well, all in one go."""
    problem = FromRest.of(kind.model, u, y)
    found = minimise(problem, start)
    sums = problem.sums(found.theta)
    left = np.sqrt(np.maximum(y.shape[1] - sums.own, 1.0))
    noise = sums.errors / np.outer(left, left)
    information = sums.weighed(inverses(noise)[0])[0]
    return BatchEstimate(found.theta, noise, information, found.converged, found.steps)


def information_of_data(
    model: Model,
    u: Array,
    y: Array,
    step: float = 1.0,
    *,
    lengths: Lengths = None,
    free: bool = False,
    earlier: Earlier | None = None,
) -> Array:
    """Return the information matrix (k, k) of records at a model's own parameters and noise.

    The parameters need not fit best.

    Args:
        model, u, y, step, lengths, earlier: see `identify`.
        free: whether starts and levels of the records are unknown.
    """
    parts = split(u, y, lengths)
    records = Records(estimator(model, step), tuple(centred(parts) if free else parts), free=free)
    found = information_of(records, evaluate(records, model.theta), model.covariance)
    return found if earlier is None else found + earlier.information


def information_begun_anywhere(model: Model, u: Array, y: Array, step: float) -> Array:
    """Return the information matrix (k, k) of a record whose initial state and level are unknown.

    Args:
        u, y: (N, r), (N, p), signals without noise; the excitation of both is all that is counted.
        step: time between samples of a plant in continuous time.
    """
    weights = np.asarray(np.linalg.inv(model.covariance), dtype=float)
    records = Records(estimator(model, step), ((u, y),), weights=weights)
    late = records.kind.lateness(model.theta)
    free = records.begun_freely(late if late * u.shape[1] * y.shape[1] * y.size <= _MOST else 0)
    return information_of(free, evaluate(free, model.theta), model.covariance)
