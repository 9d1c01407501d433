"""Campaigns on simulated plants: what the estimates keep, and what that costs against knowing the plant.

    python benchmarks/campaigns.py                  # prints a table and writes benchmarks/campaigns.json
    python benchmarks/campaigns.py --runs 20 --only 'ill1;oe2'

From a prior: 100 samples of white noise with 3 % of the energy of the oracle, which counts in the cost. Wrong
models: no data before, a pole or a resonance that is off. Costs are energies on the true plant over those of
the design that knows it; the oracle has 500 samples. Beside each campaign stands the experiment in one shot.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from inputdesign_cli import load_spec, parse_spec
from inputdesign_cli.outcome import plain
from inputdesign_cli.questions.campaign.build import build_campaign, build_planner
from inputdesign_cli.questions.campaign.study import way_entry
from inputdesign_cli.specification import Spec

ILL1 = (
    "plant: {B: [0, 3.6], F: [1, -0.7]}\nnoise: {C: [1, -0.9], variance: 1.0}\n"
    "accuracy: {model_error: {relative: 0.01, alpha: 2.45}}\n"
)
OE2 = (
    "plant: {B: [0, 1, 0.5], F: [1, -1.601, 0.9409]}\nnoise: {variance: 1.0}\n"
    "accuracy: {model_error: {relative: 0.1, band: [0.01, 1.5]}}\n"
)
ARMAX = (
    "plant: {A: [1, -1.5, 0.7], B: [0, 1, 0.5]}\nnoise: {C: [1, -1, 0.2], variance: 1.0}\n"
    "accuracy: {model_error: {relative: 0.1, band: [0.01, 1.5]}}\n"
)
COMMON = "experiment: {samples: 500}\nspectrum: {type: fir, order: 20}\n"
ENERGY, SAMPLES = 0.03, 100  # of the prior: its share of the energy of the oracle, its samples
# 2 rho cos(w) and rho^2 of oe2 with the resonance at 0.75 rad/s, and with the radius 0.93.
RESONANCE, RADIUS = "[1, -1.419475, 0.9409]", "[1, -1.535124, 0.8649]"
FLEX = Path(__file__).parent.parent / "specs" / "flexible_transmission.yaml"


@dataclass(frozen=True)
class Case:
    """A plant, what the design takes for it, and how the campaign goes; a prior where `wrong` is empty."""

    name: str
    text: str
    wrong: str = ""
    campaign: str = "{block: 50}"


CASES = (
    Case("ill1", ILL1),
    Case("oe2", OE2),
    Case("armax", ARMAX),
    Case(
        "oe2, resonance 0.75 for 0.60",
        OE2,
        f"plant={{B: [0, 1, 0.5], F: {RESONANCE}}}",
        "{block: 50, pilot: 25}",
    ),
    Case(
        "oe2, radius 0.93 for 0.97", OE2, f"plant={{B: [0, 1, 0.5], F: {RADIUS}}}", "{block: 50, pilot: 25}"
    ),
    Case("ill1, pole 0.4 for 0.7", ILL1, "plant={B: [0, 3.6], F: [1, -0.4]}", "{block: 50, pilot: 25}"),
)


def spec_of(case: Case) -> Spec:
    """The spec of a case."""
    truth = parse_spec(case.text + COMMON)
    if case.wrong:
        block = f"simulation={{plant: {json.dumps(truth.content['plant'])}}}"
        return parse_spec(case.text + COMMON, overrides=[case.wrong, block, f"campaign={case.campaign}"])
    planner = build_planner(truth)
    power = ENERGY * planner.knowing(planner.nominal.model)[0] / SAMPLES
    pilot = f"campaign={{block: 50, pilot: {{samples: {SAMPLES}, power: {power!r}}}}}"
    return parse_spec(case.text + COMMON, overrides=[pilot])


def flexible_transmission() -> Spec:
    """Blocks of 100, the power capped at 0.6 of that of the first plan."""
    campaign = "campaign={block: 100, power_cap: 0.6, max_samples: 3000}"
    return load_spec(FLEX, [campaign])


def measured(name: str, spec: Spec, runs: int) -> dict[str, object]:
    """What a campaign and the experiment in one shot give."""
    task = build_campaign(spec.with_(**{"simulation.runs": runs, "simulation.seed": 1}))
    oracle = task.oracle()
    assert oracle is not None  # the plants of this table can be asked
    found: dict[str, object] = {"case": name, "runs": runs, "oracle": asdict(oracle)}
    for way in ("campaign", "one_shot"):
        started = time.process_time()
        entry = plain(way_entry(task.tried(way), oracle))
        found[way] = entry | {"seconds_a_run": (time.process_time() - started) / runs}
        low, high = entry.get("within_r_adm_true_limits", (0, 1))
        print(
            f"{name}, {way}: coverage {100 * entry['within_r_adm_true']:.1f} % ({100 * low:.1f} to "
            f"{100 * high:.1f}), cost {entry['cost_over_oracle']['mean']:.3g}, true ratio 95 % "
            f"{entry['true_ratio']['quantile_95']:.3g}, samples {entry['samples']['mean']:.0f}, missed "
            f"{entry['missed']}, undecided {entry['undecided']}",
            flush=True,
        )
    return found


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--only", default="", help="names of cases, a semicolon between them")
    parser.add_argument("--json", default=Path(__file__).with_suffix(".json"))
    asked = parser.parse_args()
    wanted = tuple(filter(None, asked.only.split(";")))
    found = [
        measured(case.name, spec_of(case), asked.runs) for case in CASES if not wanted or case.name in wanted
    ]
    if not wanted or "flex" in wanted:
        found.append(measured("flex", flexible_transmission(), asked.runs))
    Path(asked.json).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
