"""How large u = P11^-1 L1 can be over a box, for the shapes that matter, and coordinates of order one.

P11 maps symmetric and skew vectors into themselves, so u falls into two parts, each with its own
matrix: |u_s|^2 <= v_s / lambda_s, and where the part is one-dimensional |u_s| = v_s / |L1_s|.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.regression.lift import Box, Scaling
from inputdesign_cli.design.regression.toeplitz import ToeplitzProblem

SMALLEST_EIGENVALUE = 1e-6
"""Assumed of R11 / r_0 where nothing better is known: for m >= 3 in boxes with singular R11."""

_NOTHING = 1e-28  # the square of rounding in a part of L1 that vanishes
_NARROW = 0.5  # change of P11 over a box, relative to its least eigenvalue, up to which u is expanded


@dataclass(frozen=True)
class BoxLimits:
    """What a box allows.

    Attributes:
        scaling: coordinates for the lift.
        least_v: no shape of the box has a smaller v.
        assumed: the limit takes the eigenvalues of R11 / r_0 to be above SMALLEST_EIGENVALUE.
    """

    scaling: Scaling
    least_v: float
    assumed: bool


@dataclass(frozen=True)
class _Part:
    """The symmetric or the skew part of P11 u = L1 over a box.

    `lowest` bounds the eigenvalues from below, `radius` their change from the centre of the box, `size`
    is a bound on |u| in this part.
    """

    basis: Array
    matrix: Array
    weight: float
    lowest: float
    highest: float
    radius: float
    size: float
    assumed: bool


def box_limits(problem: ToeplitzProblem, box: Box, largest_v: float) -> BoxLimits:
    """Coordinates for a box and for shapes with v <= `largest_v`."""
    parts = _parts(problem, box, largest_v)
    least_v = sum(part.weight / part.highest for part in parts)
    narrow = all(part.radius <= _NARROW * (part.lowest + part.radius) for part in parts)
    scaling = _expanded(problem, box, parts) if narrow else _wide(problem, parts, largest_v)
    return BoxLimits(scaling, least_v, any(part.assumed for part in parts))


def _parts(problem: ToeplitzProblem, box: Box, largest_v: float) -> list[_Part]:
    first = problem.first
    C = scipy.linalg.toeplitz(np.concatenate([[1.0], box.centre]))
    change = scipy.linalg.toeplitz(np.concatenate([[0.0], 0.5 * (box.upper - box.lower)]))
    parts = []
    for basis in ToeplitzProblem(first, np.zeros(0)).halves:
        weight = float(np.sum((basis.T @ first) ** 2))
        radius = float(np.linalg.eigvalsh(np.abs(basis).T @ change @ np.abs(basis))[-1])
        matrix = basis.T @ C @ basis
        eigenvalues = np.linalg.eigvalsh(matrix)
        lowest = float(eigenvalues[0]) - radius
        square, assumed = 0.0, False
        if weight > _NOTHING:
            bounds = [largest_v**2 / weight] if basis.shape[1] == 1 else []
            if lowest > 0.0:
                bounds += [weight / lowest**2, largest_v / lowest]
            square, floor = min(bounds, default=np.inf), largest_v / SMALLEST_EIGENVALUE
            if basis.shape[1] > 1 and square > floor:
                square, assumed = floor, True
        highest = max(float(eigenvalues[-1]) + radius, 1e-300)
        parts.append(_Part(basis, matrix, weight, lowest, highest, radius, float(np.sqrt(square)), assumed))
    return parts


def _wide(problem: ToeplitzProblem, parts: list[_Part], largest_v: float) -> Scaling:
    """u = D w with D = sqrt(s) (C + r)^(-1/2) in each part, r the change of P11 over the box.

    Then |w|^2 = u^T (C + r) u / s <= (v + 2 r |u|^2) / s, and also <= (largest eigenvalue) |u|^2 / s;
    s is chosen to make that of order one.
    """
    D = np.zeros((problem.m, problem.m))
    limit = 0.0
    for part in parts:
        values, vectors = np.linalg.eigh(part.matrix)
        kept = np.maximum(values, 0.0) + part.radius + 1e-12
        least = part.lowest
        v = min(largest_v, part.weight / least if least > 0.0 else np.inf)
        s = max(min(v, float(kept[-1]) * part.size**2), 1e-8)
        frame = part.basis @ vectors
        D += np.sqrt(s) * (frame / np.sqrt(kept)) @ frame.T
        beyond = 2.0 * (part.radius + max(0.0, -float(values[0])) + 1e-12) * part.size**2
        limit += min(v + beyond, float(kept[-1]) * part.size**2) / s
    return Scaling(np.zeros(problem.m), D, max(limit, 1.0))


def _expanded(problem: ToeplitzProblem, box: Box, parts: list[_Part]) -> Scaling:
    """u around its value c at the centre of the box, scaled by how far it moves.

    With K = C^-1 (P11 - C): u - c = -K c + K^2 u. The first term is a combination of the derivatives
    t_k = C^-1 T_k c with coefficients up to half the widths; the second is at most
    (r / lambda)^2 |u| in each part. D D^T is the sum of both, squared.
    """
    m = problem.m
    C = scipy.linalg.toeplitz(np.concatenate([[1.0], box.centre]))
    centre = np.linalg.solve(C, problem.first)
    half = 0.5 * (box.upper - box.lower)
    lags = ToeplitzProblem(problem.first, np.zeros(0)).lags
    tangents = np.linalg.solve(C, (lags[1:] @ centre).T) * half  # (m, m - 1)
    spread = tangents @ tangents.T
    for part in parts:
        change = part.radius / (part.lowest + part.radius)
        size = max(change**2 * part.size, 1e-9 * part.size, 1e-12)
        spread = spread + size**2 * part.basis @ part.basis.T
    values, vectors = np.linalg.eigh(spread)
    D = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    return Scaling(centre, D, (np.sqrt(m - 1.0) + np.sqrt(len(parts))) ** 2)
