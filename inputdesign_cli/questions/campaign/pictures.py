"""How a campaign went: rounds.csv, and the figures of the estimates and of what has been reached."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from inputdesign_cli.outcome.curves import CampaignCurves, Curves, EstimateCurves
from inputdesign_cli.outcome.results import Json, Table


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
