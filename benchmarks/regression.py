"""Mean-squared-error designs with Toeplitz moments: the gap that is proved, its time, how good the design is.

    python benchmarks/regression.py     # prints a table and writes benchmarks/regression.json

The general optimiser is SciPy's L-BFGS-B on the reflection coefficients, which map the cube
onto all positive semidefinite Toeplitz matrices, from 20 random starts.
"""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import scipy.linalg
import scipy.optimize

from inputdesign_cli.design.regression.model import Regression
from inputdesign_cli.design.regression.structured import OutOfReachError, design_toeplitz

CASES = {(2, 4): 15, (2, 5): 15, (3, 6): 5, (3, 7): 5, (4, 8): 5}
STARTS = 20


def random_case(rng: np.random.Generator, m: int, n: int) -> tuple[Regression, dict[str, float]]:
    """A regression with weights of order one, asked for the least error or the least energy."""
    weights = rng.standard_normal(n)
    regression = Regression(weights[:m], weights[m:], float(rng.uniform(0.2, 1.0)), 1.0)
    if rng.random() < 0.5:
        return regression, {"energy": float(rng.uniform(2.0, 20.0))}
    bias = regression.neglected_norm**2 * float(weights[m:] @ weights[m:])
    return regression, {"target": float(rng.uniform(0.5, 2.0) * bias + 0.2)}


def autocorrelations(reflection: np.ndarray) -> np.ndarray:
    """rho of reflection coefficients (Levinson's recursion backwards)."""
    rho, predictor, error = [1.0], np.zeros(0), 1.0
    for k in reflection:
        rho.append(float(predictor @ np.array(rho[:0:-1][: predictor.size]) + k * error))
        predictor = np.append(predictor - k * predictor[::-1], k)
        error *= 1.0 - k**2
    return np.array(rho)


def general(regression: Regression, goal: dict[str, float], rng: np.random.Generator) -> float:
    """The best value of a general optimiser from random starts."""
    n = regression.n

    def value(reflection: np.ndarray) -> float:
        rho = autocorrelations(reflection)
        split = regression.error(scipy.linalg.toeplitz(rho) / n)  # trace 1
        if "energy" in goal:
            return split.bias_squared + split.variance / goal["energy"]
        slack = goal["target"] - split.bias_squared
        return split.variance / slack if slack > 1e-9 else 1e9 * (1.0 - slack)

    best = np.inf
    for _ in range(STARTS):
        start = rng.uniform(-0.9, 0.9, n - 1)
        found = scipy.optimize.minimize(
            value, start, method="L-BFGS-B", bounds=[(-0.999999, 0.999999)] * (n - 1)
        )
        best = min(best, float(found.fun))
    return best


def run_case(seed: int, m: int, n: int) -> dict[str, float | str]:
    rng = np.random.default_rng([seed, m, n])
    regression, goal = random_case(rng, m, n)
    started = time.perf_counter()
    try:
        design = design_toeplitz(regression, **goal, rng=np.random.default_rng(0))
    except OutOfReachError as error:
        spent = time.perf_counter() - started
        return {
            "m": m,
            "n": n,
            "seed": seed,
            "status": "out of reach",
            "reach": error.proved,
            "seconds": spent,
        }
    spent = time.perf_counter() - started
    value = design.split.total if "energy" in goal else design.energy
    other = general(regression, goal, rng)
    return {
        "m": m,
        "n": n,
        "seed": seed,
        "status": "designed",
        "value": value,
        "gap": (value - design.bound) / value,
        "against_general": value / other - 1.0,
        "nodes": design.counts["nodes"],
        "seconds": spent,
        "assumed": design.counts.get("assumed_smallest_eigenvalue", 0.0),
    }


def main() -> None:
    rows = [run_case(seed, m, n) for (m, n), count in CASES.items() for seed in range(count)]
    print(f"{'m n':>5} {'seed':>4} {'value':>11} {'gap':>8} {'general':>9} {'nodes':>5} {'s':>6}")
    for row in rows:
        head = f"{row['m']:>2} {row['n']:>2} {row['seed']:>4}"
        if row["status"] != "designed":
            print(f"{head} out of reach, proved up to {row['reach']:g}  {row['seconds']:.2f} s")
            continue
        print(
            f"{head} {row['value']:11.6g} {row['gap']:8.1e} {row['against_general']:+9.1e} {row['nodes']:5d} "
            f"{row['seconds']:6.2f}"
        )
    Path(__file__).with_suffix(".json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
