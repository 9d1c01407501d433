"""Monte Carlo of a controller designed on an identified model: what the loop loses, input by input.

Each run identifies an ARX model by least squares, designs the model-reference (or internal-model)
controller on it, and compares the true loop with the one that the true plant would have given. With
E = G G_hat^-1 - I the difference is exactly y - y0 = S (I + E T)^-1 E T (r - v), v the noise at the output.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.signal
from numpy.typing import NDArray

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.design.loop_error.problem import ClosedLoopProblem
from inputdesign_cli.design.loop_error.transfer import MatrixTransfer
from inputdesign_cli.monte_carlo.arx import ArxStudy
from inputdesign_cli.monte_carlo.batches import Seed, run_batches
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.plant.polynomial_matrix import delay_of, determinant_and_adjugate, multiply
from inputdesign_cli.signal.tabulated_multisine import noise_drive, roots_of, shaped_noise

# Batches stay in the cache of the processor.
_BATCH_SAMPLES = 200_000
# The rule on the circle is wrong by exp(-_DECAY).
_DECAY = 40.0
_LONGEST_GRID = 2**16


@dataclass(frozen=True)
class LossStudy:
    """What the runs lost with one input.

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
    """What all batches share; `roots` are those of the masses of each input, (samples // 2 + 1, m, m)."""

    problem: ClosedLoopProblem
    target: MatrixTransfer
    roots: dict[str, ComplexArray]
    samples: int


def closed_loop_study(
    problem: ClosedLoopProblem,
    target: MatrixTransfer,
    inputs: Mapping[str, ComplexArray],
    *,
    samples: int,
    runs: int,
    seed: Seed,
    executor: Executor | None = None,
) -> dict[str, LossStudy]:
    """Try several inputs on the true system of `problem`, all with the same noise and reference.

    Args:
        target: T of the control law.
        inputs: name -> masses (samples // 2 + 1, m, m) of the lines of the record.
        executor: where batches of the runs are computed (default: in this process).
    """
    trial = _Trial(problem, target, {name: roots_of(masses) for name, masses in inputs.items()}, samples)
    size = max(1, _BATCH_SAMPLES // samples)
    parts = run_batches(_losses, trial, runs=runs, size=size, seed=seed, executor=executor)
    return {name: _joined([part[name] for part in parts]) for name in inputs}


def _losses(
    trial: _Trial, runs: int, rng: np.random.Generator
) -> dict[str, tuple[Array, Array, Array, Array]]:
    """For each input loss (runs,), exact loss (runs,), estimates (runs, k), mean squares (runs, inputs)."""
    problem, target, samples = trial.problem, trial.target, trial.samples
    study = ArxStudy(problem.plant)
    entering = _entering(problem, target, runs, samples, rng)
    drive = noise_drive(problem.plant.inputs, samples, runs, rng)
    noise = study.noise(runs, samples, rng)
    found = {}
    for name, root in trial.roots.items():
        u = shaped_noise(root, drive, samples)
        theta = study.estimate(u, study.outputs(u, noise))
        filters = error_filters(problem.plant, target, *study.polynomials(theta))
        radius = _largest_root(filters[1])
        loss = _simulated(*filters, entering, radius < 1)
        exact = np.sqrt(samples * _mean_square(problem, target, *filters, radius))
        found[name] = (loss, exact, theta, np.mean(u * u, axis=2).T)
    return found


def error_filters(plant: MatrixPlant, target: MatrixTransfer, A: Array, B: Array) -> tuple[Array, Array]:
    """Numerators (runs, n, n, l) and denominators (runs, m) of what follows `prefilter` in each run.

    With polynomials R_i = A_i of the true plant, T = T_n / d and P = rho det d I + E' T_n, the filter
    from r - v to y - y0 is (d I - T_n) adj(P) E' / det(P) after T.

    Args:
        A, B: polynomials of the estimates, (runs, n, p) and (runs, n, n, q).
    """
    n, runs = plant.outputs, A.shape[0]
    T, d = target.numerator, target.denominator
    rows = plant.per_output(plant.A)
    common = all(np.array_equal(rows[0], a) for a in rows)
    rho = np.ones(1)
    for a in rows[:1] if common else rows:
        rho = np.convolve(rho, a)
    # rho R^-1 N, with R the diagonal of the A: a polynomial matrix again.
    scaled = np.zeros((1, n, n, plant.numerator.shape[-1] + rho.size - 1))
    for i in range(n):
        rest = np.ones(1)
        for j, a in enumerate(rows):
            rest = np.convolve(rest, a) if j != i and not common else rest
        for j in range(n):
            product = np.convolve(rest, plant.numerator[i, j])
            scaled[0, i, j, : product.size] = product
    det, adj = determinant_and_adjugate(B)
    estimated = np.zeros((runs, n, n, A.shape[-1]))
    estimated[:, np.arange(n), np.arange(n)] = A
    ratio = multiply(multiply(scaled, adj), estimated)
    bare = _times(det[:, None, None], rho)
    error = _plus(ratio, -_on_diagonal(bare, n))
    lead = _times(bare, d)
    through = multiply(error, T[None])
    det_P, adj_P = determinant_and_adjugate(_plus(_on_diagonal(lead, n), through))
    numerator = multiply(adj_P, error)
    if not target.scalar:
        numerator = multiply(_plus(_on_diagonal(d[None, None, None], n), -T[None]), numerator)
    shift = delay_of(det_P)
    lengths = max(numerator.shape[-1], det_P.shape[-1]) - shift
    return _trimmed(_resized(numerator[..., shift:], lengths)), _trimmed(
        _resized(det_P[..., shift:], lengths)
    )


def prefilter(target: MatrixTransfer) -> MatrixTransfer:
    """The part of the filter from r - v to y - y0 that is the same in all runs, applied first.

    It is T in general. A scalar S commutes with everything, so for T = t I it is S T.
    """
    if not target.scalar:
        return target
    n, T, d = target.numerator.shape[0], target.numerator, target.denominator
    sensitivity = _plus(_on_diagonal(d[None, None, None], n), -T[None])[0]
    return MatrixTransfer(multiply(sensitivity, T), d)


def _trimmed(polynomials: Array) -> Array:
    """Without coefficients at the end that vanish in all runs."""
    held = np.flatnonzero(np.any(polynomials.reshape(-1, polynomials.shape[-1]) != 0, axis=0))
    return polynomials[..., : int(held[-1]) + 1 if held.size else 1]


def _times(left: Array, right: Array) -> Array:
    """Polynomials (.., l) times one polynomial (m,)."""
    product = np.zeros((*left.shape[:-1], left.shape[-1] + right.size - 1))
    for lag, factor in enumerate(right):
        product[..., lag : lag + left.shape[-1]] += factor * left
    return product


def _plus(left: Array, right: Array) -> Array:
    size = max(left.shape[-1], right.shape[-1])
    return _resized(left, size) + _resized(right, size)


def _resized(polynomial: Array, size: int) -> Array:
    """Padded with zeros at the end, or cut there."""
    missing = size - polynomial.shape[-1]
    if missing <= 0:
        return polynomial[..., :size]
    return np.concatenate([polynomial, np.zeros((*polynomial.shape[:-1], missing))], axis=-1)


def _on_diagonal(polynomial: Array, n: int) -> Array:
    """(runs, n, n, l) from (runs, 1, 1, l) or (runs, l)."""
    rows = polynomial.reshape(polynomial.shape[0], 1, 1, polynomial.shape[-1])
    return rows * np.eye(n)[:, :, None]


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
    problem: ClosedLoopProblem, target: MatrixTransfer, runs: int, samples: int, rng: np.random.Generator
) -> Array:
    """r - v (n, runs, samples) through the common filter of all runs, from rest."""
    plant, coloured = problem.plant, problem.reference_filter
    source = rng.standard_normal((plant.outputs, runs, samples))
    source *= np.sqrt(problem.reference_variance)[:, None, None]
    if coloured is not None:
        source = scipy.signal.lfilter(coloured.numerator[0, 0], coloured.denominator, source)
    source -= ArxStudy(plant).noise(runs, samples, rng)
    common = prefilter(target)
    out = np.zeros_like(source)
    for i in range(plant.outputs):
        for j in range(plant.outputs):
            if np.any(common.numerator[i, j]):
                out[i] += scipy.signal.lfilter(common.numerator[i, j], common.denominator, source[j])
    return out


