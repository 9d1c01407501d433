"""Which estimator belongs to which kind of model: a new kind registers its own with `estimator`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch
from typing import Protocol, TypedDict

from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.identification.estimate import BatchEstimate, Estimate
from inputdesign_cli.identification.polynomials import fit_polynomials, identify_polynomials
from inputdesign_cli.identification.transfer_matrix import fit_transfer_matrices, identify_transfer_matrix
from inputdesign_cli.plant import ContinuousModel, Intersample, Model, PolynomialModel, SampledModel
from inputdesign_cli.plant.polynomial import Array

# Of records that follow each other; None for one.
Lengths = Sequence[int] | None


class Conditions(TypedDict):
    """What is known of the records; see `identify`."""

    feedback: bool
    lengths: Lengths
    rest: bool | None
    earlier: Earlier | None


class Estimator(Protocol):
    """Estimates the structure of one model."""

    def identify(self, u: Array, y: Array, start: Array | None, how: Conditions) -> Estimate:
        """From one or several records; see the function of this name."""

    def fit_batch(self, u: Array, y: Array, start: Array) -> BatchEstimate:
        """From many records; see the function of this name."""


@dataclass(frozen=True)
class _Polynomials:
    model: PolynomialModel

    def identify(self, u: Array, y: Array, start: Array | None, how: Conditions) -> Estimate:
        return identify_polynomials(self.model, u, y, start=start, **how)

    def fit_batch(self, u: Array, y: Array, start: Array) -> BatchEstimate:
        return fit_polynomials(self.model, u, y, start=start)


@dataclass(frozen=True)
class _TransferMatrix:
    model: ContinuousModel
    between: Intersample

    def identify(self, u: Array, y: Array, start: Array | None, how: Conditions) -> Estimate:
        return identify_transfer_matrix(self.model, u, y, self.between, start=start, **how)

    def fit_batch(self, u: Array, y: Array, start: Array) -> BatchEstimate:
        return fit_transfer_matrices(self.model, u, y, self.between, start=start)


@singledispatch
def estimator(model: Model, step: float) -> Estimator:
    """What estimates models of this kind from samples `step` apart; those in discrete time know theirs.

    Raises:
        TypeError: none is registered.
    """
    raise TypeError(f"no estimator is registered for {type(model).__name__}")


@estimator.register
def _(model: PolynomialModel, step: float) -> Estimator:
    return _Polynomials(model)


@estimator.register
def _(model: ContinuousModel, step: float) -> Estimator:
    return _TransferMatrix(model, Intersample(step, hold=False))


@estimator.register
def _(model: SampledModel, step: float) -> Estimator:
    return _TransferMatrix(model.continuous_plant, Intersample(model.sample_time, hold=True))


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
) -> Estimate:
    """The structure of `model` estimated from one record, or jointly from several.

    Args:
        model: its orders and delays, zero entries and common polynomials are those of the estimate; its
            numbers are not used.
        u, y: (samples, r), (samples, p).
        step: time between samples of a plant in continuous time.
        start: (k,), tried besides starts that are made from the data.
        feedback: whether u(t) answers y(t), which the tests of the residuals heed.
        lengths: of the records that follow each other in u and y; None for one.
        rest: whether each begins at rest about zero; otherwise its start and its level are unknown and
            estimated along. None: as the data say.
        earlier: an estimate from other data, which counts along.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output`, `noise-free-data` or
            `not-exciting`.
    """
    how = Conditions(feedback=feedback, lengths=lengths, rest=rest, earlier=earlier)
    return estimator(model, step).identify(u, y, start, how)


def fit_batch(model: Model, u: Array, y: Array, step: float = 1.0, *, start: Array) -> BatchEstimate:
    """The same of many records in one pass, each from its one start, without checks.

    Args:
        model, step: see `identify`.
        u, y: (runs, samples, r), (runs, samples, p).
        start: (k,) for all runs, or (runs, k).
    """
    return estimator(model, step).fit_batch(u, y, start)
