"""What records achieve: crest factors, the price of few levels, and extra cost over many designs.

Crest factors of flat multisines and of the first-order design, with random, Schroeder's and optimised
phases. The cost of reaching the accuracy by a Gaussian, a multisine, a ternary and a binary record, relative
to the design. Every figure is computed from the samples.

    python benchmarks/signals.py [--json FILE]
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from inputdesign_cli import load_spec, solve
from inputdesign_cli.signal import Sinusoids, crest_factor, line_powers, optimise_phases
from inputdesign_cli.spectrum import FirBasis

ROOT = Path(__file__).parent.parent
KINDS = {
    "noise": "type=filtered_noise",
    "multisine": "type=multisine",
    "ternary": "type=ternary",
    "binary": "type=binary",
}
TARGETS = {
    "crest factor, 64 flat lines": 1.42,
    "crest factor, first-order design": 1.6,
    "binary over noise": 1.35,
}


def crest_factors(lines: Sinusoids) -> dict[str, float]:
    """By kind of phases; the median of 20 random draws, the best of 5 optimisations."""
    draws = [lines.random_phases(np.random.default_rng(seed)) for seed in range(20)]
    starts = [lines.schroeder_phases(), *draws[:4]]
    return {
        "random": float(np.median([crest_factor(lines.record(phases)) for phases in draws])),
        "schroeder": crest_factor(lines.record(starts[0])),
        "optimised": min(crest_factor(lines.record(optimise_phases(lines, start))) for start in starts),
    }


def flat(count: int, samples: int) -> Sinusoids:
    """A flat multisine of the first `count` harmonics."""
    power = np.zeros(samples // 2 + 1)
    power[1 : count + 1] = 1.0 / count
    return Sinusoids.on_grid(power, samples)


def first_order(samples: int) -> Sinusoids:
    """All harmonics of the record of the first-order design."""
    design = solve(load_spec(ROOT / "specs" / "first_order.yaml"))
    c = np.array(design.result["spectrum"]["coefficients"])
    w = 2 * np.pi * np.arange(samples // 2 + 1) / samples
    return Sinusoids.on_grid(line_powers(FirBasis(c.size - 1).density(c, w), samples), samples)


def costs(samples: int) -> dict[str, float]:
    """Cost of reaching the accuracy of the first-order example by kind, over that of the design."""
    found = {}
    for kind, words in KINDS.items():
        spec = load_spec(
            ROOT / "specs" / "first_order.yaml", [f"experiment.samples={samples}", f"signal.{words}"]
        )
        found[kind] = 1.0 + solve(spec).result["signal"]["extra_power"]
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    crests = {f"{count} flat lines": crest_factors(flat(count, 16 * count)) for count in (15, 31, 64)}
    crests["first-order design"] = crest_factors(first_order(500))
    prices = {str(samples): costs(samples) for samples in (500, 2000)}
    print(f"{'crest factor':22}{'random':>10}{'Schroeder':>11}{'optimised':>11}")
    for name, row in crests.items():
        print(f"{name:22}{row['random']:10.3f}{row['schroeder']:11.3f}{row['optimised']:11.3f}")
    print(f"\n{'cost over the design':22}" + "".join(f"{kind:>11}" for kind in KINDS))
    for samples, row in prices.items():
        print(f"{'N = ' + samples:22}" + "".join(f"{row[kind]:11.3f}" for kind in KINDS))
    reached = {
        "crest factor, 64 flat lines": crests["64 flat lines"]["optimised"],
        "crest factor, first-order design": crests["first-order design"]["optimised"],
        "binary over noise": prices["2000"]["binary"] / prices["2000"]["noise"],
    }
    print()
    for name, value in reached.items():
        print(f"{name:34}{value:8.3f}   at most {TARGETS[name]}: {'yes' if value <= TARGETS[name] else 'NO'}")
    if options.json:
        content = {"crest_factor": crests, "cost_over_design": prices, "reached": reached, "targets": TARGETS}
        options.json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
