"""How well a model explains records: by simulation from the inputs, and one step ahead.

fit = 100 (1 - |y - y_hat| / |y - mean y|), the level and the state at the start of every record estimated
along: of a simulation so that it is best, as those of an output-error model. Samples on which inputs from
before a record still act through a delay are not counted: unknown inputs explain them, whatever the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch
from itertools import zip_longest

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import SpecError
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.records import Records
from inputdesign_cli.plant import Coloured, Model, PolynomialModel, Reparametrised, SampledModel

Parts = Sequence[tuple[Array, Array]]
NOT_COMPUTED = (SpecError, ArithmeticError, RuntimeWarning, np.linalg.LinAlgError)
"""What ends the estimate of one structure, not that of others: warnings of arithmetic may be errors."""

_BY_CHANCE = 0.05
_DEPENDENT = 1e-9
# A mode that loses less than this over the whole record cannot be told from one on the stability limit.
_LEAST_DECAY = 0.01


@dataclass(frozen=True)
class Fits:
    """Per cent, output by output; -inf where the model is unstable and has no simulation.

    Attributes:
        simulated, errors: the simulations (N, p) of all records, and their prediction errors.
        counted: (N,), the samples that are counted.
    """

    simulation: tuple[float, ...]
    prediction: tuple[float, ...]
    simulated: Array
    errors: Array
    counted: NDArray[np.bool_]


def fits(model: Model, parts: Parts, late: int | None = None, before: Parts = ()) -> Fits:
    """The fits of a sampled model to records u (n, r), y (n, p).

    Args:
        late: of each record so many samples are left out. What delays of the model hold back beyond that
            counts as not explained, so that models can be compared. None: what its own delays hold back.
        before: of each record what was recorded right before it, and is left out first; empty: nothing.

    Raises:
        TypeError: see `output_error_form`.
    """
    begun = [_begun_before(model, part, past, late) for part, past in zip_longest(parts, before)]
    simulation, simulated, counted, varying, unexplained = _simulated(model, begun, late)
    own = np.concatenate([np.arange(len(y)) >= earlier for _, y, earlier in begun])
    kind = estimator(model, 1.0).kind
    with np.errstate(over="ignore", invalid="ignore"):  # of unstable models
        records = [Records((kind.record(u - u.mean(axis=0), y - y.mean(axis=0)),)) for u, y, _ in begun]
        free = [record.begun_freely(record.lateness(model.theta)) for record in records]
        errors = np.concatenate([record.at(model.theta).errors for record in free])
        errors[unexplained] = varying[unexplained[counted]]
    return Fits(simulation, percent(errors[counted], varying), simulated[own], errors[own], counted[own])


def _begun_before(
    model: Model, part: tuple[Array, Array], past: tuple[Array, Array] | None, late: int | None
) -> tuple[Array, Array, int]:
    """A record, begun by so many samples earlier as are left out of it, if it can be; how many these are."""
    if past is None:
        return *part, 0
    needed = _lateness(model, *part) if late is None else late
    earlier = min(needed, len(past[1]))
    u, y = (np.concatenate([x[len(x) - earlier :], own]) for x, own in zip(past, part, strict=True))
    return u, y, earlier


def beside(found: Sequence[Fits]) -> Fits:
    """The fits of models of one output each, to the same records, as those of all outputs."""
    return Fits(
        tuple(fit for one in found for fit in one.simulation),
        tuple(fit for one in found for fit in one.prediction),
        np.concatenate([one.simulated for one in found], axis=1),
        np.concatenate([one.errors for one in found], axis=1),
        np.all([one.counted for one in found], axis=0),
    )


def simulation_fit(
    model: Model, parts: Parts, late: int | None = None, before: Parts = ()
) -> tuple[float, ...]:
    """The first of them alone."""
    begun = [_begun_before(model, part, past, late) for part, past in zip_longest(parts, before)]
    return _simulated(model, begun, late)[0]


def _simulated(
    model: Model, begun: Sequence[tuple[Array, Array, int]], late: int | None
) -> tuple[tuple[float, ...], Array, NDArray[np.bool_], Array, NDArray[np.bool_]]:
    """The fits, the simulations (N, p), samples (N,) that count, what varies there, and what delays miss."""
    simulated, left, counted, varying, unexplained = [], [], [], [], []
    for u, y, _ in begun:
        own, delay = simulate_free(model, u - u.mean(axis=0), y)
        samples = np.arange(len(y))
        kept = samples >= (delay if late is None else late)
        missing = kept & (samples < delay)
        own[missing] = y[kept].mean(axis=0) if np.any(kept) else 0.0
        simulated.append(own)
        counted.append(kept)
        unexplained.append(missing)
        left.append((y - own)[kept])
        varying.append(y[kept] - y[kept].mean(axis=0) if np.any(kept) else y[kept])
    spread = np.concatenate(varying)
    fit = percent(np.concatenate(left), spread)
    return fit, np.concatenate(simulated), np.concatenate(counted), spread, np.concatenate(unexplained)


def by_chance(samples: int, unknowns: int, tried: int) -> float:
    """Per cent that the best of `tried` simulations explains of white noise, with 5 % of probability at most.

    Levels, starts and an agreement by chance take a chi-squared share of its power; the probabilities of
    the structures that were tried add up at most (Bonferroni). Of no samples it explains all.
    """
    if samples == 0:
        return 100.0
    share = scipy.special.chdtri(unknowns, _BY_CHANCE / tried) / samples
    return float(100.0 * (1.0 - np.sqrt(max(1.0 - share, 0.0))))


def percent(errors: Array, varying: Array) -> tuple[float, ...]:
    """Of the rms of what varies (N, p) the share that errors (N, p) do not leave; -inf of no samples."""
    if not len(errors):
        return (-np.inf,) * errors.shape[1]
    with np.errstate(over="ignore"):
        left = np.linalg.norm(errors, axis=0) / np.maximum(np.linalg.norm(varying, axis=0), 1e-300)
    return tuple(float(100.0 * (1.0 - x)) if np.isfinite(x) else -np.inf for x in left)


def simulate_free(model: Model, u: Array, y: Array) -> tuple[Array, int]:
    """(n, p): the simulation from u (n, r), its level and start such that it is nearest to y (n, p).

    With it the number of samples on which inputs from before act through a delay: these are made up.
    """
    error_form = output_error_form(model)
    record = estimator(error_form, 1.0).kind.record(u, y)
    late = record.lateness(error_form.theta)
    with np.errstate(over="ignore", invalid="ignore"):
        caused, _ = error_form.simulate(u, np.zeros(y.shape), 1.0)
        starts = record.remembering(late).starts(error_form.theta, free=True)
        for i, start in enumerate(starts):
            caused[:, i] += begun(start.free, y[:, i] - caused[:, i])
    return caused, late


def _lateness(model: Model, u: Array, y: Array) -> int:
    """The number of samples on which inputs from before a record act through a delay."""
    error_form = output_error_form(model)
    return estimator(error_form, 1.0).kind.record(u, y).lateness(error_form.theta)


def begun(responses: NDArray[np.float64], left: Array) -> Array:
    """The combination of responses (m, n) that is nearest to what is left (n,); infinite where they are."""
    if not (np.all(np.isfinite(responses)) and np.all(np.isfinite(left))):
        return np.full(left.shape, np.inf)
    columns = responses.T / np.maximum(np.linalg.norm(responses, axis=1), 1e-300)
    return np.asarray(columns @ np.linalg.lstsq(columns, left, rcond=_DEPENDENT)[0])


def is_steady(model: Model, samples: int) -> bool:
    """Whether a plant is stable, and its slowest mode tells so in a record of so many samples."""
    return output_error_form(model).radius < 1.0 - _LEAST_DECAY / samples


@singledispatch
def output_error_form(model: Model) -> Model:
    """The plant of a model, its A multiplied into every F, with white noise on the output.

    Raises:
        TypeError: models of this kind have none here: those that are not sampled, and state space.
    """
    raise TypeError(f"{type(model).__name__} has no output-error form")


@output_error_form.register
def _(model: PolynomialModel) -> Model:
    rows = [
        tuple(np.convolve(a, f) for f in fs) for a, fs in zip(model.per_output(model.A), model.F, strict=True)
    ]
    one = (np.ones(1),)
    return PolynomialModel(model.B, one, tuple(rows), one, one, model.covariance)


@output_error_form.register
def _(model: SampledModel) -> Model:
    return model


@output_error_form.register
def _(model: Coloured) -> Model:
    return output_error_form(model.plant)


@output_error_form.register
def _(model: Reparametrised) -> Model:
    return output_error_form(model.coefficients)
