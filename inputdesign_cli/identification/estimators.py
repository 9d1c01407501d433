"""Estimate models of any kind from records: one estimate with its tests, or many at once.

A new kind of model registers what it supplies with `estimator`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, singledispatch
from typing import NamedTuple, TypeVar

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import Counted, report_progress
from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.identification.checks import check_length, check_noisy, check_varying
from inputdesign_cli.identification.derived import Derived
from inputdesign_cli.identification.directed import alternative, variations
from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.identification.gauss_newton import SETTLED, minimise
from inputdesign_cli.identification.kind import Batch, Kind, Part, Starts
from inputdesign_cli.identification.polynomials import PolynomialKind
from inputdesign_cli.identification.records import (
    Point,
    RecordProblem,
    Records,
    centred,
    evaluate,
    information_of,
    longest,
    noise_of,
    split,
    weights_of,
)
from inputdesign_cli.identification.search import Rival, Search, from_rest_or_free, search
from inputdesign_cli.identification.state_space import StateSpaceKind
from inputdesign_cli.identification.tests import Tests, tests_of
from inputdesign_cli.identification.transfer_matrix import TransferKind
from inputdesign_cli.identification.white import Noise, noises_of_residuals
from inputdesign_cli.information.experiment import taking_part, triangular_factor
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

# Samples of each record, where several follow each other; None for a single record.
Lengths = Sequence[int] | None

# The size of the array of unknown starts beyond which the inputs before a record count as known.
_LARGEST = 2e7
# A direction is not excited if its gradients change by more than _UNCERTAIN, relatively, when the parameters
# change by rounding, which is _LAST_DIGITS, relatively.
_UNCERTAIN = 0.03
_LAST_DIGITS = 8.0 * float(np.finfo(float).eps)


T = TypeVar("T")


class Begun(NamedTuple):
    """The start of the records: at rest, or unknown."""

    free: bool  # whether unknown starts and levels were estimated along with theta
    rest_refuted: bool  # whether the records say that they do not begin at rest about zero
    first: Array  # (records, p), the first residuals if each record began at rest about zero


class Simulation(NamedTuple):
    """The response of the model to the inputs and the start of each record."""

    outputs: Array  # (samples, p)
    fit: tuple[float | None, ...]  # per cent of the rms of y that it explains, by output; None if unstable


class Agreement(NamedTuple):
    """The agreement of the data with an earlier estimate that is combined with them."""

    differing: float  # the probability that two estimates of one system differ as much
    alike: float  # the probability that one from other data agrees as closely


@dataclass(frozen=True)
class Estimate:
    """A prediction-error estimate of a model with p outputs, r inputs and k parameters."""

    names: tuple[str, ...]  # (k,)
    theta: Array  # (k,)
    factor: Array  # L (k, k), lower triangular, L L^T the information
    noise: Array  # (p, p) covariance of e, which without a noise model is white noise on the samples
    errors: Array  # (samples, p) prediction errors at theta
    lengths: tuple[int, ...]  # the samples of each of the records, which follow each other
    search: Search
    start: Begun
    simulation: Simulation
    prior: Agreement | None  # None without an earlier estimate
    tests: Tests

    def with_rivals(self, rivals: tuple[Rival, ...]) -> Estimate:
        """Return the estimate with other rivals."""
        return replace(self, search=replace(self.search, rivals=rivals))

    @cached_property
    def information(self) -> Array:
        """Return the information matrix (k, k) of the parameters."""
        return self.factor @ self.factor.T

    @cached_property
    def covariance(self) -> Array:
        """Return the covariance (k, k) from the factor: the information may be singular to rounding."""
        half = scipy.linalg.solve_triangular(self.factor, np.eye(len(self.factor)), lower=True)
        return np.asarray(half.T @ half)


@dataclass(frozen=True)
class BatchEstimate:
    """Holds prediction-error estimates of many records."""

    theta: Array  # (runs, k)
    noise: Array  # (runs, p, p) covariance of e, unbiased to first order
    information: Array  # (runs, k, k), whose inverse is the covariance of theta
    converged: NDArray[np.bool_]  # (runs,)
    steps: NDArray[np.int64]  # (runs,)


@singledispatch
def estimator(model: Model, step: float) -> Kind:
    """Return the structure of the estimator for models of this kind, from samples `step` apart.

    Models in discrete time have their own step. Raises TypeError if none is registered.
    """
    raise TypeError(f"no estimator is registered for {type(model).__name__}")


estimator.register(PolynomialModel, lambda model, step: PolynomialKind(model))
estimator.register(StateSpaceModel, lambda model, step: StateSpaceKind(model))
estimator.register(
    ContinuousModel, lambda model, step: TransferKind(model, model, Intersample(step, hold=False))
)
estimator.register(
    SampledModel,
    lambda model, step: TransferKind(
        model, model.continuous_plant, Intersample(model.sample_time, hold=True)
    ),
)
estimator.register(Coloured, lambda model, step: Derived(model, estimator(model.plant, step), model))
estimator.register(
    Reparametrised,
    lambda model, step: Derived(model, estimator(model.coefficients, step), by=model.parametrisation),
)


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
            serve as a starting point at most.
        u, y: (N, r), (N, p).
        step: time between samples of a plant in continuous time.
        start: (k,), tried besides starts that are made from the data.
        feedback: whether u(t) depends on y(t); the tests of the residuals account for it.
        lengths: samples of the records that follow each other in u and y; None for one.
        rest: whether each begins at rest about zero; otherwise its start and its level are unknown and
            estimated too. None: the data decide.
        earlier: an estimate from other data, which is combined with these.
        experiments: the samples of each experiment, of one or several records; None: all are of one.
        near: whether `start` is an estimate of such data already, so that no other starts are made.
        ramp: whether outputs may drift along a line in every record, whose slope is estimated too; no
            record then begins at rest.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output`, `noise-free-data` or
            `not-exciting`.
    """
    kind, inputs, outputs = estimator(model, step), np.asarray(u, dtype=float), np.asarray(y, dtype=float)
    check_length(len(outputs), len(kind.model.names), kind.recent, outputs=kind.model.outputs)
    check_varying(kind.model.names, inputs, outputs)
    parts = tuple(split(inputs, outputs, lengths))

    def searched(records: Records, known: Array | None) -> Search:
        chosen = longest(parts)
        if near and start is not None:
            begin = Starts(start[None], 1)
        else:
            begin = kind.starting_points(centred(chosen) if records.free else chosen, start)
        others = [] if earlier is None else [earlier.theta[None]]
        points = np.concatenate([begin.points, *([] if known is None else [known[None]]), *others])
        report_progress(Counted("starting points followed to a minimum", 0, len(points)))
        return search(records, points, starts=begin.tried + (earlier is not None))

    records = Records(kind, parts, earlier=earlier, ramp=ramp)

    def begun(rest: bool | None, about: Array | None) -> Estimate:
        best = from_rest_or_free(records, rest, searched, about)
        return concluded(best, parts, step, experiments=experiments or (len(outputs),), feedback=feedback)

    return _as_data_allow(begun, False if ramp else rest, start, len(parts))


