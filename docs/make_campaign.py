"""Plays the campaign of docs/campaigns.md on the flexible transmission, and keeps its figure.

    python docs/make_campaign.py [DIR]

The true plant is simulated here; the tool knows only the data.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from inputdesign_cli import load_spec
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.run_files import load_result
from inputdesign_cli.outcome.text_formats import csv_columns, csv_text
from inputdesign_cli.questions.campaign.build import build_campaign

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
SPECS = ROOT / "specs"


def idesign(*arguments: str) -> int:
    """Run a command of the tool and show it; its exit code."""
    shown = " ".join(argument.replace(f"{ROOT}/", "") for argument in arguments)
    sys.stdout.write(f"\n$ idesign {shown}\n")
    sys.stdout.flush()
    return subprocess.run([sys.executable, "-m", "inputdesign_cli", *arguments], check=False).returncode


def campaign_in_a_loop(folder: Path) -> None:
    """The flexible transmission in parts, on the true plant of the spec, in one go from rest."""
    spec, run = SPECS / "flexible_transmission.yaml", folder / "campaign"
    asked = ["campaign={block: 100, power_cap: 0.6, max_samples: 3000}", "signal.seed=0"]
    idesign("campaign", str(spec), *(f"--set={one}" for one in asked), "-o", str(run))
    task = build_campaign(load_spec(spec, asked))
    noise = np.sqrt(task.true.model.covariance[0, 0]) * np.random.default_rng(8).standard_normal((3000, 1))
    r = np.zeros((0, 1))
    while (run / "signal.csv").exists():
        signal = csv_columns((run / "signal.csv").read_bytes())
        part = signal["r1"][:, None]
        r = np.concatenate([r, part])
        y, u = (x[-len(part) :, 0] for x in task.true.loop.signals(r, noise[: len(r)]))
        path = folder / f"part_{len(r)}.csv"
        path.write_text(csv_text(Table(signal | {"u1": u, "y1": y})), encoding="utf-8")
        idesign("next", str(run), str(path))
    for number, one in enumerate(load_result(run)["campaign"]["rounds"][1:], start=1):
        plan = one.get("plan") or {"samples": "stop"}
        told = [number, one["samples"], f"{one['worst_ratio']:.3g}"]
        told += [plan.get(name, "") for name in ("samples", "planned_samples", "capped", "part_cost")]
        sys.stdout.write(f"| {' | '.join(map(str, told))} |\n")
    at_the_truth = replace(task.true, samples=len(r))
    question = task.planner.question(
        task.true.model, FiniteRecord(at_the_truth, len(r), task.planner.step).information(r)
    )
    ratio = question.ratio(question.information)
    energy = len(r) * task.planner.cost_of(task.true, r)
    share = energy / task.planner.knowing(task.true.model)[0]
    sys.stdout.write(f"true ratio {ratio:.3f}, energy over that of knowing the plant {share:.3f}\n")
    shutil.copy(run / "campaign.png", IMAGES / "campaign_flexible.png")


def main() -> None:
    """Everything, into DIR (default runs/campaign)."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "runs" / "campaign"
    folder.mkdir(parents=True, exist_ok=True)
    campaign_in_a_loop(folder)


if __name__ == "__main__":
    main()
