"""Is the controller that the law asks for one that can run: causal, stable, and finite on the circle."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import ComplexArray
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.plant.polynomial import at, delay_of, determinant_and_adjugate, multiply
from inputdesign_cli.plant.transfer import TransferMatrix

# A zero this close to the unit circle counts as on it.
_ON_CIRCLE = 1e-7
_VANISHES = 1e-7


def check_invertible(plant: MatrixPlant, *, key: str) -> None:
    """Raise if the determinant of the square G is zero at every frequency.

    Raises:
        SpecError: `singular-plant`.
    """
    if not plant.regular:
        raise bad_spec(
            "singular-plant",
            "the determinant of the plant vanishes at every frequency, so no controller can invert it",
            hint="check the gains, or leave out one input and one output",
            key=key,
        )


def check_circle(plant: MatrixPlant, target: TransferMatrix | None, *, key: str) -> None:
    """Raise if a zero of the plant lies on the unit circle where `target` does not vanish.

    Raises:
        SpecError: `infinite-criterion`.
    """
    radius = np.abs(plant.zeros)
    on = plant.zeros[np.abs(radius - 1) <= _ON_CIRCLE]
    on = on if target is None else _not_cancelled(on, target)
    if on.size:
        raise bad_spec(
            "infinite-criterion",
            f"the plant has a zero on the unit circle at {abs(np.angle(on[0])):.4g} rad/sample, where the "
            "controller would have a pole: the error of the loop is infinite, whatever the input",
            hint="let the desired loop vanish there, or move the zero inside",
            key=key,
        )


def check_model_reference(plant: MatrixPlant, target: TransferMatrix, *, key: str) -> None:
    """Raise unless G^-1 T is causal and stable.

    Raises:
        SpecError: `delay-too-short`, `non-minimum-phase`, `infinite-criterion`.
    """
    check_circle(plant, target, key=key)
    det, adj = determinant_and_adjugate(plant.numerator)
    if delay_of(multiply(adj, target.common_fraction()[0])) < delay_of(det):
        need = plant.inverse_delay
        raise bad_spec(
            "delay-too-short",
            f"the desired loop has a delay of {_samples(target.delay)}, the inverse of the plant needs "
            f"{_samples(need)}: the controller would not be causal",
            hint=f"begin the numerator in q^-1 with {need} {'zero' if need == 1 else 'zeros'} (in s, lower "
            "its degree below that of the denominator), or use internal_model, which adds the delay",
            key=key,
        )
    outside = _not_cancelled(plant.zeros[np.abs(plant.zeros) > 1], target)
    if outside.size:
        raise _unstable(outside, key)


def check_minimum_variance(plant: MatrixPlant, T: ComplexArray, *, key: str) -> None:
    """Raise unless the plant is minimum phase, with one delay in every direction, and the law gives feedback.

    Args:
        T: (K, n, n), the loop that the law gives, at some frequencies.

    Raises:
        SpecError: `non-minimum-phase`, `infinite-criterion`, `no-feedback`, `not-supported`.
    """
    check_circle(plant, None, key=key)
    outside = plant.zeros[np.abs(plant.zeros) > 1]
    if outside.size:
        raise _unstable(outside, key)
    if np.abs(T).max(axis=(0, 2)).min() < _VANISHES:
        raise bad_spec(
            "no-feedback",
            "the noise of some output cannot be predicted beyond the delay, so minimum-variance control "
            "leaves it alone and asks nothing of the model there",
            hint="give the noise poles or zeros (C, D or A), or use another law",
            key=key,
        )
    if plant.inverse_delay != plant.delay:
        raise bad_spec(
            "not-supported",
            "this version designs minimum-variance control for plants with one delay in all directions; "
            f"here it lies between {_samples(plant.delay)} and {_samples(plant.inverse_delay)}",
            hint="use internal_model or model_reference",
            key=key,
        )


def _not_cancelled(zeros: ComplexArray, target: TransferMatrix) -> ComplexArray:
    """Return the zeros at which the desired loop does not vanish."""
    if not zeros.size:
        return zeros
    values = np.abs(at(target.numerator, 1 / zeros)).max(axis=(1, 2))
    scale = np.abs(target.numerator).sum(axis=2).max()
    return zeros[values > _VANISHES * scale]


def _unstable(zeros: ComplexArray, key: str) -> Exception:
    worst = zeros[np.argmax(np.abs(zeros))]
    return bad_spec(
        "non-minimum-phase",
        f"the plant has a zero outside the unit circle (radius {abs(worst):.4g}, "
        f"{abs(np.angle(worst)):.4g} rad/sample): the controller inverts it and would be unstable",
        hint="use internal_model, which keeps such zeros in the loop",
        key=key,
    )


def _samples(count: int) -> str:
    return "no sample" if count == 0 else "1 sample" if count == 1 else f"{count} samples"
