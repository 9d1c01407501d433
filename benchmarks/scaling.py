"""How the time of a design grows with the number of parameters k and of channels.

Families of random plants, from the spec's words to the design with its proved bound over every
spectrum (no signal):

- output-error plants of order 2, 4, 6, 8 (k = 4 .. 16), |G - G0| held below a constant, FIR spectrum of
  order 40. The rival is what a user writes in forty lines: plain cvxpy with Clarabel in whitened
  coordinates, an exchange on 8001 frequencies that adds every local maximum, the FIR optimum alone, without
  a bound. Its plant, its gradients and its integrals are its own; they are outside of its time.
- output-error plants of order 2 with FIR spectra of order 5 to 300, against the same rival;
- the same with Box-Jenkins noise of order 6 and 10 (k = 24, 40), ours alone;
- p x p plants with entries b q^-1 / (1 - f q^-1), p outputs with independent white noise, D-optimal
  within a limit on the input power, FIR of order 15; criteria A and E;
- the same plants with every entry held to a relative model error, least cost.

Times are of processor, one thread, each family in one run: only ratios mean anything. What `--only` leaves
out stays in the file as it was. Memory is the largest ever of the process. `--quick` takes one plant of each
row and leaves out the largest.

    python benchmarks/scaling.py [--quick] [--only NAME ...] [--json FILE] [--plot FILE]
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

from inputdesign_cli.compute.executor import ONE_THREAD

os.environ.update(ONE_THREAD | os.environ)  # as the command line does, before numpy is imported

import numpy as np
from rivals.naive_exchange import GRID, naive

from inputdesign_cli.design.convex.designs import Design, solve_design
from inputdesign_cli.questions import build_task
from inputdesign_cli.specification import parse_spec

ROOT = Path(__file__).parent.parent
TOLERANCE = 1e-7
SAMPLES = 1000
ADMISSIBLE = 0.1
# At most this share of the naive loop's time, by the number of parameters.
SHARES = {12: 1 / 4, 16: 1 / 8}
# At most this many times the time of p = 2, by p.
GROWTH = {4: 6.0, 6: 60.0}
AGREEMENT = 1e-4

Spec = Mapping[str, object]
Row = dict[str, float | int | str]


def random_poles(rng: np.random.Generator, order: int) -> np.ndarray:
    """A monic polynomial in q^-1 with `order` roots, in conjugate pairs, of modulus 0.5 to 0.9."""
    pairs = order // 2
    roots = rng.uniform(0.5, 0.9, pairs) * np.exp(1j * rng.uniform(0.2, 2.9, pairs))
    every = np.concatenate([roots, roots.conj(), rng.uniform(-0.8, 0.8, order % 2)])
    return np.atleast_1d(np.poly(every).real)


def output_error(seed: int, order: int) -> tuple[np.ndarray, np.ndarray]:
    """B (b_1 .. b_n after the delay) and F of a random plant with |G| at most one."""
    rng = np.random.default_rng([seed, order])
    F = random_poles(rng, order)
    B = np.concatenate([[0.0], rng.normal(size=order)])
    z = np.exp(-1j * GRID)
    size = np.abs(np.polyval(B[::-1], z) / np.polyval(F[::-1], z)).max()
    return B / size, F


def output_error_spec(seed: int, order: int, *, noise_order: int = 0, m: int = 40) -> Spec:
    """An absolute bound on |G - G0| at every frequency."""
    B, F = output_error(seed, order)
    noise: dict[str, object] = {"variance": 0.01}
    if noise_order:
        rng = np.random.default_rng([seed, order, noise_order])
        noise |= {"C": random_poles(rng, noise_order).tolist(), "D": random_poles(rng, noise_order).tolist()}
    return {
        "plant": {"B": B.tolist(), "F": F.tolist()},
        "noise": noise,
        "experiment": {"samples": SAMPLES},
        "cost": {"input_power": 1},
        "accuracy": {"model_error": {"absolute": ADMISSIBLE, "alpha": 2.0}},
        "spectrum": {"type": "fir", "order": m},
    }


def matrix_spec(p: int, demand: Spec, **more: object) -> Spec:
    """p x p entries b q^-1 / (1 - f q^-1)."""
    rng = np.random.default_rng([7, p])
    B = [[[0.0, float(rng.uniform(0.5, 2.0))] for _ in range(p)] for _ in range(p)]
    F = [[[1.0, float(rng.uniform(-0.8, 0.8))] for _ in range(p)] for _ in range(p)]
    return {
        "plant": {"B": B, "F": F},
        "noise": {"variance": np.eye(p).tolist()},
        "experiment": {"samples": SAMPLES},
        "accuracy": dict(demand),
        "spectrum": {"type": "fir", "order": 15},
        **more,
    }


def ours(spec: Spec) -> tuple[Design, Row]:
    """The design with its bound over every spectrum; its processor time, gap and size."""
    started = time.process_time()
    task = build_task(parse_spec(json.dumps(spec)))
    built = time.process_time()
    design = solve_design(
        task.asked.question,
        tolerance=task.asked.tolerance,
        any_spectrum_tolerance=task.asked.any_spectrum_tolerance,
    )
    found, free = design.result, design.any_spectrum
    return design, {
        "k": design.problem.experiment.size,
        "seconds": time.process_time() - built,
        "building_seconds": built - started,
        "objective": found.objective,
        "gap": found.gap,
        "rounds": found.rounds,
        "cuts": found.cuts,
        "any_spectrum_gap": free.gap,
        "any_spectrum_rounds": free.rounds,
        "memory_gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
    }


def against_naive(name: str, size: int, order: int, *, seeds: int, m: int = 40) -> Iterator[Row]:
    """Random output-error plants of one order, each with the naive loop beside it."""
    for seed in range(seeds):
        design, row = ours(output_error_spec(seed, order, m=m))
        on_grid, seconds = naive(*output_error(seed, order), m, admissible=ADMISSIBLE, samples=SAMPLES)
        yield row | {
            "name": name,
            "size": size,
            "seed": seed,
            "naive_seconds": seconds,
            "share": float(row["seconds"]) / seconds,
            "difference": on_grid / design.result.objective - 1.0,
        }


def output_error_rows(*, quick: bool) -> Iterator[Row]:
    """k = 4 .. 16 against the naive loop, the worst of the random plants told by each one's row."""
    for order in (2, 4, 6, 8):
        yield from against_naive("output error", 2 * order, order, seeds=1 if quick else 5)


