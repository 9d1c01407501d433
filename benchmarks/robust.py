"""Designs for many plants: their time against that of one, and the plants that are missed against theory.

    python benchmarks/robust.py         # prints a table and writes benchmarks/robust.json
    python benchmarks/robust.py --quick # fewer plants

Times are processor times of one process, medians of designs for one plant and for 100 in turn: the design and
its bound over every spectrum. The violation is the share of plants drawn afresh that are missed; wait
and judge says that it exceeds eps(k), k the plants that bind, with probability 0.001 at most.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path

from inputdesign_cli.compute.executor import ONE_THREAD

os.environ.update(ONE_THREAD)

import numpy as np

from inputdesign_cli import parse_spec
from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.design.convex.designs import Design, solve_design
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.questions.least_cost.robust_outcome import robust_result

PLANTS = {
    "Box-Jenkins, first order": (
        "plant: {B: [0, 3.6], F: [1, -0.7]}\nnoise: {C: [1, -0.9], variance: 1.0}\n"
        "accuracy: {model_error: {relative: 0.02}}\n",
        "[[0.01, 0, 0], [0, 0.001, 0], [0, 0, 0.0004]]",
    ),
    "output error, resonant": (
        "plant: {B: [0, 1, 0.5], F: [1, -1.601, 0.9409]}\nnoise: {variance: 1.0}\n"
        "accuracy: {model_error: {relative: 0.1, band: [0.01, 1.5]}}\n",
        "[[0.001, 0, 0, 0], [0, 0.001, 0, 0], [0, 0, 2.0e-6, 0], [0, 0, 0, 2.0e-6]]",
    ),
    "ARMAX": (
        "plant: {A: [1, -1.5, 0.7], B: [0, 1, 0.5]}\nnoise: {C: [1, -1, 0.2], variance: 1.0}\n"
        "accuracy: {model_error: {relative: 0.1, band: [0.01, 1.5]}}\n",
        "[[1.0e-4, 0, 0, 0, 0, 0], [0, 1.0e-4, 0, 0, 0, 0], [0, 0, 0.001, 0, 0, 0], [0, 0, 0, 0.001, 0, 0], "
        "[0, 0, 0, 0, 4.0e-4, 0], [0, 0, 0, 0, 0, 4.0e-4]]",
    ),
    "first order in a loop, mean cost": (
        "plant: {B: [0, 0.5], F: [1, -0.8]}\nnoise: {variance: 1.0}\n"
        "cost: {input_power: 1, output_power: 1}\naccuracy: {model_error: {relative: 0.1}}\n",
        "[[0.001, 0], [0, 4.0e-4]]",
    ),
}
LOOP = "experiment: {samples: 500, controller: {numerator: [0.4], denominator: [1, -0.95]}}\n"
OPEN = "experiment: {samples: 500}\n"
SEEDS = (1, 2, 3)


ORDERS = (10, 20)
REPEATS = 7


def text_of(name: str, order: int = ORDERS[0]) -> str:
    """The spec of a plant without its uncertainty."""
    experiment = LOOP if "loop" in name else OPEN
    return f"{PLANTS[name][0]}{experiment}spectrum: {{type: fir, order: {order}}}\n"


def timed(question: Question) -> tuple[float, Design]:
    """The processor time of a design, and the design."""
    start = time.process_time()
    design = solve_design(question, tolerance=1e-7, any_spectrum_tolerance=1e-4)
    return time.process_time() - start, design


def times_of(name: str, order: int) -> dict[str, str | int | float]:
    """The design for 100 plants against that for one."""
    uncertain = f"uncertainty={{covariance: {PLANTS[name][1]}, scenarios: 100}}"
    taken = []
    for _ in range(REPEATS):
        # Built anew, since a plant keeps what was asked of it.
        alone = build_convex(parse_spec(text_of(name, order))).asked.question
        many = build_convex(parse_spec(text_of(name, order), overrides=[uncertain])).asked.question
        (one, single), (hundred, robust) = timed(alone), timed(many)
        taken.append((one, hundred))
    one, hundred = np.median(taken, axis=0).tolist()
    return {
        "plant": name,
        "order": order,
        "one_s": one,
        "hundred_s": hundred,
        "ratio": hundred / one,
        "cost_ratio": robust.result.objective / single.result.objective,
        "gap": robust.result.gap,
        "rounds": robust.result.rounds,
        "cuts": robust.result.cuts,
    }


def main() -> None:
    """Both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", default=Path(__file__).with_suffix(".json"))
    asked = parser.parse_args()
    scenarios, draws = (40, 150) if asked.quick else (200, 3000)
    times, violations = [], []
    for name, (_, covariance) in PLANTS.items():
        for order in ORDERS:
            times.append(times_of(name, order))
            print(f"{name}, order {order}: {times[-1]['ratio']:.1f} times as long")
        for seed in SEEDS:
            stated = f"{{covariance: {covariance}, scenarios: {scenarios}, fresh: {draws}, seed: {seed}}}"
            task = build_convex(parse_spec(text_of(name), overrides=[f"uncertainty={stated}"]))
            done = task.designed()
            assert task.asked.plants is not None
            found = robust_result(done, task.asked.plants).entry
            fresh, risk = found.fresh, found.risk
            assert fresh is not None
            assert risk is not None
            kept = fresh.share <= risk.after
            violations.append(
                {
                    "plant": name,
                    "seed": seed,
                    "support": found.support,
                    "risk": risk.after,
                    "missed": fresh.share,
                    "limits": fresh.limits,
                    "kept": kept,
                }
            )
            print(f"  seed {seed}: {fresh.share:.4f} of eps({found.support})", end="")
            print(f" = {risk.after:.4f} {'kept' if kept else 'MISSED'}")
    listed = {"scenarios": scenarios, "fresh": draws, "times": times, "violations": violations}
    Path(asked.json).write_text(json.dumps(listed, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
