"""A spec that is solved in milliseconds, and readers of the files of a sweep."""

import csv
import json
from pathlib import Path

from inputdesign_cli.sweeps.plan import build_plan
from inputdesign_cli.sweeps.running import SweepRun

SPEC = """\
title: A small design
plant: {B: [0, 1], F: [1, -0.5]}
noise: {variance: 1}
experiment: {samples: 100}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 2}
signal: {type: multisine, candidates: 1, seed: 1}
"""


def run_sweep(spec, settings=(), *, directory, verb="solve", **options):
    """Sweep as the command does."""
    return SweepRun(build_plan(spec, settings, verb=verb), directory, **options).run()


def rows(directory: Path) -> list[dict[str, str]]:
    """The table of a sweep."""
    with (directory / "sweep.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def timeless_rows(directory: Path) -> list[dict[str, str]]:
    return [{name: cell for name, cell in row.items() if name != "time_s"} for row in rows(directory)]


def timeless_files(directory: Path) -> dict[str, object]:
    """Every file of every point, without the times that computing took."""
    found: dict[str, object] = {}
    for path in sorted(directory.glob("points/*/*")) + sorted(directory.glob("failures/*")):
        if path.suffix == ".json":
            content = json.loads(path.read_text())
            content.pop("timing_s", None)
            found[str(path.relative_to(directory))] = content
        else:
            found[str(path.relative_to(directory))] = path.read_bytes()
    return found
