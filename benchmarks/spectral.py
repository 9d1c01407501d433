"""Spectral design: the small-S program against the paper's lifted one, from the same matrices.

Both plain cvxpy programs with Clarabel in one process, compile time included: D-optimal, two by two, half
band, Chebyshev span of order 13, real coefficients, input and output power at most 1000. The lifted
program has X >= 0 of order r^2 (m + 1) (the paper's Figure 4: the factor's coefficients as one vector), the
small one S >= 0 of order r (m + 1). Only ratios mean anything.

Exits with 1 when the optima disagree; a ratio below its target is marked.

    python benchmarks/spectral.py [--order 13] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
import warnings
from pathlib import Path

import cvxpy as cp
import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))  # of which the tests are

from inputdesign_cli.spectrum import PolynomialBasis
from tests.support.plants import paper_experiment
from tests.support.spectral_oracle import Spectral

ROOT = Path(__file__).parent.parent

TARGET = 8.0
AGREEMENT = 1e-4
RUNS = 3


def program(information: np.ndarray, limits: list[np.ndarray]) -> float:
    """max log det of M, M_lm = tr(A_lm X), under tr(P X) <= 1 and X >= 0."""
    k, n = information.shape[0], information.shape[-1]
    upper = np.triu_indices(k)
    X = cp.Variable((n, n), PSD=True)
    M = cp.Variable((k, k), symmetric=True)
    flat = cp.vec(X, order="C")
    constraints = [
        cp.vec(M, order="C")[upper[0] * k + upper[1]] == information[upper].reshape(-1, n * n) @ flat
    ]
    constraints += [P.reshape(-1) @ flat <= 1 for P in limits]
    problem = cp.Problem(cp.Maximize(cp.log_det(M)), constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        problem.solve(solver=cp.CLARABEL)
    return float(problem.value)


def main() -> int:
    """Print the comparison and write it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--order", type=int, default=13)
    parser.add_argument("--json", type=Path, default=ROOT / "benchmarks" / "spectral.json")
    arguments = parser.parse_args()
    task = Spectral(paper_experiment(), PolynomialBasis(2, arguments.order, (0.0, 2.0)))
    basis, k = task.basis, task.experiment.size
    # In units of the limits, so that both programs have traces of order one.
    small = np.array([[1e3 * basis.gram(task.maps[:, i, j]) for j in range(k)] for i in range(k)])
    limits = [1e3 * basis.gram(limit) for limit in task.limits]
    lifted = np.kron(np.eye(2), small)
    wide = [np.kron(np.eye(2), limit) for limit in limits]
    values: dict[str, float] = {}
    times: dict[str, list[float]] = {"small": [], "lifted": []}
    for _ in range(RUNS):
        for name, maps, caps in (("small", small, limits), ("lifted", lifted, wide)):
            started = time.perf_counter()
            values[name] = program(maps, caps)
            times[name].append(time.perf_counter() - started)
    ratio = statistics.median(times["lifted"]) / statistics.median(times["small"])
    difference = abs(values["lifted"] - values["small"])
    mark = "" if ratio >= TARGET else "  below target"
    print(f"order {arguments.order}: small-S {ratio:.1f} times faster than lifted (target {TARGET:g}){mark}")
    print(f"optima differ by {difference:.1e} in log det")
    report = {"order": arguments.order, "ratio": ratio, "difference": difference}
    arguments.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    return 0 if difference <= AGREEMENT else 1


if __name__ == "__main__":
    sys.exit(main())
