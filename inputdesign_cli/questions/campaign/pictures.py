"""How a campaign went: rounds.csv, its figures, and the pictures of the last decision."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from inputdesign_cli.outcome.curves import CampaignCurves, Curves, EstimateCurves
from inputdesign_cli.outcome.record import listed_files
from inputdesign_cli.outcome.results import Json, Results, Table, typed
from inputdesign_cli.outcome.run_directory import output_errors
from inputdesign_cli.regular_file import read_regular


def history(rounds: Sequence[Mapping[str, Json]], end: int) -> tuple[Table, dict[str, Curves]]:
    """A row for every round with an estimate, and its figures; none while there is no estimate.

    Args:
        end: samples after which the campaign is over at the latest.
    """
    known = [entry for entry in rounds if "estimate" in entry]
    names = list(known[0]["estimate"]) if known else []
    samples = np.array([entry["samples"] for entry in known], dtype=float)
    energy = np.array([entry["energy"] for entry in known], dtype=float)
    ratio = np.array([entry["worst_ratio"] for entry in known], dtype=float)
    columns = {"samples": samples, "energy": energy, "worst_ratio": ratio}
    estimates, spreads = {}, {}
    for name in names:
        estimates[name] = np.array([entry["estimate"][name] for entry in known], dtype=float)
        spreads[name] = np.array([entry["standard_deviation"][name] for entry in known], dtype=float)
        columns |= {name: estimates[name], f"sd_{name}": spreads[name]}
    if not known:
        return Table(columns), {}
    curves: dict[str, Curves] = {
        "campaign": CampaignCurves(samples, ratio, energy, end),
        "estimates": EstimateCurves(samples, estimates, spreads),
    }
    return Table(columns), curves


def with_earlier_pictures(results: Results, directory: Path) -> Results:
    """Return the results with the pictures of the last decision, and a note that they are older.

    Raises:
        OutputError: a picture cannot be read.
    """
    names = [name for name in listed_files(directory) if name.endswith(".png")]
    if not names:
        return results
    with output_errors(directory):
        pictures = {name: read_regular(directory / name) for name in names}
    note = (
        f"{', '.join(names)} show the campaign before this decision, which was made with --no-figures: "
        f"`idesign next {directory}` draws them anew"
    )
    result = {**results.result, "notes": [*results.result.get("notes", []), note]}
    return replace(results, outcome=typed(result), files={**results.files, **pictures})
