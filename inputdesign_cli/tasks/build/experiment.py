"""Spec -> plant, loop and experiment: what is excited, for how long, in which loop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant import Loop, PolynomialModel, Rational, zero_order_hold
from inputdesign_cli.signal.single import record_information
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.controller import ControllerMatrix
from inputdesign_cli.specification.models.plant import PolynomialPlant
from inputdesign_cli.specification.models.transfer import ContinuousTransfer, DiscreteTransfer
from inputdesign_cli.tasks.build.tables import read_columns

_PRIOR = "experiment.prior.information"


def rational(transfer: DiscreteTransfer) -> Rational:
    """A transfer function of the spec, its denominator kept in factors."""
    return Rational.build(list(transfer.numerator), [list(f) for f in transfer.denominator_factors])


def weight(spec: Spec, transfer: DiscreteTransfer | ContinuousTransfer, key: str) -> Rational:
    """A weight of the spec, sampled by a zero-order hold where it is given in s.

    Raises:
        SpecError: `not-sampled` for a weight in s that does not say how it is sampled.
    """
    if isinstance(transfer, DiscreteTransfer):
        return rational(transfer)
    if transfer.sample is None:
        raise spec.complain(
            "not-sampled",
            f"{key} is in s, but the experiment is in discrete time",
            hint="write sample: zoh beside continuous, or give the weight in q^-1",
            key=key,
        )
    ratio = transfer.continuous
    return zero_order_hold(ratio.numerator, ratio.denominator_polynomial, spec.sample_time)


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
    assert not isinstance(controller, ControllerMatrix)  # the spec has been checked
    loop = Loop(model, None if controller is None else rational(controller))
    loop.check_stability()
    loop.check_delay()
    return Experiment(loop, spec.experiment.samples, _prior(spec, loop))


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


def _prior(spec: Spec, loop: Loop) -> np.ndarray | None:
    """The information at hand (k, k): a matrix, or that of the samples of an earlier experiment."""
    prior = spec.experiment.prior
    if prior is None:
        return None
    names = loop.model.names
    if isinstance(prior.information, str):
        excitation = read_excitation_record(spec, prior.information, _PRIOR)
        earlier = Experiment(loop, excitation.size)
        return record_information(earlier, excitation)
    return embedded(spec, names, np.array(prior.information, dtype=float), prior.parameters, _PRIOR)


def read_excitation_record(spec: Spec, name: str, key: str) -> np.ndarray:
    """The samples of an excitation from a CSV file: its column u (in closed loop r).

    Raises:
        DataError: the file cannot be used.
    """
    channel = "r" if spec.closed_loop else "u"
    return read_columns(spec.resolve_path(name), {"signal": channel}, key=key)["signal"]


def embedded(
    spec: Spec, known: Sequence[str], matrix: np.ndarray, names: Sequence[str] | None, key: str
) -> np.ndarray:
    """A matrix over some named parameters (all, when none are named) as one over all `known`: (k, k).

    Raises:
        SpecError: `unknown-parameter` or `wrong-shape`.
    """
    for name in names or ():
        if name not in known:
            raise spec.complain(
                "unknown-parameter",
                f'the model has no parameter "{name}"',
                hint=f"its parameters are {', '.join(known)}",
                key=key,
            )
    listed = tuple(names or known)
    if len(matrix) != len(listed):
        raise spec.complain(
            "wrong-shape",
            f"the matrix is {len(matrix)} x {len(matrix)}, but there are {len(listed)} parameters",
            hint=f"order its rows as {', '.join(known)}, or name its parameters",
            key=key,
        )
    full = np.zeros((len(known), len(known)))
    index = [list(known).index(name) for name in listed]
    full[np.ix_(index, index)] = matrix
    return full
