"""Build the plant of a closed-loop error: polynomials that a law inverts, and the estimated model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.arrays import Array, Rows
from inputdesign_cli.design.loop_error import MatrixPlant
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.plant import Model, PolynomialModel
from inputdesign_cli.plant.polynomial import join_roots, roots_in_z
from inputdesign_cli.questions.building.demand import check_effects, check_model
from inputdesign_cli.questions.building.system import (
    bare_experiment,
    build_model,
    held_plant,
    per_output,
    polynomial_model,
    state_space_model,
)
from inputdesign_cli.specification import Noise, SimulationNoise, Spec
from inputdesign_cli.specification.models.plant import PolynomialPlant, StateSpacePlant, TruePlant
from inputdesign_cli.specification.transfer_of_states import transfer_functions

# A pole this near to z = 1, or this near to the unit circle.
_INTEGRATES = 1e-7


def estimated_model(spec: Spec) -> Model | None:
    """Return the model in the estimated parameters; None if they are all coefficients of a plant in q^-1.

    Raises:
        SpecError: `nothing-to-estimate` where the plant is known; see `build_model`, `check_model` and
            `check_effects`.
    """
    model = build_model(spec)
    check_model(spec, model)
    if not np.any(model.in_plant):
        raise spec.complain(
            "nothing-to-estimate",
            "every parameter of the plant is known: the loop loses nothing by its model, whatever the input",
            hint="take those out of known that the experiment is to find",
            key="plant.known",
        )
    check_effects(spec, bare_experiment(spec, model))
    match spec.plant:
        case PolynomialPlant(parameters=None, known=None) if not spec.noise.known:
            return None
    return model


def matrix_plant(spec: Spec, plant: TruePlant, noise: Noise | SimulationNoise, key: str) -> MatrixPlant:
    """Return the matrix of polynomials of `plant` or of the true system `simulation.plant`.

    Raises:
        SpecError: `not-supported`; `inaccurate-conversion` of states.
    """
    if noise.variance is None:
        raise bad_spec(
            "not-supported",
            "this version takes the noise of this simulation as a variance",
            hint="write variance in place of relative_std",
            key="simulation.noise",
        )
    drifting = [d for d in per_output(noise.D) if np.any(np.abs(roots_in_z(d)) > 1.0 - _INTEGRATES)]
    if any(noise.drifts) or drifting:
        raise bad_spec(
            "not-supported",
            "closed_loop_error is the mean square of a loop whose noise is stationary, and noise that drifts "
            "is not",
            hint="write a root of D inside the unit circle, or state the accuracy as model_error",
            key="noise.D" if drifting else "noise.drift",
        )
    if plant.kind == "continuous" and plant.sampled:
        plant = held_plant(plant, spec.sample_time)
    if plant.kind == "state_space":
        channels = _of_states(spec, plant, noise, key)
    elif plant.kind == "polynomial":
        channels = polynomial_model(plant, noise, noise.covariance(plant.outputs))
    else:
        raise bad_spec(
            "not-supported",
            "this version designs for the closed-loop error of sampled plants only",
            hint="add sample: zoh to a continuous-time plant",
            key=key,
        )
    made = MatrixPlant.of(channels)
    poles = join_roots(roots_in_z(part) for part in (*made.A, *(f for row in made.F for f in row)))
    if np.any(np.abs(poles - 1.0) < _INTEGRATES):
        raise bad_spec(
            "not-supported",
            "closed_loop_error takes an experiment in open loop with stationary outputs, and the outputs of "
            "a plant that integrates are not",
            hint="move the pole into the unit circle, or state the accuracy as model_error",
            key=key,
        )
    return made


def _of_states(
    spec: Spec, plant: StateSpacePlant, noise: Noise | SimulationNoise, key: str
) -> PolynomialModel:
    """Return a model with G entry by entry, and H by the gain K or by C and D."""
    model = state_space_model(spec, plant, noise.covariance(plant.outputs))
    C, D = per_output(noise.C), per_output(noise.D)
    step = model.sample_time or 0.0
    # Whole samples of the dead time need no states.
    late = model.matrices._replace(delay=model.matrices.delay - model.lag * step)
    B, F = _in_delays(*replace(model, matrices=late).realisation, lag=model.lag)
    if np.any(model.matrices.K):
        identity = np.eye(model.outputs)
        above, below = _in_delays(model.held[0], model.matrices.K, model.matrices.C, identity, lag=0)
        if any(np.any(entry) for i, row in enumerate(above) for j, entry in enumerate(row) if i != j):
            raise bad_spec(
                "not-supported",
                "this version designs for the closed-loop error of outputs with noise of their own, and K "
                "takes that of one to others",
                hint="write C and D of the noise in place of K",
                key=f"{key}.state_space.K",
            )
        C, D = (tuple(rows[i][i] for i in range(model.outputs)) for rows in (above, below))
    return PolynomialModel(B, (np.ones(1),), F, C, D, model.covariance)


def _in_delays(A: Array, B: Array, C: Array, D: Array, *, lag: int) -> tuple[Rows, Rows]:
    """Return numerators and monic denominators in q^-1 of a system in states, delayed by `lag` samples."""
    above, below = [], []
    for row in transfer_functions(A, B, C, D, discrete=True):
        # Excess poles are samples of delay; a zero is one coefficient.
        above.append(tuple(np.append(np.zeros(lag + len(den) - len(num)), num) for num, den in row))
        below.append(tuple(np.array(den) for _, den in row))
    return tuple(above), tuple(below)
