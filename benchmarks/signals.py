"""What records achieve: crest factors, the price of few levels, and extra cost over many designs.

Crest factors of the classical cases and of the first-order design, by published constructions and by the
phases optimised here. The cost of reaching the accuracy by a Gaussian, a multisine, a ternary and a binary
record, relative to the design, with one input and with two. Every figure is computed from the samples.

The cases are those of the crest factor demonstration of the Frequency Domain System Identification Toolbox
(I. Kollar, J. Schoukens) and flat multisines of 31, 32 and 64 lines. The constructions:
Schroeder          M. R. Schroeder, IEEE Trans. Information Theory 16 (1970) 85-89
Newman             phases pi (k - 1)^2 / L; S. Boyd, IEEE Trans. Circuits and Systems 33 (1986) 1018-1022
Rudin and Shapiro  signs; for powers of two the crest factor is proved to be at most 2; Boyd as above
clip and restore   E. van der Ouderaa, J. Schoukens, J. Renneboog, IEEE Trans. Instrumentation and
                   Measurement 37 (1988) 145-147; the best of 20 random starts
optimised          rising p-norms, P. Guillaume, J. Schoukens, R. Pintelon, I. Kollar, IEEE Trans.
                   Instrumentation and Measurement 40 (1991) 982-989; as the tool does it

    python benchmarks/signals.py [--json FILE]
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from inputdesign_cli import load_spec, solve
from inputdesign_cli.signal.constraints import compressed
from inputdesign_cli.signal.lines import grid_lines
from inputdesign_cli.signal.phases import crest_factor, optimise_phases
from inputdesign_cli.signal.sinusoids import Sinusoids
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
CASES = {
    "15 flat lines": (np.arange(1, 16), np.ones(15)),
    "31 flat lines": (np.arange(1, 32), np.ones(31)),
    "32 flat lines": (np.arange(1, 33), np.ones(32)),
    "64 flat lines": (np.arange(1, 65), np.ones(64)),
    "255 flat lines": (np.arange(1, 256), np.ones(255)),
    "lines 15 to 31, flat": (np.arange(15, 32), np.ones(17)),
    "lines 1 to 36, rising": (np.arange(1, 37), np.arange(1.0, 37.0) ** 2),
}
OVERSAMPLING = 8  # values per shortest period: peaks between samples count
CLIPPED = 0.95  # of the least peak so far


def crest_factors(lines: Sinusoids) -> dict[str, float]:
    """By construction; the median of 20 random draws, the best of 20 clipped ones, of 5 optimised ones."""
    draws = [lines.random_phases(np.random.default_rng(seed)) for seed in range(20)]
    starts = [lines.schroeder_phases(), *draws[:4]]
    k = np.arange(lines.powers.size)
    newman = np.where(lines.real, 0.0, np.pi * k**2 / k.size)
    return {
        "random": float(np.median([crest_factor(lines.record(phases)) for phases in draws])),
        "Schroeder": crest_factor(lines.record(starts[0])),
        "Newman": crest_factor(lines.record(newman)),
        "Rudin, Shapiro": crest_factor(lines.record(np.pi * rudin_shapiro(k.size))),
        "clip, restore": min(clipped(lines.record(phases)) for phases in draws),
        "optimised": min(crest_factor(lines.record(optimise_phases(lines, start))) for start in starts),
    }


def clipped(record: np.ndarray) -> float:
    """The least crest factor on the way of clip and restore from a record."""
    for _ in range(50):
        lower = compressed(record, CLIPPED * float(np.abs(record).max()))
        if crest_factor(lower) >= crest_factor(record):
            break
        record = lower
    return crest_factor(record)


def rudin_shapiro(count: int) -> np.ndarray:
    """0 and 1: the parity of how often 11 occurs in the binary digits of 0, 1, .., count - 1."""
    return np.array([bin(n & (n >> 1)).count("1") % 2 for n in range(count)])


def classical(harmonics: np.ndarray, power: np.ndarray) -> Sinusoids:
    """One period, sampled finely enough that peaks do not hide between the samples."""
    samples = 2 * OVERSAMPLING * int(harmonics[-1])
    powers = np.zeros(samples // 2 + 1)
    powers[harmonics] = power / power.sum()
    return Sinusoids.on_grid(powers, samples)


def first_order(samples: int) -> Sinusoids:
    """All harmonics of the record of the first-order design."""
    design = solve(load_spec(ROOT / "specs" / "first_order.yaml"))
    c = np.array(design.result["spectrum"]["coefficients"])
    w = 2 * np.pi * np.arange(samples // 2 + 1) / samples
    lines = grid_lines(FirBasis(1, c.size - 1).density(c, w), samples, 1.0)
    return Sinusoids.on_grid(lines.dense(samples)[:, 0, 0].real, samples)


def costs(samples: int, example: str = "first_order") -> dict[str, float]:
    """Cost of reaching the accuracy of an example by kind, over that of the design."""
    found = {}
    for kind, words in KINDS.items():
        changes = [f"experiment.samples={samples}", f"signal.samples={samples}", f"signal.{words}"]
        spec = load_spec(ROOT / "specs" / f"{example}.yaml", changes)
        found[kind] = 1.0 + solve(spec).result["signal"]["extra_power"]
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    crests = {name: crest_factors(classical(*case)) for name, case in CASES.items()}
    crests["first-order design"] = crest_factors(first_order(500))
    prices = {str(samples): costs(samples) for samples in (500, 2000)}
    prices["two inputs, 500"] = costs(500, "two_by_two_arx")
    names = list(crests["64 flat lines"])
    print(f"{'crest factor':22}" + "".join(f"{name:>16}" for name in names))
    for case, row in crests.items():
        print(f"{case:22}" + "".join(f"{row[name]:16.3f}" for name in names))
    print(f"\n{'cost over the design':22}" + "".join(f"{kind:>11}" for kind in KINDS))
    for samples, row in prices.items():
        print(f"{samples:22}" + "".join(f"{row[kind]:11.3f}" for kind in KINDS))
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