def spectrum_order_rows(*, quick: bool) -> Iterator[Row]:
    """m = 5 .. 300 at k = 4, against the naive loop."""
    for m in (5, 20) if quick else (5, 10, 20, 40, 80, 160, 300):
        few = quick or m > 80  # the naive loop takes its time
        yield from against_naive("spectrum order", m, 2, seeds=1 if few else 3, m=m)


def box_jenkins_rows(*, quick: bool) -> Iterator[Row]:
    """k = 24 and 40."""
    for order in (6,) if quick else (6, 10):
        yield ours(output_error_spec(0, order, noise_order=order))[1] | {
            "name": "Box-Jenkins",
            "size": 4 * order,
        }


def criterion_rows(letter: str, sizes: tuple[int, ...]) -> Iterator[Row]:
    """A criterion of all parameters of a p x p plant."""
    for p in sizes:
        spec = matrix_spec(p, {"criterion": letter}, limits={"input_power": 1.0})
        if p == 8:
            spec = {**spec, "solver": {"tolerance": 1e-4}}
        yield ours(spec)[1] | {"name": f"criterion {letter}", "size": p}


def model_error_rows(sizes: tuple[int, ...]) -> Iterator[Row]:
    """All entries of a p x p plant, each relative to itself."""
    for p in sizes:
        spec = matrix_spec(p, {"model_error": {"relative": 0.1, "alpha": 2.0}}, cost={"input_power": 1})
        yield ours(spec)[1] | {"name": "relative model error", "size": p}


def rows_of(name: str, *, quick: bool) -> Iterator[Row]:
    """The rows of one family."""
    small = (2, 3)
    if name == "output-error":
        return output_error_rows(quick=quick)
    if name == "spectrum-order":
        return spectrum_order_rows(quick=quick)
    if name == "box-jenkins":
        return box_jenkins_rows(quick=quick)
    if name == "model-error":
        return model_error_rows(small if quick else (2, 3, 4))
    sizes = {"D": small if quick else (2, 3, 4, 6, 8)}.get(name, small if quick else (2, 3, 4))
    return criterion_rows(name, sizes)


NAMES = ("output-error", "spectrum-order", "box-jenkins", "D", "A", "E", "model-error")


def exponent(rows: list[Row]) -> float:
    """Slope of log time against log k over output-error and Box-Jenkins plants and D, k = 4 .. 32."""
    fitted = [row for row in rows if row["name"] in ("output error", "criterion D") and int(row["k"]) <= 32]
    if len({row["k"] for row in fitted}) < 2:
        return float("nan")
    k = np.log([float(row["k"]) for row in fitted])
    seconds = np.log([float(row["seconds"]) for row in fitted])
    return float(np.polyfit(k, seconds, 1)[0])