def _simulated(numerator: Array, denominator: Array, entering: Array, stable: NDArray[np.bool_]) -> Array:
    loss = np.full(numerator.shape[0], np.inf)
    samples = entering.shape[2]
    for run in np.flatnonzero(stable):
        # The denominator first: it is common to all entries, and what is left are short convolutions.
        slow = [scipy.signal.lfilter([1.0], denominator[run], v) for v in entering[:, run]]
        total = 0.0
        for row in numerator[run]:
            out = np.convolve(row[0], slow[0])[:samples]
            for taps, channel in zip(row[1:], slow[1:], strict=True):
                out += np.convolve(taps, channel)[:samples]
            total += float(np.dot(out, out))
        loss[run] = np.sqrt(total)
    return loss


def _mean_square(
    problem: ClosedLoopProblem, target: MatrixTransfer, numerator: Array, denominator: Array, radius: Array
) -> Array:
    """(runs,): E|y - y0|^2 of each loop, by a rule on the circle that is exact to the decay of its poles."""
    stable = radius < 1
    common = prefilter(target)
    slowest = max(float(radius[stable].max(initial=0.0)), float(np.abs(common.poles).max(initial=0.0)))
    points = 512
    while points * (1 - slowest) < _DECAY and points < _LONGEST_GRID:
        points *= 2
    w = 2 * np.pi * np.arange(points // 2 + 1) / points
    weights = np.full(w.size, 2.0 / points)
    weights[[0, -1]] = 1.0 / points
    first = common.at(w)
    entering = (first @ problem.entering(w) @ np.conj(np.swapaxes(first, 1, 2))) * weights[:, None, None]
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
