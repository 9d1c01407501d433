"""Sweeps: against separate textbook programs, and on two processes against one.

1. The first-order system with m = 20 at 100 values of N: `idesign sweep` in one process, with everything that
   it does (the design for every frequency with its proof, the bound over every spectrum, the best of 20
   signals, files safely on the disc), against the plain cvxpy program of the paper built and solved anew for
   every N (100 logarithmic frequencies, Gram positivity; the optimum on the grid and nothing else). The plain
   programs are timed on some of the points, between parts of the sweep, so that other load falls on both.
2. A sweep of at least a minute, on one process and on two, in alternating parts. It means something on a
   machine with two idle cores only; the load that others make is printed with it.

Only the ratios mean anything. Exits with 1 when the optima disagree by more than the grid explains.

    python benchmarks/sweep.py [--quick] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

from inputdesign_cli.compute.processes import ONE_THREAD, Processes

os.environ.update(ONE_THREAD)

import numpy as np
from least_cost import textbook

from inputdesign_cli import load_spec
from inputdesign_cli.compute.executor import InProcess
from inputdesign_cli.design.convex.coordinates import white_power, whitened_problem
from inputdesign_cli.figures.sweep_table import read_sweep
from inputdesign_cli.questions import build_task
from inputdesign_cli.sweeps.notebook import sweep

ROOT = Path(__file__).parent.parent
SPEC = ROOT / "specs" / "first_order.yaml"
GRID = np.geomspace(1e-3, np.pi, 100)
TARGET_TEXTBOOK, TARGET_TWO = 5.0, 1.6
AGREEMENT = 1e-3


def plain_program(samples: int) -> float:
    """The least cost on a grid of frequencies, from the spec to the optimum."""
    task = build_task(load_spec(SPEC, [f"experiment.samples={samples}"]))
    return textbook(whitened_problem(task.asked.question, white_power(task.asked.question)), GRID)


def against_textbook(folder: Path, *, timed: int) -> dict[str, float]:
    """Ratio of 100 plain programs over a sweep of 100 points, and the largest difference of the optima."""
    lengths = list(range(110, 1101, 10))
    parts = np.array_split(np.array(lengths), timed)
    ours, plain, worst = 0.0, [], 0.0
    for i, part in enumerate(parts):
        started = time.perf_counter()
        out = folder / f"part{i}"
        sweep(SPEC, [f"experiment.samples={','.join(map(str, part))}"], directory=out, executor=InProcess())
        ours += time.perf_counter() - started
        started = time.perf_counter()
        on_grid = plain_program(int(part[0]))
        plain.append(time.perf_counter() - started)
        costs = read_sweep(out).numbers("cost")
        assert costs is not None
        worst = max(worst, abs(on_grid - costs[0]) / costs[0])
    separate = len(lengths) * statistics.mean(plain)
    return {"points": len(lengths), "textbook_timed": timed, "sweep_s": ours, "textbook_s": separate,
            "ratio": separate / ours, "difference": worst}  # fmt: skip


def two_against_one(folder: Path, *, points: int, parts: int) -> dict[str, float]:
    """Ratio of the times of one process and of two; each part is a sweep with its own start of processes."""
    times = {1: 0.0, 2: 0.0}
    load = os.getloadavg()[0]
    each = points // parts
    for part in range(parts):
        first = 200 + part * each
        for jobs in (1, 2) if part % 2 else (2, 1):
            started = time.perf_counter()
            out = folder / f"jobs{jobs}-{part}"
            settings = [f"experiment.samples={first}:{first + each - 1}:1"]
            sweep(SPEC, settings, directory=out, executor=Processes(jobs))
            times[jobs] += time.perf_counter() - started
    return {
        "points": parts * each,
        "one_s": times[1],
        "two_s": times[2],
        "ratio": times[1] / times[2],
        "load": load,
    }


def main() -> int:
    """Print the table and write it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="a tenth of the points, to see that it runs")
    parser.add_argument("--json", type=Path, default=ROOT / "benchmarks" / "sweep.json")
    arguments = parser.parse_args()
    plain_program(500)  # imports and first calls
    with tempfile.TemporaryDirectory() as folder:
        sweep(SPEC, ["experiment.samples=100,101"], directory=Path(folder) / "first")
        plain = against_textbook(Path(folder), timed=2 if arguments.quick else 10)
        print(
            f"100 points in one process: {plain['ratio']:.1f} times faster than 100 textbook programs "
            f"(target {TARGET_TEXTBOOK:g}); the optima differ by {plain['difference']:.1e}",
            flush=True,
        )
        points, parts = (80, 2) if arguments.quick else (800, 2)
        two = two_against_one(Path(folder), points=points, parts=parts)
        print(
            f"{points} points: one process {two['one_s']:.0f} s, two {two['ratio']:.2f} times faster "
            f"(target {TARGET_TWO:g}; load of the machine before {two['load']:.1f})"
        )
    arguments.json.write_text(json.dumps({"textbook": plain, "two": two}, indent=1) + "\n", encoding="utf-8")
    return 0 if plain["difference"] <= AGREEMENT else 1


if __name__ == "__main__":
    sys.exit(main())
