"""Compute how well a model explains records: by simulation from the inputs, and one step ahead.

fit = 100 (1 - |y - y_hat| / |y - mean y|). The level and the state at the start of every record are estimated
as well; for a simulation they minimise the output error. Inputs from before a record still act through a
delay on its first samples. These samples are not counted: unknown inputs explain them, whatever the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch

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
"""Errors that end the estimate of one structure, but not of others: warnings of arithmetic may be raised."""

_BY_CHANCE = 0.05
# A mode that loses less than this over the whole record is not distinguishable from an undamped one.
_LEAST_DECAY = 0.01


@dataclass(frozen=True)
class Fits:
    """The fits in per cent, output by output; -inf where the model is unstable and has no simulation.

    Attributes:
        simulated, errors: the simulations (N, p) of all records, and their prediction errors.
        counted: (N,), the samples that are counted.
    """

    simulation: tuple[float, ...]
    prediction: tuple[float, ...]
    simulated: Array
    errors: Array
    counted: NDArray[np.bool_]


def fits(model: Model, parts: Parts, late: int | None = None) -> Fits:
    """Return the fits of a sampled model to records u (n, r), y (n, p).

    Args:
        late: number of samples left out of each record. Samples that longer delays of the model hold back
            count as not explained, so that models can be compared. None: as its own delays require.

    Raises:
        TypeError: see `output_error_form`.
    """
    simulated, errors, spread, missing = (list[Array]() for _ in range(4))
    kept = list[NDArray[np.bool_]]()
    kind, form = estimator(model, 1.0), output_error_form(model)
    plant = estimator(form, 1.0)
    delay = plant.lateness(form.theta)
    for u, y in parts:
        samples, moves = np.arange(len(y)), u - u.mean(axis=0)
        counted = samples >= (delay if late is None else late)
        unexplained, level = counted & (samples < delay), y[counted].mean(axis=0) if np.any(counted) else 0.0
        part, by = ((moves, y - y.mean(axis=0)),), np.eye(y.shape[1])
        with np.errstate(over="ignore", invalid="ignore"):  # unstable models may overflow
            left = Records(plant, part, weights=by).begun_freely(delay).at(form.theta).errors
            predicted = Records(kind, part).begun_freely(kind.lateness(model.theta)).at(model.theta).errors
        missing.append(np.where(unexplained[:, None], y - level, left))
        simulated.append(y - missing[-1])
        errors.append(np.where(unexplained[:, None], y - level, predicted))
        kept.append(counted)
        spread.append(y - level)
    at, every = np.concatenate(kept), np.concatenate(errors)
    varies = np.concatenate(spread)[at]
    simulation = percent(np.concatenate(missing)[at], varies)
    return Fits(simulation, percent(every[at], varies), np.concatenate(simulated), every, at)


def by_chance(samples: int, unknowns: int, tried: int) -> float:
    """Return the per cent of white noise that the best of `tried` simulations explains in 5 % of cases.

    Levels, starts and an agreement by chance take a share of its power that follows a beta distribution. The
    probabilities of the tried structures add up at most (Bonferroni). Without further samples the fit is 100.
    """
    if samples <= unknowns:
        return 100.0
    left = scipy.special.betaincinv((samples - unknowns) / 2.0, unknowns / 2.0, _BY_CHANCE / tried)
    return float(100.0 * (1.0 - np.sqrt(left)))


def percent(errors: Array, varying: Array) -> tuple[float, ...]:
    """Return the fit in per cent: 1 minus the rms of errors (N, p) over that of `varying`; -inf if N is 0."""
    if not len(errors):
        return (-np.inf,) * errors.shape[1]
    with np.errstate(over="ignore"):
        left = np.linalg.norm(errors, axis=0) / np.maximum(np.linalg.norm(varying, axis=0), 1e-300)
    return tuple(float(100.0 * (1.0 - x)) if np.isfinite(x) else -np.inf for x in left)


def is_steady(model: Model, samples: int) -> bool:
    """Return whether a plant is stable, and its slowest mode visibly decays within the samples."""
    return output_error_form(model).radius < 1.0 - _LEAST_DECAY / samples


@singledispatch
def output_error_form(model: Model) -> Model:
    """Return the plant of a model, its A multiplied into every F, with white noise on the output.

    Raises:
        TypeError: the model is not sampled, or is a state-space model.
    """
    raise TypeError(f"{type(model).__name__} has no output-error form")


@output_error_form.register
def _(model: PolynomialModel) -> Model:
    rows = [
        tuple(np.convolve(a, f) for f in fs) for a, fs in zip(model.per_output(model.A), model.F, strict=True)
    ]
    one = (np.ones(1),)
    return PolynomialModel(model.B, one, tuple(rows), one, one, model.covariance)


output_error_form.register(SampledModel, lambda model: model)
output_error_form.register(Coloured, lambda model: output_error_form(model.plant))
output_error_form.register(Reparametrised, lambda model: output_error_form(model.coefficients))
