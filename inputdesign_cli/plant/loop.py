"""The loop around the plant: u = r - C y, or no loop at all."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.errors import bad_spec
from inputdesign_cli.plant.model import PolynomialModel
from inputdesign_cli.plant.polynomial import (
    Array,
    ComplexArray,
    evaluate,
    join_roots,
    roots_in_z,
    unit_circle,
)
from inputdesign_cli.plant.transfer import Rational


@dataclass(frozen=True)
class LoopResponse:
    """Transfer functions (n,), of several channels matrices (n, to, from), from the excitation x (r in closed
    loop, u in open loop) and from e."""

    y_x: ComplexArray
    u_x: ComplexArray
    y_e: ComplexArray
    u_e: ComplexArray


@dataclass(frozen=True)
class Loop:
    """A SISO model in open loop (`controller` None) or under u = r - C y.

    Everything is written over the characteristic polynomial A F D_c + B N_c, so that unstable or
    integrating poles of plant and controller never appear: S and G S stay finite where C or G is not.
    """

    model: PolynomialModel
    controller: Rational | None = None

    @cached_property
    def characteristic(self) -> Array:
        """Closed-loop characteristic polynomial in q^-1 (open loop: A F)."""
        m = self.model
        open_loop = np.convolve(m.A, m.F)
        if self.controller is None:
            return open_loop
        left = np.convolve(open_loop, self.controller.denominator_polynomial)
        right = np.convolve(m.B, self.controller.numerator)
        total = np.zeros(max(left.size, right.size))
        total[: left.size] += left
        total[: right.size] += right
        return total

    @cached_property
    def poles(self) -> ComplexArray:
        """Poles in z of everything that the excitation and the noise cause, predictor included."""
        return join_roots([roots_in_z(self.characteristic), self.model.predictor_poles])

    def check_stability(self) -> None:
        """Raise `SpecError` unless the loop is well posed and stable.

        Raises:
            SpecError: `unstable-loop` or `algebraic-loop`.
        """
        if self.controller is None:
            return
        leading = self.characteristic[0]
        if abs(leading) < 1e-9 * np.abs(self.characteristic).max():
            raise bad_spec(
                "algebraic-loop",
                "plant and controller both act without delay and 1 + C G vanishes at infinite frequency",
                hint="put the delay of the plant into B (a leading 0) or into the controller's numerator",
                key="experiment.controller",
            )
        refuse_unstable(
            roots_in_z(self.characteristic),
            hint="check the signs (feedback is negative: u = r - C y), the delay in B, and that "
            "numerator and denominator of the controller are in q^-1, ascending",
        )

    def check_delay(self) -> None:
        """Raise `SpecError` where the direct method would fail, see `refuse_instantaneous`.

        Raises:
            SpecError: `algebraic-loop`.
        """
        if self.controller is not None and self.model.B[0] != 0.0 and self.controller.numerator[0] != 0.0:
            refuse_instantaneous()

    def responses(self, w: ArrayLike) -> LoopResponse:
        """Transfer functions at normalised frequencies `w` (n,)."""
        m = self.model
        q = unit_circle(w)
        A, B, C, D, F = (evaluate(p, q) for p in (m.A, m.B, m.C, m.D, m.F))
        if self.controller is None:
            one = np.ones_like(q)
            return LoopResponse(y_x=B / (A * F), u_x=one, y_e=C / (A * D), u_e=np.zeros_like(q))
        Nc, Dc = self.controller.numerator_at(w), self.controller.denominator_at(w)
        closed = A * F * Dc + B * Nc
        return LoopResponse(
            y_x=B * Dc / closed,
            u_x=A * F * Dc / closed,
            y_e=F * C * Dc / (D * closed),
            u_e=-F * C * Nc / (D * closed),
        )


def refuse_instantaneous() -> None:
    """Raise `SpecError` (`algebraic-loop`): both plant and controller act at once.

    Then u(t) holds e(t), and so does the gradient of the prediction of y(t): the direct method, an estimate
    from u and y, is biased. Ljung (1999), Chapter 13, asks for a delay in one of them.
    """
    raise bad_spec(
        "algebraic-loop",
        "plant and controller both act without delay: u(t) answers the noise of y(t) and changes y(t), so "
        "that estimates from u and y would be biased",
        hint="give the plant its delay (a leading 0 in B; in s a numerator of lower order than the "
        "denominator) or the controller one (a leading 0 in its numerator)",
        key="experiment.controller",
    )


def refuse_unstable(poles: ComplexArray, *, hint: str) -> None:
    """Raise `SpecError` (`unstable-loop`) unless all closed-loop poles in z lie inside the unit circle."""
    if not poles.size or np.abs(poles).max() < 1.0:
        return
    worst = poles[int(np.argmax(np.abs(poles)))]
    raise bad_spec(
        "unstable-loop",
        f"the loop u = r - C y is unstable: closed-loop pole at radius {abs(worst):.6g}, "
        f"angle {abs(np.angle(worst)):.4g} rad/sample",
        hint=hint,
        key="experiment.controller",
    )
