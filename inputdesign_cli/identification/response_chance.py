"""Tests of Wald on G of an estimate: how probable its distance from zero or another G is by chance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.identification.estimate import Estimate
from inputdesign_cli.plant import Model

_FREQUENCIES = 60
_LEAST_FREQUENCY = 1e-3
# Below this probability G is not zero.
_ZERO = 1e-3
# Relative size below which directions of G count as dependent; share of G that may stay unexplained.
_DEPENDENT, _LEFT = 1e-8, 1e-4


def like_nothing_elsewhere(
    nominal: Model, estimated: Model, estimate: Estimate, step: float
) -> list[tuple[int, float, float]]:
    """Return the inputs whose column of G may be zero, with the probabilities of zero and of the nominal G.

    Args:
        nominal, estimated: of one structure.
        step: between samples, in the unit of time of the models.
    """
    w = _frequencies(step)
    with np.errstate(all="ignore"):
        gradient, now, before = estimated.plant_gradient(w), estimated.plant_at(w), nominal.plant_at(w)
    found = []
    for j in range(estimated.inputs):
        change = _stacked(gradient[:, :, :, j].swapaxes(0, 1))
        zero = _chance(estimate, change, _stacked(now[None, :, :, j])[0], wholly=True)
        if zero is None or zero < _ZERO:
            continue
        expected = _chance(estimate, change, _stacked((now - before)[None, :, :, j])[0], wholly=False)
        if expected is not None:
            found.append((j, zero, expected))
    return found


def driven_by_nothing(model: Model, estimate: Estimate, step: float = 1.0) -> list[int]:
    """Return the outputs (from zero) of a model whose row of G does not differ from zero significantly.

    Args:
        step: between samples, in the unit of time of the model.
    """
    return _like_nothing(model, estimate, step, [(i, slice(None)) for i in range(model.outputs)])


def driving_nothing(model: Model, estimate: Estimate, step: float = 1.0) -> list[int]:
    """Return the inputs (from zero) of a model whose column of G does not differ from zero significantly."""
    return _like_nothing(model, estimate, step, [(slice(None), j) for j in range(model.inputs)])


def chance_of_response(model: Model, estimate: Estimate, other: Model, step: float = 1.0) -> float | None:
    """Return the probability that by chance alone an estimated G is as far from another model's G.

    Return None if G is infinite, or no step of the parameters changes it.
    """
    w = _frequencies(step)
    with np.errstate(all="ignore"):
        gradient, away = model.plant_gradient(w), other.plant_at(w) - model.plant_at(w)
    change = _stacked(gradient.swapaxes(0, 1))
    return _chance(estimate, change, _stacked(away[None])[0], wholly=False)


def _like_nothing(
    model: Model, estimate: Estimate, step: float, parts: Sequence[tuple[int | slice, int | slice]]
) -> list[int]:
    """Return the indices of parts of G not significantly different from zero, and not known to be zero."""
    w = _frequencies(step)
    with np.errstate(all="ignore"):
        gradient, G = model.plant_gradient(w), model.plant_at(w)
    found = []
    for number, (i, j) in enumerate(parts):
        change = _stacked(gradient[:, :, i, j].swapaxes(0, 1))
        probability = _chance(estimate, change, _stacked(G[None, :, i, j])[0], wholly=True)
        if np.any(change) and probability is not None and probability > _ZERO:
            found.append(number)
    return found


def _frequencies(step: float) -> Array:
    return np.geomspace(_LEAST_FREQUENCY, 1.0, _FREQUENCIES) * np.pi / step


def _stacked(G: ComplexArray) -> Array:
    """(m, 2 n p): real and imaginary parts of values (m, n, p)."""
    flat = G.reshape(len(G), -1)
    return np.concatenate([flat.real, flat.imag], axis=1)


def _chance(estimate: Estimate, change: Array, away: Array, *, wholly: bool) -> float | None:
    """Return the probability that G differs from the estimate by `away` (m,) through chance alone.

    The Wald statistic is the smallest step of the parameters that moves G there, as far as any step can.
    `change` (k, m) is the gradient of G. Return None if the step must lead there `wholly` and none does.
    """
    if not all(np.all(np.isfinite(x)) for x in (change, away)):
        return None
    J = scipy.linalg.solve_triangular(estimate.factor, change, lower=True)
    _, sizes, right = np.linalg.svd(J, full_matrices=False)
    kept = sizes > _DEPENDENT * np.max(sizes, initial=0.0)
    along = right[kept] @ away
    if wholly and np.linalg.norm(away - along @ right[kept]) > _LEFT * np.linalg.norm(away):
        return None
    return float(scipy.special.chdtrc(np.count_nonzero(kept), np.sum((along / sizes[kept]) ** 2)))
