"""Build the question of `accuracy.closed_loop_error` from its spec, and check it before it is computed."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Protocol, cast

import numpy as np

from inputdesign_cli.arrays import Array, Rows
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.loop_error.laws import (
    ControlLaw,
    InternalModel,
    MinimumVariance,
    ModelReference,
    check_invertible,
)
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.errors import bad_spec, refuse
from inputdesign_cli.information import POWER_KINDS
from inputdesign_cli.plant import Model, PolynomialModel, Rational, TransferMatrix, hold_entries
from inputdesign_cli.plant.polynomial import all_roots, roots_in_z
from inputdesign_cli.questions.building import system
from inputdesign_cli.questions.building.demand import check_effects, check_model, check_record
from inputdesign_cli.questions.building.header import build_header
from inputdesign_cli.questions.building.signal_settings import build_bounds
from inputdesign_cli.questions.building.spectra import build_power_limits, implied_limits
from inputdesign_cli.questions.building.unhandled import ONE_PLANT, check_compared, refuse_unhandled
from inputdesign_cli.questions.building.weights import held, rational
from inputdesign_cli.questions.loop_error.solve import KEY, LoopErrorTask
from inputdesign_cli.specification import ClosedLoopError, Noise, Simulation, SimulationNoise, Spec
from inputdesign_cli.specification.models.plant import PolynomialPlant, StateSpacePlant, TruePlant
from inputdesign_cli.specification.models.transfer import Transfer
from inputdesign_cli.specification.plugins import added
from inputdesign_cli.specification.transfer_of_states import transfer_functions

_refuse = partial(refuse, who="a design for the closed-loop error")
_GRID = 512
_CANDIDATES = 20
# A pole this near to z = 1 integrates; a root of D this near to the unit circle makes the noise drift.
_INTEGRATES = 1e-7


def estimated_model(spec: Spec) -> Model | None:
    """Return the model in the estimated parameters, or raise `SpecError` (`nothing-to-estimate`).

    None if they are all coefficients of a plant in q^-1.
    """
    model = system.build_model(spec)
    check_model(spec, model)
    if not np.any(model.in_plant):
        raise spec.complain(
            "nothing-to-estimate",
            "every parameter of the plant is known: the loop loses nothing by its model, whatever the input",
            hint="take those out of known that the experiment is to find",
            key="plant.known",
        )
    check_effects(spec, system.bare_experiment(spec, model))
    match spec.plant:
        case PolynomialPlant(parameters=None, known=None) if not spec.noise.known:
            return None
    return model


def matrix_plant(spec: Spec, plant: TruePlant, noise: Noise | SimulationNoise, key: str) -> MatrixPlant:
    """Return the polynomials of `plant` or of the true system, or raise `SpecError` (`not-supported`)."""
    if noise.variance is None:
        raise _refuse("simulation.noise", "take relative noise", "write variance in place of relative_std")
    drifting = [d for d in system.per_output(noise.D) if np.any(np.abs(roots_in_z(d)) > 1.0 - _INTEGRATES)]
    if any(noise.drifts) or drifting:
        hint = "write a root of D inside the unit circle, or state the accuracy as model_error"
        raise _refuse("noise.D" if drifting else "noise.drift", "take noise that drifts", hint)
    if plant.kind == "continuous" and plant.sampled:
        plant = system.held_plant(plant, spec.sample_time)
    if plant.kind == "state_space":
        channels = _of_states(spec, plant, noise, key)
    elif plant.kind == "polynomial":
        channels = system.polynomial_model(plant, noise, noise.covariance(plant.outputs))
    else:
        raise _refuse(key, "take a plant that is not sampled", "add sample: zoh to a continuous-time plant")
    made = MatrixPlant.of(channels)
    poles = all_roots([*made.A, *(f for row in made.F for f in row)])
    if np.any(np.abs(poles - 1.0) < _INTEGRATES):
        hint = "move the pole into the unit circle, or state the accuracy as model_error"
        raise _refuse(key, "take a plant that integrates, whose outputs are not stationary", hint)
    return made


def _of_states(
    spec: Spec, plant: StateSpacePlant, noise: Noise | SimulationNoise, key: str
) -> PolynomialModel:
    """Return a model with G entry by entry, and H by the gain K or by C and D."""
    model = system.state_space_model(spec, plant, noise.covariance(plant.outputs))
    C, D = system.per_output(noise.C), system.per_output(noise.D)
    step = model.sample_time or 0.0
    # Whole samples of the dead time need no states.
    late = model.matrices._replace(delay=model.matrices.delay - model.lag * step)
    B, F = _in_delays(*replace(model, matrices=late).realisation, lag=model.lag)
    if np.any(model.matrices.K):
        identity = np.eye(model.outputs)
        above, below = _in_delays(model.held[0], model.matrices.K, model.matrices.C, identity, lag=0)
        if any(np.any(entry) for i, row in enumerate(above) for j, entry in enumerate(row) if i != j):
            what, hint = (
                "take noise that K leads to other outputs",
                "write C and D of the noise in place of K",
            )
            raise _refuse(f"{key}.state_space.K", what, hint)
        C, D = (tuple(rows[i][i] for i in range(model.outputs)) for rows in (above, below))
    return PolynomialModel(B, (np.ones(1),), F, C, D, model.covariance)


def _in_delays(A: Array, B: Array, C: Array, D: Array, *, lag: int) -> tuple[Rows, Rows]:
    """Return numerators and monic denominators in q^-1 of a system in states, delayed by `lag` samples."""
    above, below = [], []
    for row in transfer_functions(A, B, C, D, discrete=True):
        # Excess poles are samples of delay; a zero entry has one coefficient.
        above.append(tuple(np.append(np.zeros(lag + len(den) - len(num)), num) for num, den in row))
        below.append(tuple(np.array(den) for _, den in row))
    return tuple(above), tuple(below)


class AddedLaw(Protocol):
    """Describes a section of `control` that another package adds (`specification.plugins`)."""

    def build(self, spec: Spec, plant: MatrixPlant) -> ControlLaw:
        """Return the control law for a plant."""


def build_loop_error_task(spec: Spec) -> LoopErrorTask:
    """Return the task and refuse what cannot be designed; `simulate` reports faults of its section alone."""
    error = spec.accuracy.closed_loop_error
    assert error is not None
    _check_supported(spec)
    plant = matrix_plant(spec, spec.plant, spec.noise, "plant")
    name, law = _law(spec, error, plant, "plant.B")
    check_invertible(plant, key="plant.B")
    law.check(plant, key=f"{KEY}.control.{name}")
    coloured = error.reference.filter
    lo, hi = spec.clip_band(spec.limits.band)
    stated = sorted(build_power_limits(spec), key=lambda one: one.kind == "output")
    problem = LoopErrorProblem(
        plant=plant,
        estimated=estimated_model(spec),
        law=law,
        limits=tuple(
            PowerLimit(
                "input" if one.kind == "excitation" else one.kind,  # in open loop they are the same
                one.bound,
                channel=one.channel or 0 if one.implied else one.channel,
            )
            for one in (*stated, *implied_limits(spec))
        ),
        reference_variance=np.asarray(error.reference.variance) * np.ones(plant.outputs),
        reference_filter=Rational(np.ones(1)) if coloured is None else _transfer(spec, coloured),
        band=(lo * spec.sample_time, min(hi * spec.sample_time, np.pi)),
    )
    signal, spectrum, samples = spec.signal, spec.spectrum, spec.signal_samples
    simulation = spec.simulation or Simulation()
    check_compared(simulation.compare, "white")
    true, key = plant, "simulation.plant"
    if simulation.plant is not None or simulation.noise is not None:
        true = matrix_plant(spec, simulation.plant or spec.plant, simulation.noise or spec.noise, key)
    return LoopErrorTask(
        problem=problem,
        header=build_header(spec),
        law=name,
        covariance=error.covariance,
        samples=spec.experiment.samples,
        tolerance=spec.solver.tolerance,
        cost=system.build_cost(spec),
        grid=spectrum.grid if spectrum is not None and spectrum.type == "pointwise" else _GRID,
        record_samples=samples,
        filtered=signal.type == "filtered_noise",
        # As many periods as inputs, where the record can be split so, make the designed matrix exact.
        periods=signal.periods or (plant.inputs if samples % plant.inputs == 0 else 1),
        order=signal.order,
        candidates=signal.candidates or _CANDIDATES,
        signal_seed=signal.seed or 0,
        bounds=build_bounds(spec),
        true=replace(problem, plant=true, law=_law(spec, error, true, key)[1]),
        runs=simulation.runs,
        seed=simulation.seed,
        white="white" in simulation.compare,
    )


def _law(spec: Spec, error: ClosedLoopError, plant: MatrixPlant, key: str) -> tuple[str, ControlLaw]:
    """Return the key of the control law, and the law."""
    control = error.control
    if control.minimum_variance:
        return "minimum_variance", MinimumVariance(plant)
    if control.internal_model is not None:
        # The inverse gives the delay and the zeros to be kept, so it must exist first.
        check_invertible(plant, key=key)
        return "internal_model", InternalModel.build(plant, _transfer(spec, control.internal_model))
    for name in control.stated(*added("control_laws")):
        return name, cast(AddedLaw, control.at(name)).build(spec, plant)
    target = control.model_reference
    assert target is not None
    if target.kind == "discrete_matrix":
        T = TransferMatrix.build(target.numerator_matrix, target.denominator_matrix)
    elif target.kind == "continuous_matrix":
        inside = target.continuous
        rows = inside.numerator_matrix
        at_once = [[0.0] * len(row) for row in rows]
        held = hold_entries(rows, inside.denominator_matrix, spec.sample_time, at_once)
        T = TransferMatrix.build(*held)
    else:
        T = TransferMatrix.diagonal(_transfer(spec, target), plant.outputs)
    return "model_reference", ModelReference(T)


def _transfer(spec: Spec, transfer: Transfer) -> Rational:
    """Return a transfer function of the spec, sampled by a zero-order hold if it is given in s."""
    return rational(transfer) if transfer.kind == "discrete" else held(transfer, spec.sample_time)


_SIGNAL_KEYS = ("hold", "lines", "amplitudes", "offset", "ramp", "bits", "quantisation", "scale", "also")


def _check_supported(spec: Spec) -> None:
    """Refuse keys that are not supported for a closed-loop error, rather than ignore them."""
    limits = "limit powers from above, amplitude of inputs, rate or band"
    mins = [f"limits.{kind}_power.min" for kind in POWER_KINDS]
    remedies = {
        **{f"accuracy.{name}": "keep one requirement" for name in spec.accuracy.requirements},
        **dict.fromkeys(
            ("limits.energy", "limits.spectrum", "limits.moves", "limits.amplitude.output", *mins), limits
        ),
        "spectrum.type": "use type: pointwise, which is best at every frequency",
        "experiment.controller": "remove the controller",
        "report.ellipses": "remove report",
        "uncertainty": ONE_PLANT,
        "experiment.prior": "remove it",
        "solver.method": "remove method",
        "signal.type": "use multisine or filtered_noise",
        **dict.fromkeys((f"signal.{name}" for name in _SIGNAL_KEYS), "remove it"),
        "signal.phases": "use random",
    }
    handled = {
        "spectrum.type": ("pointwise", "free"),
        "solver.method": ("exchange",),
        "signal.type": ("multisine", "filtered_noise"),
        "signal.phases": ("random",),
    }
    refuse_unhandled(spec, "closed_loop_error", remedies, handled)
    check_record(spec, spec.plant.inputs**2)
    error, periods, samples = spec.accuracy.closed_loop_error, spec.signal.periods, spec.signal_samples
    filtered = spec.signal.type == "filtered_noise"
    if filtered and error is not None and error.covariance == "parametric":
        what, hint = "filter noise to the lines of a parametric design", "write type: multisine"
        raise _refuse("signal.type", what, f"{hint}, or covariance: asymptotic")
    if not filtered and periods is not None and samples % periods:
        message = f"{samples} samples do not make {periods} equal periods"
        hint = "choose a divisor of the number of samples"
        raise bad_spec("conflicting-keys", message, hint=hint, key="signal.periods")
