"""500 Box-Jenkins fits in one pass against a plain loop of scipy.optimize.least_squares.

    python benchmarks/identification.py [--runs 500] [--repeat 5] [--json FILE]

The loop uses numerical gradients and tolerances that give the estimates to 1e-6. Both begin at the true
parameters. Only the ratio of times taken in one process means anything.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np
import scipy.optimize
import scipy.signal

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification import fit_batch
from inputdesign_cli.plant import PolynomialModel

ROOT = Path(__file__).parent.parent
MODEL = PolynomialModel(
    B=((np.array([0.0, 1.0, 0.5]),),),
    A=(np.ones(1),),
    F=((np.array([1.0, -1.5, 0.7]),),),
    C=(np.array([1.0, 0.6]),),
    D=(np.array([1.0, -0.8]),),
    covariance=np.eye(1),
)
THETA = MODEL.theta
SAMPLES = 500
TARGET = 10.0
AGREEMENT = 1e-6


def data(runs: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """u and y (runs, SAMPLES, 1): unit white input and noise."""
    u, e = rng.standard_normal((2, runs, SAMPLES, 1))
    caused, noise = MODEL.simulate(u, e, 1.0)
    return u, caused + noise


def plain(u: Array, y: Array) -> Array:
    """One record by the textbook: residuals by lfilter, numerical gradients."""

    def residuals(x: Array) -> Array:
        B, C, D, F = [0, *x[:2]], [1, x[2]], [1, x[3]], [1, *x[4:]]
        return np.asarray(scipy.signal.lfilter(D, C, y - scipy.signal.lfilter(B, F, u)))

    return np.asarray(scipy.optimize.least_squares(residuals, THETA, xtol=1e-10, ftol=1e-12, gtol=1e-10).x)


def main() -> int:
    """Print and store the ratio; 1 when the estimates differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--json", type=Path, default=ROOT / "benchmarks" / "identification.json")
    arguments = parser.parse_args()
    u, y = data(arguments.runs, np.random.default_rng(1))
    fit_batch(MODEL, u[:50], y[:50], start=THETA)  # first calls
    batch_times, loop_times = [], []
    for _ in range(arguments.repeat):
        begin = time.perf_counter()
        found = fit_batch(MODEL, u, y, start=THETA)
        middle = time.perf_counter()
        looped = np.array([plain(a, b) for a, b in zip(u[..., 0], y[..., 0], strict=True)])
        batch_times.append(middle - begin)
        loop_times.append(time.perf_counter() - middle)
    ratios = [slow / fast for slow, fast in zip(loop_times, batch_times, strict=True)]
    ratio = float(np.median(ratios))
    difference = float(np.abs(found.theta - looped).max())
    mark = "" if ratio >= TARGET else "  below target"
    print(f"{arguments.runs} Box-Jenkins fits of {SAMPLES} samples, {THETA.size} parameters")
    print(f"times faster {ratio:.1f} ({min(ratios):.1f} to {max(ratios):.1f}), target {TARGET:.0f}{mark}")
    print(f"largest difference of an estimate {difference:.1e}, converged {found.converged.mean():.3f}")
    report = {
        "runs": arguments.runs,
        "ratio": ratio,
        "ratios": ratios,
        "difference": difference,
        "milliseconds_a_fit": 1e3 * min(batch_times) / arguments.runs,
    }
    arguments.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    return 0 if difference <= AGREEMENT else 1


if __name__ == "__main__":
    sys.exit(main())
