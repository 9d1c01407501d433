"""What `result.json` and the figures say of campaigns that were tried on a simulated true system."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.statistics import binomial_limits
from inputdesign_cli.outcome.curves import Curves, RatioCurves, TradeCurves
from inputdesign_cli.outcome.results import Json, Table
from inputdesign_cli.questions.campaign.schedule import Oracle
from inputdesign_cli.questions.campaign.trials import Ended, Ending

_WITHIN = {"true": "within_r_adm_true", "estimate": "within_r_adm_estimate", "design": "within_r_adm"}
_ENDINGS: tuple[Ending, ...] = ("stopped", "missed", "undecided", "unplanned")


def campaigns_entry(
    true: Experiment, ways: Mapping[str, Sequence[Ended]], oracle: Oracle | None, *, runs: int, seed: int
) -> dict[str, Json]:
    """`simulation` of `result.json`.

    Args:
        ways: the runs of the campaign, and of what it is compared with.
        oracle: what knowing the true plant would cost; None where it cannot be asked.
    """
    model = true.model
    entry: dict[str, Json] = {
        "runs": runs,
        "seed": seed,
        "samples": true.samples,
        "true_parameters": dict(zip(model.names, model.theta.tolist(), strict=True)),
        "true_variance": float(model.covariance[0, 0]) if model.outputs == 1 else model.covariance,
        "inputs": {name: way_entry(ended, oracle) for name, ended in ways.items()},
        "numbers": {"way": list(ways), "status": list(_ENDINGS)},
    }
    if oracle is not None:
        entry["oracle_cost"] = oracle.cost / true.samples
        if oracle.record is not None:
            entry["oracle_record_cost"] = oracle.record / true.samples
    return entry


def way_entry(ended: Sequence[Ended], oracle: Oracle | None) -> dict[str, Json]:
    """What the runs of one way of experimenting gave."""
    entry: dict[str, Json] = {}
    for of, name in _WITHIN.items():
        told = [run.within[of] for run in ended]
        if any(one is None for one in told):
            continue
        kept = sum(map(bool, told))
        entry[name], entry[f"{name}_limits"] = kept / len(told), list(binomial_limits(kept, len(told)))
    ratios = [run.ratio for run in ended if run.ratio is not None]
    if ratios:
        entry["true_ratio"] = _spread(ratios) | {"at_most_one": float(np.mean(np.array(ratios) <= 1.0))}
    energies = np.array([run.energy for run in ended])
    entry["energy"] = _spread(energies)
    if oracle is not None and oracle.cost > 0.0:
        entry["cost_over_oracle"] = _spread(energies / oracle.cost)
        if oracle.record is not None:
            entry["cost_over_oracle_record"] = _spread(energies / oracle.record)
    entry["samples"] = _spread([run.samples for run in ended])
    counts = Counter(run.status for run in ended)
    entry |= {status: counts[status] for status in _ENDINGS}
    entry["parts"] = {"mean": float(np.mean([run.parts for run in ended]))}
    entry["shrunk"] = sum(run.shrunk for run in ended)
    return entry


def _spread(values: Sequence[float] | np.ndarray) -> dict[str, Json]:
    return {"mean": float(np.mean(values)), "quantile_95": float(np.quantile(values, 0.95))}


def campaigns_curves(
    ways: Mapping[str, Sequence[Ended]], oracle: Oracle | None
) -> tuple[dict[str, Table], dict[str, Curves]]:
    """campaigns.csv with a row for each run, the true ratios, and cost against coverage."""
    ratios = {name: [run.ratio for run in ended if run.ratio is not None] for name, ended in ways.items()}
    curves: dict[str, Curves] = {}
    if any(ratios.values()):
        curves["true_ratio"] = RatioCurves({name: np.array(values) for name, values in ratios.items()})
    tables = {"campaigns": _table(ways)}
    if oracle is None or any(run.within["true"] is None for ended in ways.values() for run in ended):
        return tables, curves
    points = {}
    for name, ended in ways.items():
        kept, energies = sum(bool(run.within["true"]) for run in ended), [run.energy for run in ended]
        limits = binomial_limits(kept, len(ended))
        costs = np.quantile(np.array(energies) / oracle.cost, [0.05, 0.95])
        points[name] = (float(np.mean(energies)) / oracle.cost, *costs.tolist(), kept / len(ended), *limits)
    record = None if oracle.record is None else oracle.record / oracle.cost
    curves["cost_coverage"] = TradeCurves(points, record)
    return tables, curves


def _table(ways: Mapping[str, Sequence[Ended]]) -> Table:
    """A row for each run; ways and endings by their numbers, of which the result has the names.

    Without the true ratios where some run has none, as where the true system has another structure.
    """
    rows = [(way, run) for way, ended in enumerate(ways.values()) for run in ended]

    def column(values: Sequence[float]) -> np.ndarray:
        return np.array(values, dtype=float)

    ratios = [run.ratio for _, run in rows if run.ratio is not None]
    return Table(
        {
            "way": column([way for way, _ in rows]),
            "samples": column([run.samples for _, run in rows]),
            "energy": column([run.energy for _, run in rows]),
            **({"true_ratio": column(ratios)} if len(ratios) == len(rows) else {}),
            "status": column([_ENDINGS.index(run.status) for _, run in rows]),
        }
    )
