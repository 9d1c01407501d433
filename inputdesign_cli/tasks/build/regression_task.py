"""Spec -> a regression with neglected terms in the words of the mathematics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.design.regression import Regression
from inputdesign_cli.specification import MomentsSpectrum, Spec
from inputdesign_cli.specification.models.experiment import NoiseShape
from inputdesign_cli.specification.models.plant import RegressionPlant

KEY = "accuracy.mean_squared_error"
_SIGNAL_KEYS = (
    *("type", "phases", "hold", "lines", "amplitudes", "offset", "ramp", "bits", "candidates"),
    *("quantisation", "scale", "also"),
)


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
            key=f"{KEY}.estimated",
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
