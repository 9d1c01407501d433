"""Spec -> weights over frequency, in the time of the plant."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import ComplexArray
from inputdesign_cli.plant import ContinuousRational, Rational, ScalarTransfer, zero_order_hold
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.transfer import ContinuousTransfer, DiscreteTransfer

# A root this near to the stability limit is on it. A frequency this near to an end of the band is inside.
_ON_THE_LIMIT, _EDGE = 1e-9, 1e-9


def rational(transfer: DiscreteTransfer) -> Rational:
    """Return a transfer function of the spec, its denominator kept in factors."""
    return Rational.build(list(transfer.numerator), [list(f) for f in transfer.denominator_factors])


def held(transfer: ContinuousTransfer, sample_time: float) -> Rational:
    """Return a transfer function of the spec in s behind a zero-order hold."""
    ratio = transfer.continuous
    return zero_order_hold(ratio.numerator, ratio.denominator_polynomial, sample_time)


def build_weight(
    spec: Spec, transfer: DiscreteTransfer | ContinuousTransfer | None, key: str
) -> ScalarTransfer:
    """Return a weight of the spec, or 1; `SpecError` (`not-sampled`) for one in s of a sampled plant."""
    match transfer:
        case None:
            return Rational.build([1.0])
        case DiscreteTransfer():
            return rational(transfer)
        case ContinuousTransfer() if not spec.plant.sampled:
            ratio = transfer.continuous
            return ContinuousRational(np.array(ratio.numerator), np.array(ratio.denominator_polynomial))
        case ContinuousTransfer() if transfer.sample is None:
            message = f"{key} is in s, but the experiment is in discrete time"
            hint = "write sample: zoh beside continuous, or give the weight in q^-1"
            raise spec.complain("not-sampled", message, hint=hint, key=key)
        case ContinuousTransfer():
            return held(transfer, spec.sample_time)


def check_finite(spec: Spec, weight: ScalarTransfer, band: tuple[float, float], code: str, key: str) -> None:
    """Raise `SpecError` (with this code) if a weight has a pole on the stability limit in the band."""
    at = on_the_limit(weight.pole_points, band)
    if at is None:
        return
    limit, mended = "imaginary axis", "s + 0.001 in place of s"
    if spec.plant.sampled:
        limit, mended = "unit circle", "a factor [1, -0.999] in place of [1, -1]"
    message = f"{key} has a pole on the {limit}, at {build_units(spec).named(at)}: it is infinite there"
    hint = f"move it inside ({mended}), or keep the band that it is for away from it"
    raise spec.complain(code, message, hint=hint, key=key)


def on_the_limit(points: ComplexArray, band: tuple[float, float]) -> float | None:
    """Return the lowest frequency of the band at which a point lies on the stability limit, if any."""
    lo, hi = band
    near = points.real[np.abs(points.imag) <= _ON_THE_LIMIT * hi]
    inside = near[(near >= lo - _EDGE * hi) & (near <= hi * (1.0 + _EDGE))]
    return float(inside.min()) if inside.size else None
