"""Least-cost design: the textbook program against the exchange method, from the same matrices.

Both in one process. The textbook program is the one of the papers, written plainly: one k x k LMI
per frequency (1000 logarithmic frequencies), positivity by a Gram matrix, cvxpy with Clarabel,
compile time included. Ours answers for every frequency and proves its gap. Both begin with the
problem's matrices at hand and work in the same whitened coordinates. Every run of ours has objects
of its own, so that nothing computed by an earlier one is reused: the grids and rows of its
requirement and the matrices of its coarser problems are inside its time. Runs of both alternate, so
that other load falls on both. Times are medians; only their ratios mean anything.

Exits with 1 when the optima disagree. Ratios below their targets are marked, and no more.

    python benchmarks/least_cost.py [--large] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from inputdesign_cli.compute.executor import ONE_THREAD

os.environ.update(ONE_THREAD | os.environ)  # as the command line does, before numpy is imported

import cvxpy as cp
import numpy as np

from inputdesign_cli import load_spec
from inputdesign_cli.design.convex.coordinates import white_power, whitened_problem
from inputdesign_cli.design.convex.exchange import ExchangeResult, exchange
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.questions import build_task
from inputdesign_cli.spectrum import LinesBasis

T = TypeVar("T")
GRID = np.geomspace(1e-3, np.pi, 1000)
AGREEMENT = 1e-5
TARGETS = {20: 40.0, 40: 60.0, 80: 25.0}  # times faster, by order
FREE_TARGET = 5.0  # times faster than the textbook program of order 20
HELP_TARGET = 0.35
SOLVE_TARGET = 1.8
TEXTBOOK_RUNS = {20: 3, 40: 2, 80: 1}
OURS_RUNS = 7
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
    power = white_power(task.asked.question)
    problem = whitened_problem(task.asked.question, power)
    # Caches only of what both start from. Those of the requirement are left to be timed.
    _ = problem.information_map, problem.price, problem.gradients.grid, problem.baseline_information
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
    if program.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise RuntimeError(f"the textbook program at m = {m} ends with status {program.status}")
    return float(program.value)


def ours(problem: Problem, power: float) -> ExchangeResult:
    """Every frequency, with its proof."""
    return exchange(problem, power * problem.basis.even, tolerance=1e-7)


def anywhere(problem: Problem, power: float) -> ExchangeResult:
    """The optimum over every spectrum, with its proof."""
    lines = LinesBasis.anywhere(*problem.experiment.band, problem.experiment.inputs)
    return exchange(replace(problem, basis=lines), power * lines.even, tolerance=1e-6)


def timed(run: Callable[[], T]) -> tuple[T, float]:
    """The answer of a call and its time in seconds."""
    started = time.perf_counter()
    answer = run()
    return answer, time.perf_counter() - started


def race(
    bound: str, order: int, fast: Callable[[Problem, float], ExchangeResult]
) -> tuple[ExchangeResult, float, float]:
    """Runs of `fast` and of the textbook program in turn, each on a problem of its own.

    Returns:
        the answer of `fast`, the textbook's optimum on the grid, and the ratio of the median times.
    """
    quick: list[float] = []
    slow: list[float] = []
    repetitions = TEXTBOOK_RUNS[order]
    for _ in range(repetitions):
        for _ in range(-(-OURS_RUNS // repetitions)):
            mine, seconds = timed(partial(fast, *prepared(bound, order)))
            quick.append(seconds)
        on_grid, seconds = timed(partial(textbook, prepared(bound, order)[0], GRID))
        slow.append(seconds)
    return mine, on_grid, statistics.median(slow) / statistics.median(quick)


def compare(bound: str, order: int) -> dict[str, float | str]:
    """One row: the ratio of times, the optima, and the textbook's with our binding frequencies added.

    The grid misses peaks, so its optimum may be too low. On any frequencies at all the textbook program
    is a relaxation of the problem that ours solves; when it is given the frequencies at which our
    design binds, and reaches the cost of our design, both are optimal at every frequency.
    """
    mine, on_grid, ratio = race(bound, order, ours)
    problem, _ = prepared(bound, order)
    peaks = [v.frequency for v in problem.requirements[0].violations(mine.information, above=0.999)]
    binding = np.concatenate([mine.active_frequencies, np.array(peaks, dtype=float)])
    checked = textbook(problem, np.union1d(binding, np.geomspace(1e-3, np.pi, 60)))
    return {
        "bound": bound,
        "order": order,
        "ratio": ratio,
        "optimum": mine.objective,
        "lower_bound": mine.certificate.bound,
        "textbook_on_grid": on_grid,
        "textbook_with_binding_frequencies": checked,
        "difference_on_grid": abs(on_grid - mine.objective) / mine.objective,
        "difference_with_binding_frequencies": abs(checked - mine.objective) / mine.objective,
        "worst_ratio": problem.demands.worst_ratio(mine.informations).ratio,
    }


def disagreement(row: Mapping[str, float | str]) -> float:
    """The difference that must not exceed `AGREEMENT`: on the bare grid too where that holds every peak."""
    held = ["difference_with_binding_frequencies"]
    if row["bound"] == "sensitivity":
        held.append("difference_on_grid")
    return max(float(row[name]) for name in held)


def command_ratio(*arguments: str, repetitions: int = 7) -> float:
    """`idesign` with these arguments over `import cvxpy`, each in a process of its own, in turns."""

    def run(*command: str) -> float:
        return timed(lambda: subprocess.run([sys.executable, *command], check=True, capture_output=True))[1]

    pairs = [
        (run("-m", "inputdesign_cli", *arguments), run("-c", "import cvxpy")) for _ in range(repetitions)
    ]
    ours, importing = zip(*pairs, strict=True)
    return statistics.median(ours) / statistics.median(importing)


def main() -> int:
    """Print the table and write it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--large", action="store_true", help="add m = 80 and the optimum over every spectrum")
    parser.add_argument("--json", type=Path, default=ROOT / "benchmarks" / "least_cost.json")
    arguments = parser.parse_args()
    ours(*prepared("sensitivity", 5))  # imports and first calls
    textbook(prepared("sensitivity", 2)[0], np.array([0.1, 1.0]))
    rows: list[dict[str, float | str]] = []
    agreed = True
    print(
        f"{'bound':15}{'m':>4}{'times faster':>14}{'target':>8}{'optimum':>14}{'textbook, grid':>16}"
        f"{'difference':>12}{'with ours':>12}"
    )
    for bound in BOUNDS:
        for order in (20, 40, *((80,) if arguments.large else ())):
            row = compare(bound, order)
            rows.append(row)
            target = TARGETS.get(order, 0.0)
            mark = "" if float(row["ratio"]) >= target else "  below target"
            if disagreement(row) > AGREEMENT:
                agreed, mark = False, mark + "  DISAGREE"
            print(
                f"{bound:15}{order:4}{row['ratio']:14.1f}{target:8.0f}{row['optimum']:14.6f}"
                f"{row['textbook_on_grid']:16.6f}{row['difference_on_grid']:12.1e}"
                f"{row['difference_with_binding_frequencies']:12.1e}{mark}",
                flush=True,
            )
    report: dict[str, object] = {"rows": rows}
    if arguments.large:
        free, _, ratio = race("sensitivity", 20, anywhere)
        proved = free.certificate.bound
        report["every_spectrum"] = {"optimum": free.objective, "lower_bound": proved, "ratio": ratio}
        print(
            f"every spectrum {free.objective:.6f}, gap {free.gap:.1e}: {ratio:.1f} times faster than m = 20 "
            f"(target {FREE_TARGET:.0f})"
        )
    share = report["help_over_import_cvxpy"] = command_ratio("--help")
    print(f"idesign --help over import cvxpy: {share:.3f} (target at most {HELP_TARGET})")
    with tempfile.TemporaryDirectory() as folder:
        spec = str(ROOT / "specs" / "first_order.yaml")
        share = command_ratio("solve", spec, "-o", f"{folder}/run", "--overwrite", "--quiet")
    report["solve_over_import_cvxpy"] = share
    print(f"idesign solve with figures over import cvxpy: {share:.3f} (target at most {SOLVE_TARGET})")
    arguments.json.parent.mkdir(parents=True, exist_ok=True)
    arguments.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    return 0 if agreed else 1


if __name__ == "__main__":
    sys.exit(main())
