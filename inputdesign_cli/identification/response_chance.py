"""Wald tests of G of an estimate: how probable its distance from zero or another G is by chance."""

from __future__ import annotations

import numpy as np
import scipy

from inputdesign_cli.arrays import ComplexArray
from inputdesign_cli.identification.estimators import Estimate
from inputdesign_cli.plant import Model

_FREQUENCIES = 60
_LEAST_FREQUENCY = 1e-3
# Below this probability G is not zero.
_ZERO = 1e-3
# Relative size below which directions of G count as dependent; share of G that may stay unexplained.
_DEPENDENT, _LEFT = 1e-8, 1e-4


def perhaps_other_inputs(
    nominal: Model, estimated: Model, estimate: Estimate, step: float
) -> list[tuple[int, float, float]]:
    """Return the inputs whose column of G may be zero, with the probabilities of zero and of the nominal G.

    The `nominal` and the `estimated` model are of one structure; samples are `step` apart.
    """
    gradient, now, before = *_response(estimated, step), _response(nominal, step)[1]
    found = []
    for j, zero in _zeros(estimate, gradient, now, 2).items():
        expected = _chance(estimate, gradient[..., j], (now - before)[..., j], exactly=False)
        if expected is not None:
            found.append((j, zero, expected))
    return found


def perhaps_zero(model: Model, estimate: Estimate, step: float = 1.0, *, inputs: bool = False) -> list[int]:
    """Return the outputs (from zero), or `inputs`, whose part of G may be zero, and is not known to be."""
    gradient, G = _response(model, step)
    axis = 2 if inputs else 1
    return [i for i in _zeros(estimate, gradient, G, axis) if np.any(np.take(gradient, i, axis + 1))]


def _zeros(estimate: Estimate, gradient: ComplexArray, G: ComplexArray, axis: int) -> dict[int, float]:
    """Return the outputs or inputs, along an axis of G (n, p, r), with the probability of zero by chance."""
    each = (
        (i, _chance(estimate, np.take(gradient, i, axis + 1), np.take(G, i, axis), exactly=True))
        for i in range(G.shape[axis])
    )
    return {i: chance for i, chance in each if chance is not None and chance >= _ZERO}


def _response(model: Model, step: float) -> tuple[ComplexArray, ComplexArray]:
    """Return the gradient (n, k, p, r) of G, and G (n, p, r), up to half the sampling frequency."""
    w = np.geomspace(_LEAST_FREQUENCY, 1.0, _FREQUENCIES) * np.pi / step
    with np.errstate(all="ignore"):
        return model.plant_gradient(w), model.plant_at(w)


def _chance(
    estimate: Estimate, gradient: ComplexArray, difference: ComplexArray, *, exactly: bool
) -> float | None:
    """Return the probability that a part of G differs by (n, p) from the estimate through chance alone.

    The Wald statistic is the squared length of the smallest step of the parameters that moves G there,
    `exactly` or as far as a step can. None if no step moves it exactly, or a value is infinite.

    Args:
        gradient: (n, k, p), gradient of that part of G.
    """
    if not (np.all(np.isfinite(gradient)) and np.all(np.isfinite(difference))):
        return None
    every = np.concatenate([gradient.swapaxes(0, 1), difference[None]]).reshape(gradient.shape[1] + 1, -1)
    *change, away = np.concatenate([every.real, every.imag], axis=1)
    J = scipy.linalg.solve_triangular(estimate.factor, np.array(change), lower=True)
    _, sizes, right = np.linalg.svd(J, full_matrices=False)
    kept = sizes > _DEPENDENT * np.max(sizes, initial=0.0)
    along = right[kept] @ away
    if exactly and np.linalg.norm(away - along @ right[kept]) > _LEFT * np.linalg.norm(away):
        return None
    return float(scipy.special.chdtrc(np.count_nonzero(kept), np.sum((along / sizes[kept]) ** 2)))
