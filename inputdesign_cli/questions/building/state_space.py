"""Spec -> a state-space model: its matrices, and which of their entries are expressions."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.plant import Matrices, StateSpaceModel
from inputdesign_cli.plant.model import DELAY
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.plant import StateSpacePlant

# This far outside the unit circle a pole is there by rounding.
_ROUNDING = 1e-9


def state_space_model(spec: Spec, plant: StateSpacePlant, covariance: Array) -> StateSpaceModel:
    """The model at the nominal parameters.

    Raises:
        SpecError: `unstable-polynomial` for a predictor, or a plant without a controller, that is unstable;
            `conflicting-keys` for K beside coloured noise.
    """
    stated = plant.state_space
    n, r, p = len(stated.A), plant.inputs, plant.outputs
    given = {
        "A": np.array(stated.A),
        "B": np.array(stated.B),
        "C": np.array(stated.C),
        "D": np.zeros((p, r)) if stated.D is None else np.array(stated.D),
        "K": np.zeros((n, p)) if stated.K is None else np.array(stated.K),
    }
    written = [(letter, M.shape) for letter, M in given.items() if letter in plant.stated_matrices]
    places = [(letter, i, j) for letter, shape in written for i, j in np.ndindex(shape)]
    free = [place for place in (*places, (DELAY, 0, 0)) if plant.term(*place).names]
    model = StateSpaceModel(
        Matrices(**given, delay=stated.delay),
        tuple(free),
        covariance,
        spec.sample_time if plant.sample is not None else None,
    )
    _check(spec, plant, model)
    return model


def _check(spec: Spec, plant: StateSpacePlant, model: StateSpaceModel) -> None:
    key = "plant.state_space"
    coloured = any(spec.noise.drifts) or any(len(np.ravel(x)) > 1 for x in (spec.noise.C, spec.noise.D))
    if plant.state_space.K is not None and coloured:
        raise spec.complain(
            "conflicting-keys",
            "K says how the noise is coloured, and noise does so, too",
            hint="remove K, or C, D and drift",
            key=f"{key}.K",
        )
    away = np.abs(model.predictor_poles[:, None] - model.poles).min(axis=1, initial=np.inf)
    own = model.predictor_poles[away > np.sqrt(_ROUNDING)]  # those that K makes
    worst = float(np.max(np.abs(model.predictor_poles), initial=0.0))
    if worst > 1.0 + _ROUNDING or np.any(np.abs(own) > 1.0 - _ROUNDING):
        what = "A - K C" if plant.state_space.K is not None else "A"
        raise spec.complain(
            "unstable-polynomial",
            f"the predictor is unstable: {what}, sampled, has an eigenvalue of radius {worst:.6g}",
            hint="check the signs of A; an unstable plant needs a gain K with which A - K C is stable",
            key=f"{key}.A",
        )
    worst = float(np.max(np.abs(model.poles), initial=0.0))
    if worst > 1.0 + _ROUNDING and not spec.closed_loop:
        raise spec.complain(
            "unstable-polynomial",
            f"the plant is unstable: A, sampled, has an eigenvalue of radius {worst:.6g}",
            hint="check the signs of A; an unstable plant needs a loop: add experiment.controller",
            key=f"{key}.A",
        )
