"""A design of moments -> `result.json` and the curves of its error."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from inputdesign_cli.design.regression import (
    ErrorSplit,
    energy_bound,
    energy_sensitivity,
    error_bound,
    error_sensitivity,
    least_energy,
)
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import ErrorCurves
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.regression_task import RegressionTask

_POINTS = 400


@dataclass(frozen=True)
class MomentsDesign:
    """R with what is proved of it; `search` is what result.json says under `solver`."""

    R: Array
    rho: Array | None
    split: ErrorSplit
    bound: float
    search: dict[str, Any]

    @property
    def energy(self) -> float:
        """trace R."""
        return float(np.trace(self.R))


def moments_result(spec: Spec, task: RegressionTask, design: MomentsDesign) -> dict[str, Any]:
    regression, split = task.regression, design.split
    least = task.target is not None
    value = design.energy if least else split.total
    gap = abs(value - design.bound) / value
    if least:
        assert task.target is not None
        sensitivity = energy_sensitivity(regression, design.energy, task.target, split)
    else:
        sensitivity = error_sensitivity(regression, design.energy, split)
    error: dict[str, Any] = {"value": split.total, **asdict(split)}
    if task.target is not None:
        error["target"] = task.target
    return {
        "format": 1,
        "title": spec.title,
        "status": _status(gap, design.search.get("tolerance", 1e-9)),
        "objective": {
            "kind": task.kind,
            "value": value,
            "lower_bound": design.bound,
            "relative_gap": gap,
            "any_structure_bound": _any_structure(task) if task.toeplitz else design.bound,
        },
        "cost": design.energy,
        "samples": task.samples,
        "mean_squared_error": error,
        "moments": _moments(task, design),
        "sensitivity": {
            "of": "energy" if least else "mean_squared_error",
            "neglected_norm": sensitivity.neglected_norm,
            "target" if least else "energy": sensitivity.goal,
            "noise_deviation": sensitivity.noise_deviation,
        },
        "baseline": {"white": entry} if (entry := _white(task, value)) else {},
        "solver": design.search,
    }


def _status(gap: float, tolerance: float) -> str:
    if gap <= tolerance * (1.0 + 1e-6):
        return "optimal"
    return "almost_optimal" if gap <= 100.0 * tolerance else "gap_open"


def _moments(task: RegressionTask, design: MomentsDesign) -> dict[str, Any]:
    R, m, n = design.R, task.regression.m, task.regression.n
    moments: dict[str, Any] = {
        "structure": "toeplitz" if task.toeplitz else "free",
        "estimated": m,
        "trace": design.energy,
        "R": R,
        "entries": {f"R_{i + 1}_{j + 1}": R[i, j] for i in range(n) for j in range(i, n)},
    }
    if design.rho is not None:
        moments["autocorrelations"] = design.rho
    return moments


def _any_structure(task: RegressionTask) -> float:
    """What no R does better, whatever its structure."""
    if task.target is not None:
        return energy_bound(task.regression, task.target, least_energy(task.regression, task.target))
    assert task.energy is not None
    return error_bound(task.regression, task.energy)


def _white(task: RegressionTask, value: float) -> dict[str, Any]:
    """White regressors: the energy that they need for the target (if they can), or their error."""
    regression = task.regression
    unit = regression.error(np.eye(regression.n))
    if task.target is None:
        assert task.energy is not None
        error = regression.error(np.eye(regression.n) * (task.energy / regression.n)).total
        return {"mean_squared_error": error, "ratio": error / value}
    slack = task.target - unit.bias_squared
    if slack <= 0.0:
        return {}
    energy = regression.n * unit.variance / slack
    return {"cost": energy, "ratio": energy / value}


def error_curves(task: RegressionTask, design: MomentsDesign) -> ErrorCurves:
    """Squared bias and variance of the design's shape over the energy, and those of white regressors."""
    regression = task.regression
    energy = design.energy * np.geomspace(0.1, 10.0, _POINTS)
    white = regression.error(np.eye(regression.n) / regression.n)
    return ErrorCurves(
        energy=energy,
        bias_squared=np.full(_POINTS, design.split.bias_squared),
        variance=design.split.variance * design.energy / energy,
        white=white.bias_squared + white.variance / energy,
        design=(design.energy, design.split.total),
        target=task.target,
    )
