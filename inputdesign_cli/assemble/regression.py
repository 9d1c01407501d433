"""Spec -> moments of the regressors that give the least mean-squared error -> outcome."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from inputdesign_cli.assemble.regressors import RegressorRecord, realise_regressors
from inputdesign_cli.design.mse import (
    ErrorSplit,
    OutOfReachError,
    Regression,
    ToeplitzDesign,
    design_toeplitz,
    energy_bound,
    energy_sensitivity,
    error_bound,
    error_sensitivity,
    least_energy,
    least_error,
)
from inputdesign_cli.design.mse.alternating import alternate
from inputdesign_cli.design.mse.limits import SMALLEST_EIGENVALUE
from inputdesign_cli.errors import Complaint, InaccurateError, InfeasibleError
from inputdesign_cli.outcome import ErrorCurves, MomentsCurves, Outcome, SignalCurves, Table
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spec import MomentsSpectrum, Spec
from inputdesign_cli.spec.experiment import NoiseShape
from inputdesign_cli.spec.plant import RegressionPlant

_KEY = "accuracy.mean_squared_error"
_STRUCTURED_TOLERANCE = 1e-6
_POINTS = 400


@dataclass(frozen=True)
class RegressionTask:
    """A spec in the words of the mathematics. Exactly one of `target` and `energy` is given."""

    regression: Regression
    toeplitz: bool
    samples: int
    target: float | None
    energy: float | None

    @property
    def kind(self) -> str:
        """What `objective.kind` says."""
        return "least_cost" if self.target is not None else "mean_squared_error"


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


def build_regression(spec: Spec) -> RegressionTask:
    """Everything that can be wrong with the spec comes to light here."""
    error, plant = spec.accuracy.mean_squared_error, spec.plant
    assert isinstance(plant, RegressionPlant)
    if error is None:
        raise spec.complain(
            "missing-key",
            "nothing is asked of the regression",
            hint="add accuracy: {mean_squared_error: {target: 1.0, estimated: [..], neglected_norm: 1.0}}",
            key="accuracy",
        )
    _check_supported(spec)
    if not any(error.estimated):
        raise spec.complain(
            "zero-weights",
            "all weights of the estimated parameters are zero: no experiment tells anything of the quantity",
            hint="give at least one of them a weight other than 0",
            key=f"{_KEY}.estimated",
        )
    neglected = error.neglected or (0.0,) * plant.regression.neglected
    spectrum = spec.spectrum
    return RegressionTask(
        regression=Regression(
            estimated=np.array(error.estimated, dtype=float),
            neglected=np.array(neglected, dtype=float),
            neglected_norm=error.neglected_norm,
            variance=float(spec.noise.covariance(1)[0, 0]),
        ),
        toeplitz=isinstance(spectrum, MomentsSpectrum) and spectrum.structure == "toeplitz",
        samples=spec.experiment.samples,
        target=error.target,
        energy=spec.limits.energy if error.target is None else None,
    )


@dataclass(frozen=True)
class RegressionRun:
    """A design with its regressors, for the study, and its outcome."""

    task: RegressionTask
    design: MomentsDesign
    record: RegressorRecord | None
    outcome: Outcome


def solve_regression(spec: Spec) -> Outcome:
    """The design, its proof, its signal and its curves."""
    return run_regression(spec).outcome


def run_regression(spec: Spec) -> RegressionRun:
    """The design and all that comes with it.

    Raises:
        SpecError: the spec asks for what a regression design does not do.
        InfeasibleError: `target-out-of-reach`.
        InaccurateError: `target-undecided`.
    """
    started = time.perf_counter()
    task = build_regression(spec)
    design = _toeplitz(spec, task) if task.toeplitz else _free(task)
    solved = time.perf_counter()
    record = realise_regressors(spec, task.regression, design.R, design.rho, task.target)
    result = _result(spec, task, design)
    if record is not None:
        result["signal"] = record.entry
    result["timing_s"] = {"design": solved - started, "signal": time.perf_counter() - solved}
    tables: dict[str, Table] = {}
    curves: dict[str, Any] = {
        "error": _error_curves(task, design),
        "moments": MomentsCurves(design.R, task.regression.m),
    }
    if record is not None:
        _add_signal(spec, record, tables, curves)
    outcome = Outcome(result, spec.to_yaml(), spec.time_unit, tables, curves)
    return RegressionRun(task, design, record, outcome)


def _free(task: RegressionTask) -> MomentsDesign:
    regression = task.regression
    if task.target is not None:
        R = least_energy(regression, task.target)
        bound = energy_bound(regression, task.target, R)
    else:
        assert task.energy is not None
        R = least_error(regression, task.energy)
        bound = error_bound(regression, task.energy)
    return MomentsDesign(R, None, regression.error(R), bound, {"method": "closed_form"})


def _toeplitz(spec: Spec, task: RegressionTask) -> MomentsDesign:
    tolerance = _tolerance(spec)
    method = "alternating" if spec.solver.method == "alternating" else "sequential_convex"
    try:
        found: ToeplitzDesign = design_toeplitz(
            task.regression,
            target=task.target,
            energy=task.energy,
            tolerance=tolerance,
            rng=np.random.default_rng(spec.signal.seed or 0),
            search=alternate if method == "alternating" else None,
        )
    except OutOfReachError as error:
        raise _infeasible(task, error) from error
    search = {
        "method": method,
        "starts": found.starts,
        "solves": found.solves,
        "nodes": found.nodes,
        "tolerance": tolerance,
    }
    if found.assumed:
        search["assumed_smallest_eigenvalue"] = found.assumed
    return MomentsDesign(found.R, found.rho, found.split, found.bound, search)


def _tolerance(spec: Spec) -> float:
    return spec.solver.tolerance if "tolerance" in spec.solver.model_fields_set else _STRUCTURED_TOLERANCE


def _infeasible(task: RegressionTask, error: OutOfReachError) -> InfeasibleError | InaccurateError:
    regression, target = task.regression, task.target
    assert target is not None
    bias = error.bias * float(np.linalg.norm(regression.estimated))
    alpha = regression.neglected_norm
    smallest, largest = alpha**2 * bias**2, float(np.sqrt(target)) / bias
    hint = (
        f"a target above {smallest:.7g} can be met, or neglected_norm below {largest:.7g}; "
        "or estimate more parameters"
    )
    if not error.reach:
        message = (
            f"no Toeplitz moments were found that reach a mean-squared error of {target:.7g} (the least "
            f"biased ones leave {smallest:.7g} at any energy), nor was it proved that there are none"
        )
        return InaccurateError(Complaint("target-undecided", message, hint=hint, key=f"{_KEY}.target"))
    energy = (
        error.reach * regression.n * regression.variance * float(np.sum(regression.estimated**2)) / target
    )
    proof = f"proved for every energy up to {energy:.3g}"
    if error.assumed:
        proof += f" and R11 / r_0 with eigenvalues above {SMALLEST_EIGENVALUE:g}"
    message = (
        f"no Toeplitz moments reach a mean-squared error of {target:.7g} ({proof}): the bias alone "
        f"leaves {smallest:.7g}"
    )
    return InfeasibleError(Complaint("target-out-of-reach", message, hint=hint, key=f"{_KEY}.target"))


def _result(spec: Spec, task: RegressionTask, design: MomentsDesign) -> dict[str, Any]:
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


def _error_curves(task: RegressionTask, design: MomentsDesign) -> ErrorCurves:
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


def _add_signal(
    spec: Spec, record: RegressorRecord, tables: dict[str, Table], curves: dict[str, Any]
) -> None:
    channels = {f"u{i + 1}": column for i, column in enumerate(record.channels.T)}
    time_axis = spec.sample_time * np.arange(record.channels.shape[0], dtype=np.float64)
    tables["signal"] = Table({f"time_{spec.time_unit}": time_axis, **channels})
    curves["signal"] = SignalCurves(time_axis, channels)
    if record.line_frequency is not None and record.line_power is not None:
        frequency = record.line_frequency / spec.sample_time
        header = f"frequency_rad_per_{spec.time_unit}"
        tables["spectrum"] = Table({header: frequency, "line_power": record.line_power})
        curves["moments"] = replace(
            curves["moments"],
            line_frequency=frequency,
            line_power=record.line_power,
            nyquist=spec.nyquist,
        )


_SIGNAL_KEYS = (
    *("type", "phases", "hold", "lines", "amplitudes", "offset", "ramp", "bits", "candidates"),
    *("quantisation", "scale", "also"),
)


def refuse_coloured(spec: Spec, noise: NoiseShape, key: str) -> None:
    """The theory is that of white noise."""
    for name in ("C", "D"):
        if np.ravel(getattr(noise, name)).tolist() != [1.0]:
            raise spec.complain(
                "not-supported",
                "a regression design takes white noise",
                hint=f"remove {key}.{name}; filter regressors and output with its inverse beforehand",
                key=f"{key}.{name}",
            )


def _check_supported(spec: Spec) -> None:
    """Say plainly what is not done for regressions, rather than ignore it."""

    def refuse(key: str, what: str, hint: str) -> Exception:
        return spec.complain("not-supported", f"a regression design does not {what}", hint=hint, key=key)

    refuse_coloured(spec, spec.noise, "noise")
    if "cost" in spec.model_fields_set:
        raise refuse("cost", "weigh powers", "remove it: what counts is the energy, trace R")
    if spec.goal == "shortest_experiment":
        raise refuse("objective", "look for the shortest experiment", "use least_cost or best_accuracy")
    if spec.closed_loop:
        raise refuse("experiment.controller", "run in closed loop", "remove the controller")
    if spec.experiment.prior is not None:
        raise refuse("experiment.prior", "use prior information", "remove it")
    for name in type(spec.limits).model_fields:
        if name != "energy" and getattr(spec.limits, name) is not None:
            raise refuse(f"limits.{name}", f"enforce limits.{name}", "remove it, or use limits.energy")
    error = spec.accuracy.mean_squared_error
    if spec.limits.energy is not None and error is not None and error.target is not None:
        raise refuse(
            "limits.energy",
            "enforce limits.energy beside a target",
            "remove it: the least energy for the target is found; or remove the target",
        )
    if spec.report.ellipses is not None:
        raise refuse("report.ellipses", "draw ellipses", "remove report")
    if spec.solver.method == "lmi":
        raise refuse("solver.method", "have a grid program", "use exchange (the default) or alternating")
    for name in _SIGNAL_KEYS:
        if getattr(spec.signal, name) is not None:
            raise refuse(
                f"signal.{name}", f"apply signal.{name}", "remove it; samples, periods, seed and start count"
            )
