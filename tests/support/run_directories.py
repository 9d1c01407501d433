"""Small runs that tell which they are."""

import numpy as np

from inputdesign_cli.outcome.curves import OptimalityCurves, SignalCurves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.run_directory import write_run
from tests.support.outcomes import typed


def a_run(mark: str, *, optimality: bool = False) -> Results:
    """A small run whose every file tells which run it is of."""
    number = float(len(mark))
    curves = {"signal": SignalCurves(np.arange(4.0), {"u1": np.array([1.0, -1.0, 1.0, -1.0]) * number})}
    tables = {"signal": Table({"time_s": np.arange(4.0), "u1": np.full(4, number)})}
    if optimality:
        w = np.array([0.1, 1.0, 3.0])
        curves["optimality"] = OptimalityCurves(w, np.array([0.5, 1.0, 0.5]), np.array([1.0]))
        tables["optimality"] = Table({"frequency_rad_per_s": w, "ratio": curves["optimality"].ratio})
    return Results(
        typed({"format": 1, "title": mark, "objective": {"kind": "least_cost", "value": np.float64(number)}}),
        resolved_spec=f"title: {mark}\n",
        tables=tables,
        curves=curves,
    )


def write_with_figures(results, directory):
    """A run with what passes for figures."""
    return write_run(results, directory, {f"{stem}.png": b"drawn" for stem in results.curves})


def marks(directory) -> set[str]:
    """Which runs the text files of a directory are of."""
    found = set()
    for name in ("spec.yaml", "result.json", "signal.csv"):
        if (directory / name).exists():
            text = (directory / name).read_text()
            found |= {mark for mark in ("first", "second") if mark in text or f",{len(mark)}\n" in text}
    return found


def names(directory) -> set[str]:
    return {path.name for path in directory.iterdir()}
