"""The figures of the closed-loop design: accuracy, the dual against the grid program, the Monte Carlo.

    python benchmarks/loop_error.py [--json FILE]

Only ratios of times taken in one process mean anything.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
import scipy.signal

from inputdesign_cli import load_spec
from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.loop_error.closed_form import adjoint, power_of, weight
from inputdesign_cli.design.loop_error.design import LoopErrorDesign, design_loop_error
from inputdesign_cli.design.loop_error.laws import ModelReference, sensitivity
from inputdesign_cli.design.loop_error.limits import LimitedDesign, design_within
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.monte_carlo.loop_error import study_losses
from inputdesign_cli.plant import TransferMatrix
from inputdesign_cli.questions.loop_error.build import build_loop_error_task
from inputdesign_cli.questions.loop_error.solve import design_lines

ROOT = Path(__file__).parent.parent
SPEC = ROOT / "specs" / "distillation_column.yaml"
PER_CHANNEL = "limits={input_power: [1.2, 0.5], output_power: [0.001, 0.001]}"
FREQUENCIES = 256
SAMPLES, RUNS = 10_000, 1000
TARGETS = {"formula": 1e-12, "gap": 1e-10, "dual": 20.0, "monte_carlo": 30.0, "memory_gib": 2.0}

T = TypeVar("T")


def timed(run: Callable[[], T]) -> tuple[T, float]:
    """The answer of a call and its time in seconds."""
    started = time.perf_counter()
    answer = run()
    return answer, time.perf_counter() - started


def complex_normal(rng: np.random.Generator, *shape: int) -> ComplexArray:
    """Independent standard complex entries."""
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def general_weight(
    law: ModelReference, G: ComplexArray, w: Array, entering: ComplexArray, noise: ComplexArray
) -> ComplexArray:
    """(17) of the paper for d vec C / d vec G of C = G^-1 X, written out with Kronecker products."""
    found, n = [], G.shape[1]
    S, C = sensitivity(law.complementary(w)), law.controller(G, w)
    for k in range(w.size):
        J = np.kron(S[k].T, S[k] @ G[k]) @ -np.kron(C[k].T, np.linalg.inv(G[k]))
        F = J.conj().T @ np.kron(np.conj(entering[k]), np.eye(n)) @ J
        found.append(np.einsum("aibj,ji->ab", F.reshape(n, n, n, n), noise[k]))
    return np.array(found)


def formula_error() -> float:
    """The largest relative difference of (17) and (19) on random complex plants of size 2 and 3."""
    worst = 0.0
    w = np.linspace(0.05, 3.1, 200)
    for n in (2, 3):
        for seed in range(10):
            rng = np.random.default_rng(seed)
            rows = [[[0.0, *(0.3 * rng.standard_normal(2))] for _ in range(n)] for _ in range(n)]
            law = ModelReference(TransferMatrix.build(rows, [[[1.0, -0.6]] * n] * n))
            G, X, Y = (complex_normal(rng, w.size, n, n) for _ in range(3))
            entering, noise = X @ adjoint(X), Y @ adjoint(Y)
            exact = weight(law.complementary(w), G, entering, noise)
            general = general_weight(law, G, w, entering, noise)
            size = np.abs(exact).max(axis=(1, 2))
            worst = max(worst, float((np.abs(general - exact).max(axis=(1, 2)) / size).max()))
    return worst


def grid_data(problem: LoopErrorProblem) -> tuple[ComplexArray, ComplexArray, Array, Array]:
    """A, the metrics, the limits and even weights at the midpoints of FREQUENCIES equal intervals."""
    w = np.pi * (np.arange(FREQUENCIES) + 0.5) / FREQUENCIES
    return problem.target(w), problem.metrics(w), problem.most, np.full(FREQUENCIES, 1 / FREQUENCIES)


def grid_program(A: ComplexArray, metrics: ComplexArray, limits: Array, weights: Array) -> tuple[float, str]:
    """The textbook program: one complex matrix inequality for each frequency, by cvxpy with Clarabel."""
    import cvxpy as cp

    scale = float(np.trace(A, axis1=1, axis2=2).real.mean())
    root = power_of(A / scale, 0.5)
    n = A.shape[1]
    Phi = [cp.Variable((n, n), hermitian=True) for _ in range(A.shape[0])]
    Q = [cp.Variable((n, n), hermitian=True) for _ in range(A.shape[0])]
    constraints = [cp.bmat([[q, r], [r, phi]]) >> 0 for q, r, phi in zip(Q, root, Phi, strict=True)]
    for metric, limit in zip(metrics / limits[:, None, None, None], np.ones(limits.size), strict=True):
        total = sum(v * cp.trace(m @ phi) for v, m, phi in zip(weights, metric, Phi, strict=True))
        constraints.append(cp.real(total) <= limit)
    objective = cp.real(sum(v * cp.trace(q) for v, q in zip(weights, Q, strict=True)))
    program = cp.Problem(cp.Minimize(objective), constraints)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Solution may be inaccurate")
        value = program.solve(solver=cp.CLARABEL)
    return scale * float(value), str(program.status)


def race(repetitions: int = 3) -> dict[str, float | str]:
    """The dual and the grid program in turn on the column with a limit for each input and output."""
    import cvxpy  # noqa: F401 (its import is not what is compared)

    data = grid_data(build_loop_error_task(load_spec(SPEC, [PER_CHANNEL])).problem)
    quick, slow = [], []
    for _ in range(repetitions):
        for _ in range(5):
            mine, seconds = timed(lambda: design_within(*data))
            quick.append(seconds)
        (value, status), seconds = timed(lambda: grid_program(*data))
        slow.append(seconds)
    assert isinstance(mine, LimitedDesign)
    return {
        "ratio": statistics.median(slow) / statistics.median(quick),
        "value": mine.value,
        "gap": mine.gap,
        "grid_program": value,
        "grid_status": status,
        "difference": abs(value - mine.value) / mine.value,
    }


def bare_passes(repetitions: int = 4) -> list[float]:
    """Times of one first-order lfilter pass over as many samples as the study has."""
    x = np.random.default_rng(0).standard_normal((2 * RUNS, SAMPLES))
    return [timed(lambda: scipy.signal.lfilter([0.0, 0.02], [1.0, -0.97], x))[1] for _ in range(repetitions)]


def monte_carlo(design: LoopErrorDesign) -> dict[str, float]:
    """2 x 1000 runs of 10000 samples over one lfilter pass through as many samples."""
    inputs = {"design": design_lines(design, SAMPLES), "white": design_lines(design, SAMPLES, white=True)}
    before = bare_passes()
    studies, seconds = timed(lambda: study_losses(design.problem, inputs, samples=SAMPLES, runs=RUNS, seed=1))
    passes = [*before, *bare_passes()]
    return {
        "ratio": seconds / statistics.median(passes),
        "memory_gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
        "white_mean": float(studies["white"].loss.mean()),
        "design_mean": float(studies["design"].loss.mean()),
    }


def main() -> int:
    """Print the table and write it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--json", type=Path, default=ROOT / "benchmarks" / "loop_error.json")
    arguments = parser.parse_args()
    task = build_loop_error_task(load_spec(SPEC))
    study = monte_carlo(design_loop_error(task.problem, "asymptotic", tolerance=task.tolerance))
    dual = race()
    error = formula_error()
    rows = [
        ("general formula against (19)", error, TARGETS["formula"], error <= TARGETS["formula"]),
        (
            "gap of the dual",
            abs(float(dual["gap"])),
            TARGETS["gap"],
            abs(float(dual["gap"])) <= TARGETS["gap"],
        ),
        (
            "grid program / dual",
            float(dual["ratio"]),
            TARGETS["dual"],
            float(dual["ratio"]) >= TARGETS["dual"],
        ),
        (
            "Monte Carlo / lfilter pass",
            study["ratio"],
            TARGETS["monte_carlo"],
            study["ratio"] <= TARGETS["monte_carlo"],
        ),
        (
            "memory, GiB",
            study["memory_gib"],
            TARGETS["memory_gib"],
            study["memory_gib"] <= TARGETS["memory_gib"],
        ),
    ]
    print(f"{'':32}{'measured':>12}{'target':>10}")
    for name, measured, target, reached in rows:
        print(f"{name:32}{measured:12.3g}{target:10.3g}{'' if reached else '  MISSED'}")
    print(
        f"grid program: {dual['grid_status']}, {float(dual['difference']):.1e} from the dual's "
        f"{float(dual['value']):.6e}"
    )
    report = {"formula_error": error, "dual": dual, "monte_carlo": study}
    arguments.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    return 0 if all(row[3] for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
