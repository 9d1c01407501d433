"""Which estimator belongs to which kind of model: a new kind registers its own with `estimator`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch
from typing import Protocol

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.coloured import ColouredKind
from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.identification.estimate import BatchEstimate, Estimate, information_of
from inputdesign_cli.identification.kind import Kind, fit_batches, identify_records
from inputdesign_cli.identification.polynomials import PolynomialKind, fit_polynomials
from inputdesign_cli.identification.record_problem import evaluate
from inputdesign_cli.identification.records import Records, centred, split
from inputdesign_cli.identification.reparametrised import ReparametrisedKind
from inputdesign_cli.identification.state_space import StateSpaceKind
from inputdesign_cli.identification.structure import Structure
from inputdesign_cli.identification.transfer_matrix import TransferKind, fit_transfer_matrices
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


class Estimator(Protocol):
    """Estimates the structure of one model: what its records answer, and many of them at once."""

    @property
    def kind(self) -> Kind:
        """Return the structure that is estimated."""

    def fit_batch(self, u: Array, y: Array, start: Array) -> BatchEstimate:
        """Estimate many records; see the function of this name."""


@dataclass(frozen=True)
class _Polynomials:
    kind: PolynomialKind

    def fit_batch(self, u: Array, y: Array, start: Array) -> BatchEstimate:
        return fit_polynomials(self.kind.model, u, y, start=start)


@dataclass(frozen=True)
class _TransferMatrix:
    kind: TransferKind

    def fit_batch(self, u: Array, y: Array, start: Array) -> BatchEstimate:
        return fit_transfer_matrices(self.kind.model, u, y, self.kind.between, start=start)


@dataclass(frozen=True)
class _Recorded:
    kind: Kind

    def fit_batch(self, u: Array, y: Array, start: Array) -> BatchEstimate:
        return fit_batches(self.kind, u, y, start)


@singledispatch
def estimator(model: Model, step: float) -> Estimator:
    """Return the estimator for models of this kind, from samples `step` apart.

    Models in discrete time have their own step.

    Raises:
        TypeError: none is registered.
    """
    raise TypeError(f"no estimator is registered for {type(model).__name__}")


@estimator.register
def _(model: PolynomialModel, step: float) -> Estimator:
    return _Polynomials(PolynomialKind(model, Structure.of(model)))


@estimator.register
def _(model: ContinuousModel, step: float) -> Estimator:
    return _TransferMatrix(TransferKind(model, Intersample(step, hold=False)))


@estimator.register
def _(model: SampledModel, step: float) -> Estimator:
    return _TransferMatrix(TransferKind(model.continuous_plant, Intersample(model.sample_time, hold=True)))


@estimator.register
def _(model: Reparametrised, step: float) -> Estimator:
    return _Recorded(ReparametrisedKind(model, estimator(model.coefficients, step).kind))


@estimator.register
def _(model: StateSpaceModel, step: float) -> Estimator:
    return _Recorded(StateSpaceKind(model))


@estimator.register
def _(model: Coloured, step: float) -> Estimator:
    return _Recorded(ColouredKind(model, estimator(model.plant, step).kind))


def identify(
    model: Model,
    u: Array,
    y: Array,
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
    """Estimate the structure of `model` from one record, or jointly from several.

    Args:
        model: gives the orders, zero entries, common polynomials and known parameters; its other numbers
            are not used.
        u, y: (samples, r), (samples, p).
        step: time between samples of a plant in continuous time.
        start: (k,), tried besides starts that are made from the data.
        feedback: whether u(t) depends on y(t); the tests of the residuals account for it.
        lengths: of the records that follow each other in u and y; None for one.
        rest: whether each begins at rest about zero; otherwise its start and its level are unknown and
            estimated along. None: as the data say.
        earlier: an estimate from other data, which counts along.
        experiments: the samples of each experiment, of one or several records; None: all are of one.
        near: whether `start` is an estimate of such data already, so that no others are made.
        ramp: whether outputs may drift along a line in every record, whose slope is estimated along.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output`, `noise-free-data` or
            `not-exciting`.
    """
    return identify_records(
        estimator(model, step).kind,
        np.asarray(u, dtype=float),
        np.asarray(y, dtype=float),
        start=start,
        feedback=feedback,
        lengths=lengths,
        rest=rest,
        earlier=earlier,
        experiments=experiments,
        near=near,
        ramp=ramp,
    )


def fit_batch(model: Model, u: Array, y: Array, step: float = 1.0, *, start: Array) -> BatchEstimate:
    """Estimate many records in one pass, each from a single start, without checks.

    Args:
        model, step: see `identify`.
        u, y: (runs, samples, r), (runs, samples, p).
        start: (k,) for all runs, or (runs, k).
    """
    return estimator(model, step).fit_batch(u, y, start)


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
    kind, parts = estimator(model, step).kind, split(u, y, lengths)
    made = tuple(kind.record(*part) for part in (centred(parts) if free else parts))
    records = Records(made, free=free)
    told = information_of(records, evaluate(records, model.theta), model.covariance)
    return told if earlier is None else told + earlier.information
