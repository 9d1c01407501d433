"""Spec -> weights over frequency, in the time of the plant."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.plant import ContinuousRational, Rational, ScalarTransfer, zero_order_hold
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.transfer import ContinuousTransfer, DiscreteTransfer


def rational(transfer: DiscreteTransfer) -> Rational:
    """A transfer function of the spec, its denominator kept in factors."""
    return Rational.build(list(transfer.numerator), [list(f) for f in transfer.denominator_factors])


def held(transfer: ContinuousTransfer, sample_time: float) -> Rational:
    """A transfer function of the spec in s behind a zero-order hold."""
    ratio = transfer.continuous
    return zero_order_hold(ratio.numerator, ratio.denominator_polynomial, sample_time)


def build_weight(
    spec: Spec, transfer: DiscreteTransfer | ContinuousTransfer | None, key: str
) -> ScalarTransfer:
    """A weight of the spec, one where none is given.

    Raises:
        SpecError: `not-sampled` for a weight in s of a sampled plant that does not say how it is sampled;
            `unsuitable-key` for one in q^-1 of a plant in continuous time.
    """
    match transfer:
        case None:
            return Rational.build([1.0])
        case DiscreteTransfer() if spec.plant.sampled:
            return rational(transfer)
        case DiscreteTransfer():
            raise spec.complain(
                "unsuitable-key",
                f"{key} is in q^-1, but the plant is in continuous time",
                hint="write continuous: {numerator: [..], denominator: [..]} in s",
                key=key,
            )
        case ContinuousTransfer() if not spec.plant.sampled:
            ratio = transfer.continuous
            return ContinuousRational(np.array(ratio.numerator), np.array(ratio.denominator_polynomial))
        case ContinuousTransfer() if transfer.sample is None:
            raise spec.complain(
                "not-sampled",
                f"{key} is in s, but the experiment is in discrete time",
                hint="write sample: zoh beside continuous, or give the weight in q^-1",
                key=key,
            )
        case ContinuousTransfer():
            return held(transfer, spec.sample_time)
