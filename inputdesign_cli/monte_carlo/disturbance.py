"""What an excitation alone does to the loop."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.runs.results import SignalCurves, Table
from inputdesign_cli.specification import Spec

# Time constants of the loop that a figure shows after the end of the excitation.
_FADED = 3.0


@dataclass(frozen=True)
class Response:
    """A loop driven by r: `caused` maps r (n, r) to u (n, r) and y (n, p) from rest; `poles` in z."""

    caused: Callable[[Array], tuple[Array, Array]]
    poles: ComplexArray


def disturbance(spec: Spec, loop: Response, excitation: Array) -> tuple[Table, SignalCurves]:
    """r, u_r and y_r of an excitation (n,) or (n, r), until they have faded."""
    r = excitation.reshape(len(excitation), -1)
    slowest = float(np.abs(loop.poles).max(initial=0.0))
    tail = min(int(np.ceil(_FADED / (1.0 - slowest))), len(r))
    r = np.concatenate([r, np.zeros((tail, r.shape[1]))])
    u, y = loop.caused(r)
    instants = spec.sample_time * np.arange(len(r), dtype=np.float64)
    single = r.shape[1] == y.shape[1] == 1
    columns, drawn = {}, {}
    for letter, caused, signals in (("r", "", r), ("u", "r", u), ("y", "r", y)):
        for number, samples in enumerate(signals.T, start=1):
            columns[f"{letter}{number}" + (f"_{caused}" if caused else "")] = samples
            drawn[f"{letter}{'' if single else number}{caused}"] = samples
    order = sorted(drawn, key=lambda name: "yur".index(name[0])) if not single else list(drawn)
    shown = {name: drawn[name] for name in order}
    return Table({f"time_{spec.time_unit}": instants, **columns}), SignalCurves(instants, shown)
