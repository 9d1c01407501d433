"""Monte Carlo study of a regression experiment: least squares on the modelled regressors, many times."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.regression import Regression
from inputdesign_cli.monte_carlo.batches import Seed, run_batches
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Results
from inputdesign_cli.signal import delayed_regressors
from inputdesign_cli.specification import Spec, TrueParameters
from inputdesign_cli.tasks.build.regression_task import refuse_coloured
from inputdesign_cli.tasks.regression import RegressionRun, run_regression

_BATCH_SAMPLES = 2_000_000  # noise samples drawn at once


@dataclass(frozen=True)
class Estimates:
    """What the runs gave: estimates (runs, m) and errors (runs,) of the quantity of interest."""

    theta: NDArray[np.float64]
    error: Array


def simulate_regression(spec: Spec, *, executor: Executor | None = None) -> Results:
    """Design, then simulate y = Phi theta + v and estimate theta_1 by least squares in every run.

    Raises:
        SpecError: there is no simulation, or the record is too short, or an input to compare with is
            not available for regressions.
    """
    simulation = spec.simulation
    if simulation is None or not isinstance(simulation.plant, TrueParameters):
        raise spec.complain(
            "missing-key",
            "a regression is simulated with its true parameters, and there are none",
            hint="write simulation: {runs: 10000, plant: {parameters: [..]}}, the estimated ones first",
            key="simulation",
        )
    for name in simulation.compare:
        if name not in ("white", "binary"):
            raise spec.complain(
                "not-supported",
                f"{name} inputs are not available for regressions",
                hint="compare with white or binary",
                key="simulation.compare",
            )
    run = run_regression(spec)
    if run.record is None:
        raise spec.complain(
            "wrong-shape",
            f"{spec.signal_samples} samples are too few to realise these moments",
            hint="set experiment.samples",
            key="experiment.samples",
        )
    theta = np.array(simulation.plant.parameters, dtype=float)
    regression = _true_noise(spec, run.task.regression, run.record.Phi @ theta)
    root = np.random.SeedSequence(simulation.seed)
    seeds = root.spawn(1 + 2 * len(simulation.compare))
    records: dict[str, tuple[Array, np.random.SeedSequence]] = {"design": (run.record.Phi, seeds[0])}
    for i, other in enumerate(simulation.compare):
        records[other] = (_other(other, run, np.random.default_rng(seeds[2 * i + 1])), seeds[2 * i + 2])
    inputs = {}
    for label, (Phi, seed) in records.items():
        found = run_experiments(regression, Phi, theta, runs=simulation.runs, seed=seed, executor=executor)
        inputs[label] = _describe(regression, Phi, theta, found)
    study = {"runs": simulation.runs, "seed": simulation.seed, "inputs": inputs}
    return replace(run.outcome, result={**run.outcome.result, "simulation": study})


@dataclass(frozen=True)
class _Record:
    """y = quiet + sigma e (N,), and the matrix (m, N) that takes it to the least-squares estimate."""

    quiet: Array
    sigma: float
    smoother: Array


def run_experiments(
    regression: Regression,
    Phi: Array,
    theta: Array,
    *,
    runs: int,
    seed: Seed,
    executor: Executor | None = None,
) -> Estimates:
    """Least-squares estimates of theta_1 from `runs` records of the regressors Phi (N, n)."""
    samples, m = Phi.shape[0], regression.m
    record = _Record(
        Phi @ theta, float(np.sqrt(regression.variance)), np.asarray(np.linalg.pinv(Phi[:, :m]), float)
    )
    size = max(1, _BATCH_SAMPLES // samples)
    parts = run_batches(_estimates, record, runs=runs, size=size, seed=seed, executor=executor)
    estimates = np.concatenate(parts)
    truth = regression.estimated @ theta[:m] + regression.neglected @ theta[m:]
    return Estimates(estimates, estimates @ regression.estimated - truth)


def _estimates(record: _Record, runs: int, rng: np.random.Generator) -> NDArray[np.float64]:
    y = record.quiet + record.sigma * rng.standard_normal((runs, record.quiet.size))
    return np.asarray(y @ record.smoother.T)


def _describe(regression: Regression, Phi: Array, theta: Array, found: Estimates) -> dict[str, Any]:
    """Means with their standard errors, beside what theory says for these very samples."""
    squared = found.error**2
    runs = squared.size
    G, m = Phi.T @ Phi, regression.m
    inverse = np.linalg.pinv(G[:m, :m], rcond=1e-12, hermitian=True)
    mean = inverse @ G[:m] @ theta
    bias = regression.estimated @ mean - regression.estimated @ theta[:m] - regression.neglected @ theta[m:]
    entry: dict[str, Any] = {
        "mse": float(squared.mean()),
        "mean_estimate": found.theta.mean(axis=0).tolist(),
        "theory": {
            "mse": float(
                bias**2 + regression.variance * (regression.estimated @ inverse @ regression.estimated)
            ),
            "mean_estimate": mean.tolist(),
        },
        "energy": float(np.trace(G)),
    }
    if runs > 1:
        entry["mse_standard_error"] = float(squared.std(ddof=1) / np.sqrt(runs))
        entry["mean_estimate_standard_error"] = (found.theta.std(axis=0, ddof=1) / np.sqrt(runs)).tolist()
    return entry


def _true_noise(spec: Spec, regression: Regression, quiet: Array) -> Regression:
    """The regression with the noise of the true system; `quiet` is the output of the design without noise."""
    noise = spec.simulation.noise if spec.simulation is not None else None
    if noise is None:
        return regression
    refuse_coloured(spec, noise, "simulation.noise")
    if noise.relative_std is not None:
        return replace(regression, variance=float(noise.relative_std**2 * np.mean(quiet**2)))
    return replace(regression, variance=float(np.asarray(noise.variance, dtype=float).ravel()[0]))


def _other(name: str, run: RegressionRun, rng: np.random.Generator) -> Array:
    """White Gaussian or binary regressors (delayed copies of one input if the design is) of equal energy."""
    assert run.record is not None
    shape = run.record.channels.shape
    u = rng.standard_normal(shape) if name == "white" else rng.choice([-1.0, 1.0], size=shape)
    Phi = delayed_regressors(u[:, 0], run.task.regression.n, "steady") if run.task.toeplitz else u
    return Phi * np.sqrt(run.record.entry["energy"] / np.sum(Phi**2))
