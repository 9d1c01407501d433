"""Runs docs/walkthroughs.md and the campaign of docs/robust.md: plays the plants, calls `idesign` as a user
would, keeps the figures.

    python docs/make_walkthroughs.py [DIR]

The plants of Illustration 1 and of the campaign are simulated here, and the tool knows only the data.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.signal

from inputdesign_cli import load_spec
from inputdesign_cli.arrays import Array
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.outcome.record import load_result
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.text_formats import csv_text, read_csv
from inputdesign_cli.questions.campaign.build import build_campaign
from inputdesign_cli.questions.campaign.plans import ratio_of
from inputdesign_cli.questions.campaign.trials import energy_of

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
SPECS = ROOT / "specs"


def idesign(*arguments: str) -> int:
    """Run a command of the tool and show it; its exit code."""
    shown = " ".join(argument.replace(f"{ROOT}/", "") for argument in arguments)
    sys.stdout.write(f"\n$ idesign {shown}\n")
    sys.stdout.flush()
    return subprocess.run([sys.executable, "-m", "inputdesign_cli", *arguments], check=False).returncode


def plant(u: Array, seed: int) -> Array:
    """The true system of Illustration 1: y = 3.6 q^-1 / (1 - 0.7 q^-1) u + (1 - 0.9 q^-1) e, variance 1."""
    e = np.random.default_rng(seed).standard_normal(u.size)
    return np.asarray(scipy.signal.lfilter([0, 3.6], [1, -0.7], u) + scipy.signal.lfilter([1, -0.9], [1], e))


def record(path: Path, u: Array, seed: int) -> Path:
    """Apply u to the plant and write the record."""
    time = np.arange(u.size, dtype=float)
    path.write_text(csv_text(Table({"time_s": time, "u1": u, "y1": plant(u, seed)})), encoding="utf-8")
    return path


def keep(run: Path, **figures: str) -> None:
    """Copy figures of a run into the documentation."""
    for name, target in figures.items():
        shutil.copy(run / f"{name}.png", IMAGES / f"walkthrough_{target}.png")


def illustration_1(folder: Path) -> None:
    """Estimate, design, experiment, estimate again."""
    spec = str(SPECS / "first_order.yaml")
    u = np.sqrt(0.1) * np.random.default_rng(7).standard_normal(400)
    initial = record(folder / "initial.csv", u, seed=8)
    idesign("identify", str(initial), "--spec", spec, "-o", str(folder / "initial"))
    rest = (SPECS / "first_order.yaml").read_text(encoding="utf-8").splitlines()
    kept = [line for line in rest if not line.startswith(("sample_time:", "plant:", "noise:"))]
    designed = folder / "first_order.yaml"
    designed.write_text("\n".join(["include: initial/model.yaml", *kept, ""]), encoding="utf-8")
    idesign("solve", str(designed), "-o", str(folder / "design"))
    signal = read_csv(folder / "design" / "signal.csv")["u1"]
    data = record(folder / "experiment.csv", signal, seed=9)
    idesign("assess", str(designed), str(data), "-o", str(folder / "assessed"))
    keep(folder / "initial", fit="1_fit", bound="1_initial_bound")
    keep(folder / "design", spectrum="1_spectrum")
    name = "data_bound" if (folder / "assessed" / "data_bound.png").exists() else "bound"
    keep(folder / "assessed", **{name: "1_bound"})


def illustration_2(folder: Path) -> None:
    """The flexible transmission: how much each experiment disturbs the loop, and what it achieves."""
    spec = str(SPECS / "flexible_transmission.yaml")
    idesign("simulate", spec, "-o", str(folder / "flexible"))
    white = ["--set", "spectrum={type: white}", "--set", "experiment.samples=1000"]
    idesign("simulate", spec, *white, "-o", str(folder / "white_1000"))
    keep(
        folder / "flexible",
        disturbance_design="2_flexible",
        disturbance_white_that_suffices="2_white",
        errors_design="2_errors",
        cloud_design="2_cloud",
    )
    keep(folder / "white_1000", disturbance_design="2_white_1000")


def campaign_in_a_loop(folder: Path) -> None:
    """The flexible transmission in parts, on the true plant of the spec, in one go from rest."""
    spec, run = SPECS / "flexible_transmission.yaml", folder / "campaign"
    asked = ["campaign={block: 100, power_cap: 0.6, max_samples: 3000}", "signal.seed=0"]
    idesign("campaign", str(spec), *(f"--set={one}" for one in asked), "-o", str(run))
    study = build_campaign(load_spec(spec, asked)).study
    noise = np.sqrt(study.true.model.covariance[0, 0]) * np.random.default_rng(8).standard_normal((3000, 1))
    r = np.zeros((0, 1))
    while (run / "signal.csv").exists():
        signal = read_csv(run / "signal.csv")
        part = signal["r1"][:, None]
        r = np.concatenate([r, part])
        y, u = (x[-len(part) :, 0] for x in study.true.loop.signals(r, noise[: len(r)]))
        path = folder / f"part_{len(r)}.csv"
        path.write_text(csv_text(Table(signal | {"u1": u, "y1": y})), encoding="utf-8")
        idesign("next", str(run), str(path))
    for number, one in enumerate(load_result(run)["campaign"]["rounds"][1:], start=1):
        plan = one.get("plan") or {"samples": "stop"}
        told = [number, one["samples"], f"{one['worst_ratio']:.3g}"]
        told += [plan.get(name, "") for name in ("samples", "planned_samples", "capped", "part_cost")]
        sys.stdout.write(f"| {' | '.join(map(str, told))} |\n")
    at_the_truth = replace(study.true, samples=len(r))
    question = study.planner.question(
        study.true.model, FiniteRecord(at_the_truth, len(r), study.step).information(r)
    )
    ratio = ratio_of(question, question.information)
    share = energy_of(r, study.true, study.step, study.cost) / study.planner.cheapest(study.true.model)
    sys.stdout.write(f"true ratio {ratio:.3f}, energy over that of knowing the plant {share:.3f}\n")
    shutil.copy(run / "campaign.png", IMAGES / "campaign_flexible.png")


def main() -> None:
    """Everything, into DIR (default runs/walkthroughs)."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "runs" / "walkthroughs"
    folder.mkdir(parents=True, exist_ok=True)
    illustration_1(folder)
    illustration_2(folder)
    campaign_in_a_loop(folder)


if __name__ == "__main__":
    main()
