"""Least-cost design: the textbook program against the exchange method, from the same matrices.

Both in one process. The textbook program is the one of the papers, written plainly: one k x k LMI
per frequency (1000 logarithmic frequencies), positivity by a Gram matrix, cvxpy with Clarabel,
compile time included. Ours answers for every frequency and proves its gap. Both begin with the
problem's matrices at hand and work in the same whitened coordinates. Times are medians; only their
ratios mean anything.

    python benchmarks/least_cost.py [--large] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import cvxpy as cp
import numpy as np

from inputdesign_cli import load_spec
from inputdesign_cli.assemble.least_cost import build_task
from inputdesign_cli.design.exchange import ExchangeResult, exchange
from inputdesign_cli.design.least_cost import whitened_problem
from inputdesign_cli.design.problem import Problem
from inputdesign_cli.design.white import least_white_power
from inputdesign_cli.spectrum import LinesBasis

T = TypeVar("T")
ROOT = Path(__file__).parent.parent
BOUNDS = {
    "sensitivity": [],
    "relative 0.25": ["accuracy.model_error.sensitivity=null", "accuracy.model_error.relative=0.25"],
}


def prepared(bound: str, order: int) -> tuple[Problem, float]:
    """The flexible transmission in closed loop with its matrices computed, and the white power."""
    spec = load_spec(
        ROOT / "specs" / "flexible_transmission.yaml", [*BOUNDS[bound], f"spectrum.order={order}"]
    )
    task = build_task(spec)
    power = least_white_power(task.experiment, task.factories)
    problem = whitened_problem(task.experiment, task.basis, task.cost, task.factories, power)
    _ = problem.information_map, problem.price, problem.grid, problem.baseline_information
    return problem, power


def textbook(problem: Problem, frequencies: np.ndarray) -> float:
    """The optimum on a grid: c_0 .. c_m, a Gram matrix, one LMI per frequency."""
    maps, offset, m = problem.information_map, problem.baseline_information, problem.basis.size - 1
    roots = problem.requirements[0].rows(frequencies)
    c = cp.Variable(m + 1)
    gram = cp.Variable((m + 1, m + 1), PSD=True)
    constraints = [cp.trace(gram) == c[0]]
    constraints += [sum(gram[i, i + lag] for i in range(m + 1 - lag)) == c[lag] for lag in range(1, m + 1)]
    information = offset + sum(c[i] * maps[i] for i in range(m + 1))
    constraints += [information - V.T @ V >> 0 for V in roots]
    program = cp.Problem(cp.Minimize(problem.price.vector @ c), constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        program.solve(solver=cp.CLARABEL)
    return float(program.value)


def ours(problem: Problem, power: float) -> ExchangeResult:
    """Every frequency, proved to 1e-6: ten times tighter than the agreement that is checked."""
    return exchange(problem, power * problem.basis.white, tolerance=1e-6)


def anywhere(problem: Problem) -> ExchangeResult:
    """The optimum over every spectrum, with its proof."""
    lines = LinesBasis.anywhere(problem.grid)
    return exchange(replace(problem, basis=lines), lines.flat, tolerance=1e-6)


def timed(run: Callable[[], T], repetitions: int) -> tuple[T, float]:
    """The last answer and the median time of a call, in seconds."""
    times = []
    for _ in range(repetitions):
        started = time.perf_counter()
        answer = run()
        times.append(time.perf_counter() - started)
    return answer, statistics.median(times)


def compare(bound: str, order: int, repetitions: int) -> dict[str, object]:
    """One row: the ratio of times, the optima, and the textbook's on the frequencies that bind."""
    problem, power = prepared(bound, order)
    grid = np.geomspace(1e-3, np.pi, 1000)
    mine, fast = timed(lambda: ours(*prepared_again(problem, power)), 7)
    on_grid, slow = timed(lambda: textbook(problem, grid), repetitions)
    peaks = [v.frequency for v in problem.requirements[0].violations(mine.information, above=0.999)]
    known = np.concatenate([mine.active_frequencies, peaks])
    checked = textbook(problem, np.union1d(known, np.geomspace(1e-3, np.pi, 60)))
    return {
        "bound": bound,
        "order": order,
        "ratio": slow / fast,
        "optimum": mine.cost,
        "lower_bound": mine.certificate.bound,
        "textbook_on_1000_frequencies": on_grid,
        "textbook_with_our_active_frequencies": checked,
        "difference": abs(checked - mine.cost) / mine.cost,
    }


def prepared_again(problem: Problem, power: float) -> tuple[Problem, float]:
    """The same matrices in a fresh object, so that nothing that a solve caches is reused."""
    fresh = replace(problem)
    for name in ("information_map", "price", "grid"):
        fresh.__dict__[name] = problem.__dict__[name]
    return fresh, power


def help_ratio(repetitions: int = 5) -> float:
    """`idesign --help` over `import cvxpy`, each in a process of its own."""

    def run(*arguments: str) -> float:
        command = [sys.executable, *arguments]
        return timed(lambda: subprocess.run(command, check=True, capture_output=True), repetitions)[1]

    return run("-m", "inputdesign_cli", "--help") / run("-c", "import cvxpy")


def main() -> None:
    """Print the table and write it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--large", action="store_true", help="add m = 80 and the optimum over every spectrum")
    parser.add_argument("--json", type=Path, default=ROOT / "benchmarks" / "least_cost.json")
    arguments = parser.parse_args()
    timed(lambda: ours(*prepared("sensitivity", 5)), 1)  # imports and first calls
    timed(lambda: textbook(prepared("sensitivity", 2)[0], np.array([0.1, 1.0])), 1)
    rows = []
    print(f"{'bound':16}{'m':>4}{'times faster':>14}{'optimum':>14}{'textbook, grid':>16}{'checked':>14}")
    for bound in BOUNDS:
        for order, repetitions in ((20, 3), (40, 3), *(((80, 1),) if arguments.large else ())):
            row = compare(bound, order, repetitions)
            rows.append(row)
            print(
                f"{bound:16}{order:4}{row['ratio']:14.1f}{row['optimum']:14.6f}"
                f"{row['textbook_on_1000_frequencies']:16.6f}{row['difference']:14.1e}",
                flush=True,
            )
    report: dict[str, object] = {"rows": rows, "help_over_import_cvxpy": help_ratio()}
    if arguments.large:
        problem, _ = prepared("sensitivity", 20)
        slow = timed(lambda: textbook(problem, np.geomspace(1e-3, np.pi, 1000)), 1)[1]
        report["textbook_m20_over_every_spectrum"] = slow / timed(lambda: anywhere(problem), 5)[1]
    for name, value in report.items():
        if name != "rows":
            print(f"{name}: {value:.3g}")
    arguments.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