def _as_data_allow(
    begun: Callable[[bool | None, Array | None], Estimate],
    rest: bool | None,
    start: Array | None,
    records: int,
) -> Estimate:
    """Return the estimate of records that begin at rest or not; if tests refute rest, free starts are tried.

    A few of many records that do not begin at rest hardly show in a test of all unknown starts.
    """
    found = begun(rest, start)
    if rest is not None or records == 1 or found.start.free or not found.tests.failed:
        return found
    free = begun(False, found.theta)
    return found if free.tests.failed else free


def with_larger_noise(
    estimate: Estimate, estimated: Callable[[list[Noise]], tuple[Estimate, T] | None]
) -> T | None:
    """Return the result with the smallest further noise that the tests accept, or None.

    Of noise models with equally many coefficients the likeliest is taken. If tests refute all of them, the
    first with white residuals is taken. None is needed if residuals are white already.

    Args:
        estimated: returns the estimate with a further noise, and the result; None if there is no estimate.
    """
    passing, better = list[tuple[int, float, T]](), None
    for noises in noises_of_residuals(estimate.errors, estimate.lengths) if estimate.tests.coloured else ():
        size = sum(C.size + D.size for C, D in noises)
        if passing and size > passing[0][0]:
            break
        if (made := estimated(noises)) is None:
            continue
        other, result = made
        if not other.search.converged or other.tests.coloured:
            continue
        better = result if better is None else better
        if not any(test.fault == "noise" for test in other.tests.failed):
            power = float(np.linalg.slogdet(other.errors.T @ other.errors)[1])
            passing.append((size, power, result))
    return min(passing, key=lambda one: one[1])[2] if passing else better


