"""Monte Carlo study of a regression experiment: least squares on the modelled regressors, many times."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.regression.model import Regression
from inputdesign_cli.monte_carlo.batches import Seed, run_batches
from inputdesign_cli.signal.moments import delayed_regressors

_BATCH_SAMPLES = 2_000_000  # noise samples drawn at once

Contender = Literal["white", "binary"]


@dataclass(frozen=True)
class Estimates:
    """Holds the estimates (runs, m) and the errors (runs,) of the quantity of interest."""

    theta: NDArray[np.float64]
    error: Array


def run_experiments(
    regression: Regression,
    Phi: Array,
    theta: Array,
    *,
    runs: int,
    seed: Seed,
    executor: Executor | None = None,
) -> Estimates:
    """Estimate theta_1 by least squares from `runs` records of the regressors Phi (N, n)."""
    samples, m = Phi.shape[0], regression.m
    smoother = np.asarray(np.linalg.pinv(Phi[:, :m]), dtype=float)
    estimated = partial(_estimates, Phi @ theta, float(np.sqrt(regression.variance)), smoother)
    size = max(1, _BATCH_SAMPLES // samples)
    parts = run_batches(estimated, runs=runs, size=size, seed=seed, executor=executor)
    estimates = np.concatenate(parts)
    truth = regression.estimated @ theta[:m] + regression.neglected @ theta[m:]
    return Estimates(estimates, estimates @ regression.estimated - truth)


def contending_regressors(
    kind: Contender, shape: tuple[int, ...], *, delayed: int | None, energy: float, rng: np.random.Generator
) -> Array:
    """Return white Gaussian or binary regressors Phi (N, n) of this energy, trace Phi^T Phi.

    Args:
        shape: (N, channels) of the signals to apply.
        delayed: n, if the regressors are delayed copies of one channel.
    """
    u = rng.standard_normal(shape) if kind == "white" else rng.choice([-1.0, 1.0], size=shape)
    Phi = u if delayed is None else delayed_regressors(u[:, 0], delayed, "steady")
    return np.asarray(Phi * np.sqrt(energy / np.sum(Phi**2)))


def _estimates(
    quiet: Array, sigma: float, smoother: Array, runs: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return estimates (runs, m) from y = quiet + sigma e (N,) by their matrix, `smoother` (m, N)."""
    y = quiet + sigma * rng.standard_normal((runs, quiet.size))
    return np.asarray(y @ smoother.T)