def figures(rows: list[Row]) -> dict[str, float]:
    """What the targets are about."""
    found = {"exponent of time against k (target at most 3)": exponent(rows)}
    for k, target in SHARES.items():
        shares = [float(row["share"]) for row in rows if row["name"] == "output error" and row["k"] == k]
        if shares:
            found[f"worst share of the naive loop, k = {k} (target {target:.3f})"] = max(shares)
            found[f"median share of the naive loop, k = {k}"] = statistics.median(shares)
    D = {int(row["size"]): float(row["seconds"]) for row in rows if row["name"] == "criterion D"}
    for p, target in GROWTH.items():
        if p in D:
            found[f"D-optimal, p = {p} over p = 2 (target {target:.0f})"] = D[p] / D[2]
    return found


def middle(rows: list[Row], of: str, against: str) -> tuple[list[int], list[float]]:
    """The sizes, and the median of the times of each."""
    sizes = sorted({int(row[against]) for row in rows})
    return sizes, [statistics.median(float(r[of]) for r in rows if r[against] == size) for size in sizes]


def plot(rows: list[Row], path: Path) -> None:
    """Time against k, a line for each family, and against the order m of the spectrum."""
    import matplotlib.pyplot as plt

    figure, (by_k, by_m) = plt.subplots(1, 2, figsize=(9.6, 4.0), layout="constrained", sharey=True)
    families = dict.fromkeys(str(row["name"]) for row in rows)
    for name in families:
        mine = [row for row in rows if row["name"] == name]
        axes, against = (by_m, "size") if name == "spectrum order" else (by_k, "k")
        axes.loglog(
            *middle(mine, "seconds", against), "o-", label="output error, k = 4" if axes is by_m else name
        )
        if name in ("output error", "spectrum order"):
            axes.loglog(
                *middle(mine, "naive_seconds", against), "s--", color="0.5", label="naive loop for it"
            )
    for axes, ticks in ((by_k, [4, 8, 16, 32, 64, 128]), (by_m, [5, 10, 20, 40, 80, 160, 300])):
        axes.set_xticks(ticks, labels=[str(tick) for tick in ticks])
        axes.minorticks_off()
        axes.legend(fontsize="small")
    by_k.set_xlabel("number of parameters k")
    by_m.set_xlabel("order m of the FIR spectrum")
    by_k.set_ylabel("processor time [s]")
    figure.savefig(path)


def left_as_they_were(path: Path, run: set[str]) -> list[Row]:
    """The rows of a file whose families are not run again."""
    if not path.exists():
        return []
    rows: list[Row] = json.loads(path.read_text(encoding="utf-8"))["rows"]
    return [row for row in rows if row["name"] not in run]


def main() -> int:
    """Print the table and write it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="one plant of each row, none of the largest")
    parser.add_argument("--only", nargs="+", choices=NAMES, default=NAMES)
    parser.add_argument("--json", type=Path, default=ROOT / "benchmarks" / "scaling.json")
    parser.add_argument("--plot", type=Path, help="write a plot of time against k and m")
    arguments = parser.parse_args()
    ours(output_error_spec(0, 1))  # imports and first calls
    rows: list[Row] = []
    agreed = True
    for name in arguments.only:
        for row in rows_of(name, quick=arguments.quick):
            rows.append(row)
            close = abs(float(row.get("difference", 0.0))) <= AGREEMENT
            agreed = agreed and close
            rival = f" naive {row['naive_seconds']:7.2f} share {row['share']:6.3f}" if "share" in row else ""
            print(
                f"{row['name']:22}{row['size']:4} k {row['k']:4}  {row['seconds']:8.2f} s"
                f"{rival}  gap {row['gap']:.1e}, {row['any_spectrum_gap']:.1e}"
                f"  rounds {row['rounds']}, {row['any_spectrum_rounds']}  cuts {row['cuts']}"
                f"  {row['memory_gib']:.2f} GiB{'' if close else '  DISAGREE'}",
                flush=True,
            )
    rows += left_as_they_were(arguments.json, {str(row["name"]) for row in rows})
    report = {"rows": rows, "figures": figures(rows)}
    for text, value in report["figures"].items():
        print(f"{text}: {value:.3f}")
    arguments.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    if arguments.plot:
        plot(rows, arguments.plot)
    return 0 if agreed else 1


if __name__ == "__main__":
    sys.exit(main())
