"""Monte Carlo study of a controller designed on an identified model: losses of the loop for each input.

Each run identifies an ARX model by least squares, designs the model-reference (or internal-model)
controller on it, and compares the true loop with the one that the true plant would have given. The difference
is exact, see `error_filters`; v is the noise at the output.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.loop_error.closed_form import adjoint
from inputdesign_cli.design.loop_error.desired_loop import DesiredLoop
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.identification.least_squares import estimated_polynomials, least_squares
from inputdesign_cli.monte_carlo.batches import Seed, run_batches
from inputdesign_cli.monte_carlo.error_filters import error_filters, prefilter
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.periodic import dense_roots, noise_drive, shaped_noise

# Batches stay in the cache of the processor.
_BATCH_SAMPLES = 200_000
# The rule on the circle is wrong by exp(-_DECAY).
_DECAY = 40.0
_LONGEST_GRID = 2**16


@dataclass(frozen=True)
class LossStudy:
    """Losses of the closed loop over all runs with one input.

    Attributes:
        loss: (runs,) square root of the sum over the simulated samples of |y - y0|^2.
        exact: (runs,) the same from the H2 norm of each run's loop, the reference averaged out.
        estimates: (runs, k).
        unstable: how many estimates gave an unstable loop; their losses are left out.
        power: (inputs,) mean squares of the inputs applied.
    """

    loss: Array
    exact: Array
    estimates: Array
    unstable: int
    power: Array


@dataclass(frozen=True)
class _Trial:
    """What all batches share; `roots` belong to the spectrum of each input, see `dense_roots`."""

    problem: LoopErrorProblem
    desired: DesiredLoop
    roots: dict[str, ComplexArray]
    samples: int


def study_losses(
    problem: LoopErrorProblem,
    inputs: Mapping[str, Lines],
    *,
    samples: int,
    runs: int,
    seed: Seed,
    executor: Executor | None = None,
) -> dict[str, LossStudy]:
    """Try several inputs on the true system of `problem`, all with the same noise and reference.

    Args:
        problem: of an ARX plant and a law that states its loop.
        inputs: name -> spectrum on the harmonics of the record.
        executor: where batches of the runs are computed (default: in this process).

    Raises:
        ValueError: the law states no loop.
    """
    if problem.law.desired is None:
        raise ValueError("only laws that state the loop are simulated")
    roots = {name: dense_roots(lines, samples) for name, lines in inputs.items()}
    trial = _Trial(problem, problem.law.desired, roots, samples)
    size = max(1, _BATCH_SAMPLES // samples)
    parts = run_batches(_losses, trial, runs=runs, size=size, seed=seed, executor=executor)
    return {name: _joined([part[name] for part in parts]) for name in inputs}


def _losses(
    trial: _Trial, runs: int, rng: np.random.Generator
) -> dict[str, tuple[Array, Array, Array, Array]]:
    """For each input loss (runs,), exact loss (runs,), estimates (runs, k), mean squares (runs, inputs)."""
    problem, desired, samples = trial.problem, trial.desired, trial.samples
    plant = problem.plant
    entering = _entering(problem, desired, runs, samples, rng)
    drive = noise_drive(plant.inputs, samples, runs, rng)
    noise = _noise(plant, runs, samples, rng)
    found = {}
    for name, root in trial.roots.items():
        u = shaped_noise(root, drive, samples)
        theta = least_squares(plant, u, plant.simulate(u, np.zeros((1, 1, plant.outputs)), 1.0)[0] + noise)
        filters = error_filters(plant, desired, *estimated_polynomials(plant, theta))
        radius = _largest_root(filters[1])
        loss = _simulated(*filters, entering, radius < 1)
        exact = np.sqrt(samples * _mean_square(problem, desired, *filters, radius))
        found[name] = (loss, exact, theta, np.mean(u * u, axis=1))
    return found


def _noise(plant: MatrixPlant, runs: int, samples: int, rng: np.random.Generator) -> Array:
    """What e contributes to y, (runs, samples, p), from rest; channels come first in memory."""
    white = rng.standard_normal((plant.outputs, runs, samples))
    e = np.tensordot(np.linalg.cholesky(plant.covariance), white, axes=1)
    silent = np.zeros((1, 1, plant.inputs))
    return plant.simulate(silent, np.moveaxis(e, 0, -1), 1.0)[1]


def _largest_root(denominator: Array) -> Array:
    """(runs,): the largest modulus of the roots in z of each polynomial (runs, m) in q^-1."""
    order = denominator.shape[1] - 1
    if order == 0:
        return np.zeros(denominator.shape[0])
    companion = np.zeros((denominator.shape[0], order, order))
    companion[:, 0] = -denominator[:, 1:] / denominator[:, :1]
    companion[:, np.arange(1, order), np.arange(order - 1)] = 1.0
    return np.asarray(np.abs(np.linalg.eigvals(companion)).max(axis=1), dtype=float)


def _entering(
    problem: LoopErrorProblem, desired: DesiredLoop, runs: int, samples: int, rng: np.random.Generator
) -> Array:
    """r - v (runs, samples, n) through the common filter of all runs, from rest; channels first in memory."""
    coloured, common = problem.reference_filter, prefilter(desired)
    source = rng.standard_normal((problem.plant.outputs, runs, samples))
    source *= np.sqrt(problem.reference_variance)[:, None, None]
    source = filtered(coloured.numerator, coloured.denominator_polynomial, source)
    source -= np.moveaxis(_noise(problem.plant, runs, samples, rng), -1, 0)
    out = np.zeros_like(source)
    for i, j in zip(*np.nonzero(np.any(common.numerator, axis=2)), strict=True):
        out[i] += filtered(common.numerator[i, j], common.denominator[i], source[j])
    return np.moveaxis(out, 0, -1)


def _simulated(numerator: Array, denominator: Array, entering: Array, stable: NDArray[np.bool_]) -> Array:
    loss = np.full(numerator.shape[0], np.inf)
    samples = entering.shape[1]
    for run in np.flatnonzero(stable):
        # The denominator first: it is common to all entries, and what is left are short convolutions.
        slow = [filtered([1.0], denominator[run], v) for v in entering[run].T]
        total = 0.0
        for row in numerator[run]:
            out = np.convolve(row[0], slow[0])[:samples]
            for taps, channel in zip(row[1:], slow[1:], strict=True):
                out += np.convolve(taps, channel)[:samples]
            total += float(np.dot(out, out))
        loss[run] = np.sqrt(total)
    return loss


def _mean_square(
    problem: LoopErrorProblem, desired: DesiredLoop, numerator: Array, denominator: Array, radius: Array
) -> Array:
    """(runs,): E|y - y0|^2 of each loop, by a rule on the circle that is exact to the decay of its poles."""
    stable = radius < 1
    common = prefilter(desired)
    slowest = max(float(radius[stable].max(initial=0.0)), float(np.abs(common.poles).max(initial=0.0)))
    points = 512
    while points * (1 - slowest) < _DECAY and points < _LONGEST_GRID:
        points *= 2
    w = 2 * np.pi * np.arange(points // 2 + 1) / points
    weights = np.full(w.size, 2.0 / points)
    weights[[0, -1]] = 1.0 / points
    first = common.at(w)
    entering = (first @ problem.entering(w) @ adjoint(first)) * weights[:, None, None]
    response = np.fft.rfft(numerator, points)
    gain = np.fft.rfft(denominator, points)
    energy = gain.real**2 + gain.imag**2
    power = np.zeros(energy.shape)
    n = numerator.shape[1]
    for i in range(n):
        for b in range(n):
            left = response[:, i, b] * entering[:, b, b].real
            power += left.real * response[:, i, b].real + left.imag * response[:, i, b].imag
            # The spectrum is Hermitian: each pair of entries contributes twice its real part.
            for c in range(b):
                left = response[:, i, b] * (2 * entering[:, b, c])
                power += left.real * response[:, i, c].real + left.imag * response[:, i, c].imag
    return np.where(stable, np.sum(power / energy, axis=1), np.inf)


def _joined(parts: list[tuple[Array, Array, Array, Array]]) -> LossStudy:
    loss, exact, theta, power = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    stable = np.isfinite(loss)
    return LossStudy(loss[stable], exact[stable], theta, int(np.sum(~stable)), power.mean(axis=0))
