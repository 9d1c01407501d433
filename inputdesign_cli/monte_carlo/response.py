"""Monte Carlo study of a nonparametric frequency response: the scatter of the estimates at each line."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.identification.periodic_response import Periods, response_at
from inputdesign_cli.monte_carlo.batches import Seed, run_batches
from inputdesign_cli.plant import Model

_BATCH_SAMPLES = 1_000_000


@dataclass(frozen=True)
class ResponseStudy:
    """Holds means and standard deviations (L, p, r) of estimates of G over `runs` experiments."""

    mean: ComplexArray
    deviation: NDArray[np.float64]
    runs: int


def study_response(
    model: Model,
    u: Array,
    periods: Periods,
    harmonics: NDArray[np.int_],
    *,
    runs: int,
    seed: Seed,
    executor: Executor | None = None,
) -> ResponseStudy:
    """Estimate G from `runs` experiments with the input u (N, r), each from rest with noise of its own.

    Args:
        executor: where batches of the runs are computed (default: in this process).
    """
    answer = model.simulate(u[None], np.zeros((1, 1, model.outputs)), 1.0)[0][0]
    size = max(1, _BATCH_SAMPLES // len(u))
    summed = partial(_sums, model, u, periods, harmonics)
    parts = run_batches(summed, runs=runs, size=size, seed=seed, executor=executor)
    U, Y = (periods.means(signal, harmonics) for signal in (u, answer))
    quiet, total = response_at(U, Y), sum(part[0] for part in parts)
    squares = sum(part[1] for part in parts) - np.abs(total) ** 2 / runs
    return ResponseStudy(quiet + total / runs, np.sqrt(squares / max(runs - 1, 1)), runs)


def _sums(
    model: Model, u: Array, periods: Periods, harmonics: NDArray[np.int_], runs: int, rng: np.random.Generator
) -> tuple[ComplexArray, NDArray[np.float64]]:
    """Return sums (L, p, r) over the runs of the errors by noise, and of their squared moduli."""
    e = rng.standard_normal((runs, len(u), model.outputs)) @ np.linalg.cholesky(model.covariance).T
    noise = model.simulate(np.zeros((1, 1, model.inputs)), e, 1.0)[1]
    U, V = (periods.means(signal, harmonics) for signal in (u, noise))
    errors = response_at(U, V)
    return np.sum(errors, axis=0), np.sum(np.abs(errors) ** 2, axis=0)
