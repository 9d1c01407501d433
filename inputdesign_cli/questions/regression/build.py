"""Build the question of a regression with neglected terms from its spec."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import get_args

import numpy as np

from inputdesign_cli.design.regression.model import Regression
from inputdesign_cli.errors import bad_spec, refuse
from inputdesign_cli.monte_carlo.regression import Contender
from inputdesign_cli.questions.building.demand import check_record
from inputdesign_cli.questions.building.header import build_header
from inputdesign_cli.questions.building.unhandled import ONE_PLANT, check_compared, refuse_unhandled
from inputdesign_cli.questions.regression.solve import KEY, RegressionTask
from inputdesign_cli.specification import Simulation, Spec

# Toeplitz designs take long to prove, hence this default; a stated tolerance replaces it.
_STRUCTURED_TOLERANCE = 1e-6
_ROUNDING = 1e-9
_SIGNAL_KEYS = [
    f"signal.{name}"
    for name in (
        *("type", "phases", "hold", "lines", "amplitudes", "offset", "ramp", "bits", "quantisation"),
        *("scale", "also", "candidates"),
    )
]

_refuse = partial(refuse, who="a regression design")


def build_regression_task(spec: Spec) -> RegressionTask:
    """Return the task; everything that can be wrong with its spec is reported here."""
    error, plant = spec.accuracy.mean_squared_error, spec.plant
    assert plant.kind == "regression"
    assert error is not None
    _check_supported(spec)
    check_record(spec, plant.inputs)
    if not any(error.estimated):
        message = "all weights of the estimated parameters are zero: no experiment changes the quantity"
        hint = "give at least one of them a weight other than 0"
        raise bad_spec("zero-weights", message, hint=hint, key=f"{KEY}.estimated")
    spectrum, signal, solver = spec.spectrum, spec.signal, spec.solver
    simulation = spec.simulation or Simulation()
    check_compared(simulation.compare, *get_args(Contender))
    true, noise = simulation.plant, simulation.noise or spec.noise
    known: dict[str, Contender] = {name: name for name in get_args(Contender)}
    regression = Regression(
        estimated=np.array(error.estimated, dtype=float),
        neglected=np.array(error.neglected or (0.0,) * plant.regression.neglected, dtype=float),
        neglected_norm=error.neglected_norm,
        variance=float(spec.noise.covariance(1)[0, 0]),
    )
    variance = float(noise.covariance(1)[0, 0])
    toeplitz = spectrum is not None and spectrum.type == "moments" and spectrum.structure == "toeplitz"
    stated = "tolerance" in solver.model_fields_set
    return RegressionTask(
        header=build_header(spec),
        regression=regression,
        toeplitz=toeplitz,
        samples=spec.experiment.samples,
        target=error.target,
        energy=spec.limits.energy if error.target is None else None,
        alternating=solver.method == "alternating",
        tolerance=_ROUNDING if not toeplitz else solver.tolerance if stated else _STRUCTURED_TOLERANCE,
        record_samples=spec.signal_samples,
        periods=signal.periods,
        start=signal.start or "steady",
        seed=signal.seed or 0,
        theta=None if true is None or true.kind != "parameters" else np.array(true.parameters, dtype=float),
        true=replace(regression, variance=variance),
        relative_std=None if simulation.noise is None else simulation.noise.relative_std,
        compare=tuple(known[name] for name in simulation.compare),
        runs=simulation.runs,
        trial_seed=simulation.seed,
    )


def _check_supported(spec: Spec) -> None:
    """Refuse keys that are not supported for regressions, rather than ignore them."""
    if "cost" in spec.model_fields_set:
        raise _refuse("cost", what="weigh powers", hint="remove it: what counts is the energy, trace R")
    if spec.goal == "shortest_experiment":
        hint = "remove it: a target asks for the least energy, limits.energy for the best accuracy"
        raise _refuse("objective", what="look for the shortest experiment", hint=hint)
    if spec.at("accuracy", "mean_squared_error", "target") is not None and spec.limits.energy is not None:
        hint = "remove it: the least energy for the target is found; or remove the target"
        raise _refuse("limits.energy", what="enforce limits.energy beside a target", hint=hint)
    limits = [f"limits.{name}" for name, _ in spec.limits if name != "energy"]
    remedies = {
        "experiment.controller": "remove the controller",
        "experiment.prior": "remove it",
        **dict.fromkeys(limits, "remove it, or use limits.energy"),
        "report.ellipses": "remove report",
        "uncertainty": ONE_PLANT,
        "solver.method": "use exchange (the default) or alternating",
        **dict.fromkeys(_SIGNAL_KEYS, "remove it; samples, periods, seed and start count"),
    }
    refuse_unhandled(spec, "a regression design", remedies, {"solver.method": ("exchange", "alternating")})
