"""Monte Carlo study of a controller designed on an identified model: losses of the loop for each input.

Each run identifies an ARX model by least squares and designs the model-reference (or internal-model)
controller on it. It compares the true loop with the one that the true plant would have given. The difference
is exact, see `error_filters`; v is the noise at the output.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.design.loop_error.closed_form import adjoint
from inputdesign_cli.design.loop_error.laws import DesiredLoop, complement
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.identification.polynomial_rows import estimated_polynomials, least_squares
from inputdesign_cli.monte_carlo.batches import Seed, run_batches
from inputdesign_cli.plant import TransferMatrix
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.polynomial import delay_of, determinant_and_adjugate, multiply, roots_in_z
from inputdesign_cli.plant.transfer import product_of
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.periodic import dense_roots, noise_drive, shaped_noise

# Samples in a batch, so that it fits into the cache of the processor.
_BATCH_SAMPLES = 200_000
# The trapezoidal rule on the unit circle has a relative error of about exp(-_DECAY).
_DECAY = 40.0
_LONGEST_GRID = 2**16


@dataclass(frozen=True)
class LossStudy:
    """Holds the losses of the closed loop over all runs with one input.

    Attributes:
        loss: (runs,) square root of the sum over the simulated samples of |y - y0|^2.
        exact: (runs,) root of the mean of its square over reference and noise, by the H2 norm of the loop.
        estimates: the parameters (runs, k).
        unstable: the number of estimates with an unstable loop; their losses are left out.
        power: (inputs,) mean squares of the inputs applied.
    """

    loss: Array
    exact: Array
    estimates: Array
    unstable: int
    power: Array


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
        problem: the problem of an ARX plant and a law that states its loop.
        inputs: name -> spectrum on the harmonics of the record.
        executor: where batches of the runs are computed (default: in this process).
    """
    assert problem.law.desired is not None  # for mypy
    roots = {name: dense_roots(lines, samples) for name, lines in inputs.items()}
    tried = partial(_losses, problem, problem.law.desired, roots, samples)
    size = max(1, _BATCH_SAMPLES // samples)
    parts = run_batches(tried, runs=runs, size=size, seed=seed, executor=executor)
    studies = {}
    for name in inputs:
        columns = zip(*(part[name] for part in parts), strict=True)
        loss, exact, theta, power = map(np.concatenate, columns)
        stable = np.isfinite(loss)
        unstable = int(np.sum(~stable))
        studies[name] = LossStudy(loss[stable], exact[stable], theta, unstable, power.mean(axis=0))
    return studies


def _losses(
    problem: LoopErrorProblem,
    desired: DesiredLoop,
    roots: Mapping[str, ComplexArray],
    samples: int,
    runs: int,
    rng: np.random.Generator,
) -> dict[str, tuple[Array, Array, Array, Array]]:
    """Return for each input losses (runs,), exact ones, estimates (runs, k), mean squares (runs, inputs)."""
    plant = problem.plant
    entering = _entering(problem, desired, runs, samples, rng)
    drive = noise_drive(plant.inputs, samples, runs, rng)
    noise = _noise(plant, runs, samples, rng)
    found = {}
    for name, root in roots.items():
        u = shaped_noise(root, drive, samples)
        theta = least_squares(plant, u, plant.simulate(u, np.zeros((1, 1, plant.outputs)), 1.0)[0] + noise)
        filters = error_filters(plant, desired, *estimated_polynomials(plant, theta))
        radius = np.array([np.abs(roots_in_z(row)).max(initial=0.0) for row in filters[1]])
        loss = _simulated(*filters, entering, radius < 1)
        exact = np.sqrt(samples * _mean_square(problem, desired, *filters, radius))
        found[name] = (loss, exact, theta, np.mean(u * u, axis=1))
    return found


def _noise(plant: MatrixPlant, runs: int, samples: int, rng: np.random.Generator) -> Array:
    """Return the part (runs, samples, p) of y due to e, from rest; channels come first in memory."""
    white = rng.standard_normal((plant.outputs, runs, samples))
    e = np.tensordot(np.linalg.cholesky(plant.covariance), white, axes=1)
    silent = np.zeros((1, 1, plant.inputs))
    return plant.simulate(silent, np.moveaxis(e, 0, -1), 1.0)[1]


def _entering(
    problem: LoopErrorProblem, desired: DesiredLoop, runs: int, samples: int, rng: np.random.Generator
) -> Array:
    """Return r - v (runs, samples, n) through the common filter of all runs, from rest; channels first."""
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
        # The denominator is common to all entries and comes first; the rest are short convolutions.
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
    """Return E|y - y0|^2 of each loop (runs,), by the trapezoidal rule on the unit circle."""
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
    response = np.moveaxis(np.fft.rfft(numerator, points), -1, 0)  # (points, runs, n, n)
    power = np.sum((response @ entering[:, None] * response.conj()).real, axis=(2, 3))
    energy = np.abs(np.fft.rfft(denominator, points).T) ** 2
    return np.where(stable, np.sum(power / energy, axis=0), np.inf)


def error_filters(plant: MatrixPlant, desired: DesiredLoop, A: Array, B: Array) -> tuple[Array, Array]:
    """Return numerators (runs, n, n, l) and denominators (runs, m) of the filter behind `prefilter`.

    The loop of an estimate is (I + E) T' (I + E T')^-1 with E = G G_hat^-1 - I and T' = b' F, where b' =
    det / m keeps the zeros of the estimate. With E = E' / (rho det), F = F_n / d and P = rho m d I + E' F_n,

        y - y0 = (d I - F_n) adj(P) E' / det(P) F (r - v)                               where b is one, and
        y - y0 = adj(P) ((b_d d - b_n f) E' + (det b_d - b_n m) rho d I) / det(P) f / (b_d d) (r - v)

    for F = f I / d and b = b_n / b_d of the true plant. No factor outside the circle has to cancel.

    Args:
        A, B: polynomials of the estimates, (runs, n, p) and (runs, n, n, q).
    """
    n, runs = plant.outputs, A.shape[0]
    F, d = desired.free.common_fraction()
    rows = plant.per_output(plant.A)
    common = all(np.array_equal(rows[0], a) for a in rows)
    rho = product_of(rows[:1] if common else rows)
    # rho R^-1 N, with R the diagonal of the A: a polynomial matrix again.
    scaled = np.zeros((1, n, n, plant.numerator.shape[-1] + rho.size - 1))
    for i in range(n):
        rest = np.ones(1) if common else product_of((*rows[:i], *rows[i + 1 :]))
        for j in range(n):
            product = np.convolve(rest, plant.numerator[i, j])
            scaled[0, i, j, : product.size] = product
    det, adj = determinant_and_adjugate(B)
    estimated = np.zeros((runs, n, n, A.shape[-1]))
    estimated[:, np.arange(n), np.arange(n)] = A
    ratio = multiply(multiply(scaled, adj), estimated)
    inside = desired.mirrored(det)
    error = _plus(ratio, -_on_diagonal(_times(det, rho), n))
    lead = _times(_times(inside, rho), d)
    det_P, adj_P = determinant_and_adjugate(_plus(_on_diagonal(lead, n), multiply(error, F[None])))
    if _is_scalar(F):
        b_n, b_d = desired.kept.numerator, desired.kept.denominator_polynomial
        late = _plus(np.convolve(b_d, d), -np.convolve(b_n, F[0, 0]))
        moved = _times(_times(_plus(_times(det, b_d), -_times(inside, b_n)), rho), d)
        numerator = multiply(adj_P, _plus(_times(error, late), _on_diagonal(moved, n)))
    else:
        numerator = multiply(complement(F, d)[None], multiply(adj_P, error))
    shift = delay_of(det_P)
    lengths = max(numerator.shape[-1], det_P.shape[-1]) - shift
    above, below = (_trimmed(_resized(p[..., shift:], lengths)) for p in (numerator, det_P))
    return above, below


def prefilter(desired: DesiredLoop) -> TransferMatrix:
    """Return the part of the filter from r - v to y - y0 that is common to all runs and applied first."""
    F, d = desired.free.common_fraction()
    if not _is_scalar(F):
        return desired.free
    return TransferMatrix(F, ((d, desired.kept.denominator_polynomial),) * len(F))


def _is_scalar(numerator: Array) -> bool:
    """Return whether a matrix of polynomials (n, n, l) is a multiple of I."""
    return np.array_equal(numerator, np.eye(len(numerator))[:, :, None] * numerator[0, 0])


def _trimmed(polynomials: Array) -> Array:
    """Return polynomials without the last coefficients that vanish in all runs."""
    held = np.flatnonzero(np.any(polynomials.reshape(-1, polynomials.shape[-1]) != 0, axis=0))
    return polynomials[..., : int(held[-1]) + 1 if held.size else 1]


def _times(left: Array, right: Array) -> Array:
    """Return polynomials (.., l) times one polynomial (m,)."""
    return np.apply_along_axis(np.convolve, -1, left, right)


def _plus(left: Array, right: Array) -> Array:
    size = max(left.shape[-1], right.shape[-1])
    return _resized(left, size) + _resized(right, size)


def _resized(polynomial: Array, size: int) -> Array:
    """Return polynomials padded with zeros at the end, or cut there."""
    more = [(0, 0)] * (polynomial.ndim - 1) + [(0, max(size - polynomial.shape[-1], 0))]
    return np.pad(polynomial, more)[..., :size]


def _on_diagonal(polynomials: Array, n: int) -> Array:
    """Return diagonal matrices of polynomials, (runs, n, n, l) from (runs, l)."""
    return polynomials[:, None, None] * np.eye(n)[:, :, None]
