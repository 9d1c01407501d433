"""Spec -> a regression with neglected terms, and the least error that its moments buy."""

from __future__ import annotations

from functools import partial

import numpy as np

from inputdesign_cli.design.regression import Regression
from inputdesign_cli.errors import bad_spec, refuse
from inputdesign_cli.monte_carlo.regression import Contender
from inputdesign_cli.questions.building.demand import check_record
from inputdesign_cli.questions.building.header import build_header
from inputdesign_cli.questions.regression.outcome import RegressionTerms
from inputdesign_cli.questions.regression.regressors import RegressorSettings
from inputdesign_cli.questions.regression.solve import KEY, RegressionTask, RegressionTrial, TrueNoise
from inputdesign_cli.specification import Noise, SimulationNoise, Spec

# Toeplitz designs take long to prove; a gap that is asked for explicitly holds instead.
_STRUCTURED_TOLERANCE = 1e-6
_SIGNAL_KEYS = (
    *("type", "phases", "hold", "lines", "amplitudes", "offset", "ramp", "bits", "quantisation"),
    *("scale", "also", "candidates"),
)

_refuse = partial(refuse, who="a regression design")


def build_regression_task(spec: Spec) -> RegressionTask:
    """The task, with all that can be wrong with it already complained of.

    Raises:
        SpecError: the spec asks for what a regression design does not do.
    """
    error, plant = spec.accuracy.mean_squared_error, spec.plant
    assert plant.kind == "regression"
    if error is None:
        raise bad_spec(
            "missing-key",
            "nothing is asked of the regression",
            hint="add accuracy: {mean_squared_error: {target: 1.0, estimated: [..], neglected_norm: 1.0}}",
            key="accuracy",
        )
    _check_supported(spec)
    check_record(spec, plant.inputs)
    if not any(error.estimated):
        raise bad_spec(
            "zero-weights",
            "all weights of the estimated parameters are zero: no experiment tells anything of the quantity",
            hint="give at least one of them a weight other than 0",
            key=f"{KEY}.estimated",
        )
    spectrum, signal, solver = spec.spectrum, spec.signal, spec.solver
    terms = RegressionTerms(
        header=build_header(spec),
        regression=Regression(
            estimated=np.array(error.estimated, dtype=float),
            neglected=np.array(error.neglected or (0.0,) * plant.regression.neglected, dtype=float),
            neglected_norm=error.neglected_norm,
            variance=float(spec.noise.covariance(1)[0, 0]),
        ),
        toeplitz=spectrum is not None and spectrum.type == "moments" and spectrum.structure == "toeplitz",
        samples=spec.experiment.samples,
        target=error.target,
        energy=spec.limits.energy if error.target is None else None,
    )
    seed = signal.seed or 0
    return RegressionTask(
        terms=terms,
        alternating=solver.method == "alternating",
        tolerance=solver.tolerance if "tolerance" in solver.model_fields_set else _STRUCTURED_TOLERANCE,
        seed=seed,
        signal=RegressorSettings(spec.signal_samples, signal.periods, signal.start or "steady", seed),
        trial=_trial(spec),
    )


def _trial(spec: Spec) -> RegressionTrial | None:
    simulation = spec.simulation
    true = None if simulation is None else simulation.plant
    if simulation is None or true is None or true.kind != "parameters":
        return None
    contenders: list[Contender] = []
    for name in simulation.compare:
        if name not in ("white", "binary"):
            raise bad_spec(
                "not-supported",
                f"{name} inputs are not available for regressions",
                hint="compare with white or binary",
                key="simulation.compare",
            )
        contenders.append(name)
    noise = None
    if simulation.noise is not None:
        _refuse_coloured(simulation.noise, "simulation.noise")
        variance = simulation.noise.variance
        noise = TrueNoise(
            variance=None if variance is None else float(np.ravel(np.asarray(variance, dtype=float))[0]),
            relative_std=simulation.noise.relative_std,
        )
    theta = np.array(true.parameters, dtype=float)
    return RegressionTrial(theta, simulation.runs, simulation.seed, tuple(contenders), noise)


def _refuse_coloured(noise: Noise | SimulationNoise, key: str) -> None:
    """The theory is that of white noise."""
    for name, polynomial in (("C", noise.C), ("D", noise.D)):
        if np.ravel(polynomial).tolist() != [1.0]:
            raise bad_spec(
                "not-supported",
                "a regression design takes white noise",
                hint=f"remove {key}.{name}; filter regressors and output with its inverse beforehand",
                key=f"{key}.{name}",
            )


def _check_supported(spec: Spec) -> None:
    """Say plainly what is not done for regressions, rather than ignore it."""
    _refuse_coloured(spec.noise, "noise")
    if "cost" in spec.model_fields_set:
        raise _refuse("cost", what="weigh powers", hint="remove it: what counts is the energy, trace R")
    if spec.goal == "shortest_experiment":
        hint = "use least_cost or best_accuracy"
        raise _refuse("objective", what="look for the shortest experiment", hint=hint)
    if spec.closed_loop:
        raise _refuse("experiment.controller", what="run in closed loop", hint="remove the controller")
    if spec.experiment.prior is not None:
        raise _refuse("experiment.prior", what="use prior information", hint="remove it")
    for name, stated in spec.limits:
        if name != "energy" and stated is not None:
            hint = "remove it, or use limits.energy"
            raise _refuse(f"limits.{name}", what=f"enforce limits.{name}", hint=hint)
    error = spec.accuracy.mean_squared_error
    if spec.limits.energy is not None and error is not None and error.target is not None:
        hint = "remove it: the least energy for the target is found; or remove the target"
        raise _refuse("limits.energy", what="enforce limits.energy beside a target", hint=hint)
    if spec.report.ellipses is not None:
        raise _refuse("report.ellipses", what="draw ellipses", hint="remove report")
    if spec.solver.method == "lmi":
        hint = "use exchange (the default) or alternating"
        raise _refuse("solver.method", what="have a grid program", hint=hint)
    for name in spec.signal.stated(*_SIGNAL_KEYS):
        hint = "remove it; samples, periods, seed and start count"
        raise _refuse(f"signal.{name}", what=f"apply signal.{name}", hint=hint)
