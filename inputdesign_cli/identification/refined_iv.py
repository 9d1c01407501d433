"""Simplified refined instrumental variables for transfer matrices in s (SRIVC), all entries at once.

[young-jakeman-1980]; [garnier-wang-2008], Chapter 4; for entries with denominators of their own
[garnier-2007].

Multiplied by a_ij / a_ij(previous) the output error of an entry is linear in its new a_ij and b_ij: a
regression on outputs and inputs filtered by s^k / a_ij(previous). What the other entries cause is taken off
the output first (back-fitting), and the noise in the regressors is kept out by instruments, the same
regressors made of the auxiliary model's output. These instruments are the gradient psi of the model's
output. All entries are updated in one weighted regression,

    theta+ = theta + (sum psi S^-1 phi^T)^-1 sum psi S^-1 e,    S = (1/N) sum e e^T .

It stands still where sum psi S^-1 e = 0, and nowhere else: these are the stationary points of det S, to which
the likelihood of the output-error model comes down (`record_problem.py`), and where Gauss and Newton's
steps end, too. An estimate there is efficient for Gaussian noise of any covariance. The regressors phi
differ from psi by noise that is uncorrelated with psi, so that a step is asymptotically one of Gauss and
Newton. From poor starts it reaches further, because it solves equations that are linear in theta instead of
descending; as nothing makes it descend, the search that follows has the last word.
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.identification.record_problem import Point, evaluate
from inputdesign_cli.identification.records import Records

_MOST_ITERATIONS = 20
_PATIENCE = 4
# The search that follows settles what is left; squared, in standard deviations.
_SETTLED = 1e-2


def refine(records: Records, start: Point) -> tuple[Point, int]:
    """Return the likeliest point of the iteration from `start`, and how many steps were made."""
    best, point, since, steps = start, start, 0, 0
    while steps < _MOST_ITERATIONS and np.isfinite(point.cost):
        regressors = point.psi - records.noise_in_regressors(point.theta, point.errors)
        scale = np.sqrt(np.maximum(np.diag(point.hessian), 1e-300))
        matrix = point.against(regressors) / np.outer(scale, scale)
        step = np.linalg.lstsq(matrix, point.slope / scale, rcond=1e-12)[0] / scale
        point = evaluate(records, records.stabilised(point.theta + step))
        best, since = (point, 0) if point.cost < best.cost else (best, since + 1)
        steps += 1
        if since == _PATIENCE or step @ point.hessian @ step * point.errors.size < _SETTLED * point.cost:
            break
    return best, steps