def fit_batch(
    model: Model,
    u: ArrayLike,
    y: ArrayLike,
    step: float = 1.0,
    *,
    start: ArrayLike,
    free: bool = False,
    settled_at: float = SETTLED,
) -> BatchEstimate:
    """Estimate many records in one pass, each from a single start, without checks.

    Args:
        model, step: see `identify`.
        u: (N, r) common to all runs, or (runs, N, r).
        y: (runs, N, p).
        start: (k,) for all runs, or (runs, k).
        free: whether each record begins in an unknown state about an unknown level, not at rest about zero.
        settled_at: see `gauss_newton.minimise`.
    """
    kind, outputs = estimator(model, step), np.asarray(y, dtype=float)
    inputs = np.broadcast_to(np.asarray(u, dtype=float), (*outputs.shape[:2], model.inputs))
    begin = np.broadcast_to(np.asarray(start, dtype=float), (len(outputs), len(kind.model.names)))
    problem: Batch | None = None if free else kind.batch(inputs, outputs)
    if problem is None:
        runs = zip(inputs, outputs, strict=True)
        problem = RecordProblem(tuple(Records(kind, (run,), free=free) for run in runs))
    found = minimise(problem, np.array(begin), settled_at=settled_at)
    theta = found.theta
    return BatchEstimate(theta, *problem.concluded(theta), found.converged, found.steps)


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
    """Return the information matrix (k, k) of records at a model's own parameters and noise, fitting or not.

    If `free`, starts and levels of the records are unknown; for the rest see `identify`. Only the excitation
    of u (N, r) and y (N, p) counts, which may be signals without noise.
    """
    kind, parts = estimator(model, step), split(u, y, lengths)
    weights = np.asarray(np.linalg.inv(model.covariance), dtype=float)
    records = Records(kind, tuple(centred(parts) if free else parts), weights=weights)
    if free:
        late = kind.lateness(model.theta)
        records = records.begun_freely(late if late * u.shape[1] * y.shape[1] * y.size <= _LARGEST else 0)
    found = information_of(records, evaluate(records, model.theta), model.covariance)
    return found if earlier is None else found + earlier.information


def concluded(
    found: Search, parts: Sequence[Part], step: float, *, experiments: Sequence[int], feedback: bool
) -> Estimate:
    """Return the estimate with its covariance and the tests of its residuals, from records as measured.

    Raises:
        SpecError: `noise-free-data` or `not-exciting`.
    """
    records, point, kind, theta = found.records, found.point, found.records.kind, found.point.theta
    noise = noise_of(records, point)
    check_noisy(noise, records.y)
    factor, earlier = factor_at(records, point, noise), records.earlier
    simulation = _simulation(records, point, np.concatenate([y for _, y in parts]))
    first = np.array([kind.errors_and_gradient(theta, *part)[0][0] for part in parts])
    known = None if kind.model.continuous or None in simulation.fit else simulation.outputs
    larger = [
        alternative(one, estimator(one.model, step), records)
        for one in kind.extensions(theta, feedback=feedback)
    ]
    alternatives = [*larger, *variations(records, theta, known)]
    prior = None
    if earlier is not None:
        prior = Agreement(earlier.agreement(theta, factor), earlier.likeness(theta, factor))
    return Estimate(
        kind.model.names,
        np.asarray(theta, dtype=float),
        _over_minima(found, factor, noise),
        noise,
        point.errors,
        records.lengths,
        found,
        Begun(records.free, found.rest_refuted, first),
        simulation,
        prior,
        tests_of(records, point, noise, alternatives, experiments=experiments, feedback=feedback),
    )


