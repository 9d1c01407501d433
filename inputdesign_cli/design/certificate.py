"""Lower bounds that we prove ourselves: dual points, evaluated and made exactly feasible.

For every admissible M and any Y >= 0 from a cut, tr(Y M) >= r. With M = M0 + M(x) and
price(x) - s tr(Y M(x)) >= 0 on the whole cone of spectra, price(x) >= s (r - tr(Y M0)). The
multipliers of the solver only suggest Y; the bound holds whatever they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import Cut
from inputdesign_cli.design.problem import Problem
from inputdesign_cli.plant.polynomial import Array


@dataclass(frozen=True)
class Certificate:
    """A proved lower bound on the cost, and the dual point that proves it.

    `weight` Y (k, k) is scaled so that price - tr(Y M(.)) is nonnegative on the cone of spectra;
    `directions` are the spectra for which that is tightest (see `spectrum.Pricing`).
    """

    bound: float
    weight: Array
    directions: Array


def certify(problem: Problem, cuts: Sequence[Cut], multipliers: Sequence[Array]) -> Certificate:
    """The bound that these multipliers (k, k), one a cut, prove for the spectra of the problem."""
    k = problem.experiment.size
    weight, required = np.zeros((k, k)), 0.0
    for cut, multiplier in zip(cuts, multipliers, strict=True):
        part, value = cut.proof(positive_part(multiplier))
        weight = weight + part
        required += value
    pricing = problem.basis.price(problem.price, problem.value(weight), problem.grid)
    gain = required - float(np.sum(weight * problem.baseline_information))
    scale = pricing.scale if gain > 0 and np.isfinite(pricing.scale) else 0.0
    return Certificate(scale * gain, scale * weight, pricing.directions)


def positive_part(matrix: Array) -> Array:
    """The nearest positive semidefinite matrix."""
    eigenvalues, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    kept = eigenvalues > 0
    return (vectors[:, kept] * eigenvalues[kept]) @ vectors[:, kept].T
