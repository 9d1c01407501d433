"""Spec -> plant, loop and experiment: what is excited, for how long, in which loop."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant import Loop, PolynomialModel, Rational
from inputdesign_cli.spec import Spec
from inputdesign_cli.spec.plant import PolynomialPlant
from inputdesign_cli.spec.transfer import DiscreteTransfer


def rational(transfer: DiscreteTransfer) -> Rational:
    """A transfer function of the spec, its denominator kept in factors."""
    return Rational.build(list(transfer.numerator), [list(f) for f in transfer.denominator_factors])


def build_model(spec: Spec) -> PolynomialModel:
    """The SISO polynomial model of `plant` and `noise`.

    Raises:
        SpecError: `not-supported` for the other kinds of plants.
    """
    plant = spec.plant
    if not isinstance(plant, PolynomialPlant):
        raise spec.complain(
            "not-supported",
            "this version designs for polynomial plants only",
            hint="write the plant as sampled polynomials A, B, F in q^-1",
            key="plant",
        )
    if plant.inputs > 1 or plant.outputs > 1:
        raise spec.complain(
            "not-supported",
            f"this version designs for one input and one output, not {plant.inputs} and {plant.outputs}",
            hint="design for one channel at a time",
            key="plant.B",
        )
    return PolynomialModel(
        A=np.array(plant.A_per_output[0]),
        B=np.array(plant.B_matrix[0][0]),
        C=np.array(spec.noise.C_per_output(1)[0]),
        D=np.array(spec.noise.D_per_output(1)[0]),
        F=np.array(plant.F_matrix[0][0]),
        variance=float(spec.noise.covariance(1)[0, 0]),
    )


def build_experiment(spec: Spec) -> Experiment:
    """The experiment, its loop checked for stability.

    Raises:
        SpecError: for plants that are not supported, an unstable or algebraic loop, a prior that
            does not fit the parameters.
    """
    model = build_model(spec)
    controller = spec.experiment.controller
    loop = Loop(model, None if controller is None else rational(controller))
    loop.check_stability()
    return Experiment(loop, spec.experiment.samples, _prior(spec, model))


def build_cost(spec: Spec) -> dict[PowerKind, float]:
    """Weights of the powers."""
    weights: dict[PowerKind, object] = {
        "input": spec.cost.input_power,
        "output": spec.cost.output_power,
        "excitation": spec.cost.excitation_power,
    }
    return {kind: _single(weight) for kind, weight in weights.items() if _single(weight) > 0}


def _single(weight: object) -> float:
    return float(weight[0]) if isinstance(weight, tuple) else float(weight)  # type: ignore[arg-type]


def _prior(spec: Spec, model: PolynomialModel) -> np.ndarray | None:
    prior = spec.experiment.prior
    if prior is None:
        return None
    key = "experiment.prior"
    if isinstance(prior.information, str):
        raise spec.complain(
            "not-supported",
            "this version takes prior information as a matrix, not from a data file",
            hint="write information: [[..]], the inverse of the covariance of the parameters",
            key=f"{key}.information",
        )
    matrix = np.array(prior.information, dtype=float)
    names = prior.parameters or model.names
    for name in names:
        if name not in model.names:
            raise spec.complain(
                "unknown-parameter",
                f'the model has no parameter "{name}"',
                hint=f"its parameters are {', '.join(model.names)}",
                key=f"{key}.parameters",
            )
    if len(matrix) != len(names):
        raise spec.complain(
            "wrong-shape",
            f"the prior information is {len(matrix)} x {len(matrix)}, but there are {len(names)} parameters",
            hint=f"order its rows as {', '.join(model.names)}, or name its parameters",
            key=f"{key}.information",
        )
    full = np.zeros((len(model.names), len(model.names)))
    index = [model.names.index(name) for name in names]
    full[np.ix_(index, index)] = matrix
    return full