def _simulation(records: Records, point: Point, y: Array) -> Simulation:
    """Return the simulated outputs: the outputs less the part that prediction errors cause."""
    kind, ends = records.kind, np.cumsum(records.lengths)[:-1]
    model = kind.model.at(point.theta)
    varying = np.concatenate([own - own.mean(axis=0) for own in np.split(y, ends)])
    with np.errstate(over="ignore", invalid="ignore"):  # outputs of an unstable plant are not shown
        each = zip(records.parts, np.split(point.errors, ends), strict=True)
        noise = np.concatenate([model.simulate(0.0 * u, e, 1.0)[1] for (u, _), e in each])
        left = np.linalg.norm(y - (outputs := y - noise), axis=0) / np.linalg.norm(varying, axis=0)
    able = kind.simulates(point.theta)
    fit = (float(100.0 * (1.0 - x)) if runs else None for x, runs in zip(left, able, strict=True))
    return Simulation(outputs, tuple(fit))


def factor_at(records: Records, point: Point, noise: Array) -> Array:
    """Return the triangular factor L (k, k) of the information matrix of records, M = L L^T.

    Slow poles make the coefficients of a polynomial nearly collinear. Even after scaling, eigenvalues of M
    often differ by 1e14 without a lack of excitation. So M is never formed, and directions count as
    undetermined only if the gradients themselves are rounding.

    Raises:
        SpecError: `not-exciting`, with the parameters that the data cannot distinguish.
    """
    # The earlier estimate counts as further rows.
    known = np.zeros((0, point.theta.size)) if records.earlier is None else records.earlier.rows
    root = np.linalg.cholesky(weights_of(records, noise)).T
    last = _LAST_DIGITS * np.resize([1.0, -1.0], point.theta.size)
    rows, again = (
        np.concatenate([(psi @ root.T).reshape(len(psi), -1).T, known])
        for psi in (point.all_psi, records.at(point.theta * (1.0 + last)).all_psi)
    )
    factor, untold = triangular_factor(rows)
    if not untold.size:
        changes = scipy.linalg.solve_triangular(factor, (again - rows).T, lower=True).T
        _, changed, vectors = np.linalg.svd(changes, full_matrices=False)
        uncertain = vectors[changed > _UNCERTAIN].T
        sizes = np.linalg.norm(factor, axis=1)[:, None]
        untold = sizes * scipy.linalg.solve_triangular(factor, uncertain, lower=True, trans="T")
    if untold.size:
        names = records.kind.model.names
        ended = [f"{name} = {value:.4g}" for name, value in zip(names, point.theta, strict=True)]
        raise bad_spec(
            "not-exciting",
            f"the data cannot distinguish these parameters: {taking_part(names, untold)}",
            hint="the input is too simple (too few sinusoids, a short step), or the orders are too high; or "
            f"the search went astray ({taking_part(ended, untold)}): start elsewhere, beyond poles of "
            "expressions too",
            key="u",
        )
    return factor


def _over_minima(found: Search, factor: Array, noise: Array) -> Array:
    """Return the information's factor for a mixture if minima beyond sampling instants are about as likely.

    The weight of each is its likelihood times the square root of the determinant of its covariance (Laplace's
    method, [tierney-kadane-1986]). The covariance is that of the mixture about the estimate.
    """
    logarithms, spreads = [0.0], [np.eye(len(factor))]
    for point, excess in found.beside:
        try:
            own = factor_at(found.records, point, noise)
        except SpecError:  # the data do not determine this minimum, so that it has no covariance
            continue
        # In standard deviations of the best minimum.
        half = scipy.linalg.solve_triangular(own, factor, lower=True)
        away = factor.T @ (point.theta - found.point.theta)
        spreads.append(half.T @ half + np.outer(away, away))
        smaller = np.sum(np.log(np.abs(np.diag(factor) / np.diag(own))))
        logarithms.append(float(smaller - 0.5 * excess))
    if len(logarithms) == 1:
        return factor
    weights = np.exp(np.array(logarithms) - max(logarithms))
    mixture = np.tensordot(weights, spreads, 1) / np.sum(weights)
    rows = scipy.linalg.solve_triangular(np.linalg.cholesky(mixture), factor.T, lower=True)
    return triangular_factor(rows)[0]
