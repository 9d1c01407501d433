"""How large u = P11^-1 L1 can be over a box, for the shapes that matter, and coordinates of order one.

P11 maps symmetric and skew vectors into themselves, so u falls into two parts, each with its own
matrix: |u_s|^2 <= v_s / lambda_s, and where the part is one-dimensional |u_s| = v_s / |L1_s|.
"""

from __future__ import annotations

import numpy as np
import scipy

from inputdesign_cli.design.regression.lift import Box, BoxLimits
from inputdesign_cli.design.regression.toeplitz import ToeplitzProblem

SMALLEST_EIGENVALUE = 1e-6
"""Assumed of R11 / r_0 where nothing better is known: for m >= 3 in boxes with singular R11."""

_NOTHING = 1e-28  # the square of rounding in a part of L1 that vanishes
_ROUNDING = 1e-12


def box_limits(problem: ToeplitzProblem, box: Box, largest_v: float) -> BoxLimits:
    """Return the limits in a box on shapes with v <= `largest_v`.

    C is P11 at the centre of the box, r its change over the box, and D = sqrt(s) (C + r)^(-1/2) in each part.
    Then |w|^2 = u^T (C + r) u / s <= (v + 2 r |u|^2) / s, and also <= (largest eigenvalue) |u|^2 / s. s is
    chosen to make the limit of order one.
    """
    C = scipy.linalg.toeplitz(np.concatenate([[1.0], box.centre]))
    change = scipy.linalg.toeplitz(np.concatenate([[0.0], 0.5 * (box.upper - box.lower)]))
    D, limit, least_v, assumed = np.zeros_like(C), 0.0, 0.0, False
    for basis in ToeplitzProblem(problem.first, np.zeros(0)).halves:
        weight = float(np.sum((basis.T @ problem.first) ** 2))
        radius = float(np.linalg.eigvalsh(np.abs(basis).T @ change @ np.abs(basis))[-1])
        values, vectors = np.linalg.eigh(basis.T @ C @ basis)
        lowest = float(values[0]) - radius
        square, unproved = _most(weight, lowest, largest_v, single=len(values) == 1)
        assumed |= unproved
        least_v += weight / max(float(values[-1]) + radius, 1e-300)
        kept = np.maximum(values, 0.0) + radius + _ROUNDING
        v = min(largest_v, weight / lowest if lowest > 0.0 else np.inf)
        most = float(kept[-1]) * square
        s = max(min(v, most), 1e-8)
        frame = basis @ vectors
        D += np.sqrt(s) * (frame / np.sqrt(kept)) @ frame.T
        limit += min(v + 2.0 * (radius + max(0.0, -float(values[0])) + _ROUNDING) * square, most) / s
    return BoxLimits(D, max(limit, 1.0), least_v, assumed)


def _most(weight: float, lowest: float, largest_v: float, *, single: bool) -> tuple[float, bool]:
    """Return an upper bound on |u|^2 of a part, and whether it rests on `SMALLEST_EIGENVALUE`.

    Args:
        weight: |L1|^2 of the part; `lowest` bounds its eigenvalues from below, `single`: it has one.
    """
    if weight <= _NOTHING:
        return 0.0, False
    bounds = [largest_v**2 / weight] if single else []
    if lowest > 0.0:
        bounds += [weight / lowest**2, largest_v / lowest]
    square, floor = min(bounds, default=np.inf), largest_v / SMALLEST_EIGENVALUE
    return (square, False) if single or square <= floor else (floor, True)
