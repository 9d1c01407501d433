"""`accuracy.loop:` and `accuracy.closed_loop_error:`, the control loops that the model is for."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from inputdesign_cli.specification.models.controller import Controller, Rule
from inputdesign_cli.specification.models.fields import Band, Fraction, PerChannel, Positive, Time
from inputdesign_cli.specification.models.section import PathDiagnostic, Section, Wording, optional
from inputdesign_cli.specification.models.transfer import Target, Transfer, check_stable


class Control(Section):
    """The control law that will be computed from the model: exactly one."""

    model_reference: Target | None = optional(
        "Desired loop from reference to output: t I, or a matrix; from s by a zero-order hold."
    )
    internal_model: Transfer | None = optional("Filter of an internal-model controller.")
    minimum_variance: (
        Annotated[Literal[True], Wording("true", "remove the key to choose another law")] | None
    ) = optional("true: minimum-variance control.")

    def check(self) -> Iterator[PathDiagnostic]:
        """There is one law, and its transfer functions are stable."""
        yield from self.exactly_one(*type(self).model_fields)
        if self.model_reference is not None:
            yield from check_stable(self.model_reference, "model_reference")
        if self.internal_model is not None:
            yield from check_stable(self.internal_model, "internal_model")


class Reference(Section):
    """The reference that the closed loop will follow: white noise, filtered."""

    variance: PerChannel[Positive] = Field(default=1.0, description="Variance; a number or one per output.")
    filter: Transfer | None = optional("Filter that colours it (default 1).")

    def check(self) -> Iterator[PathDiagnostic]:
        """The filter is stable."""
        if self.filter is not None:
            yield from check_stable(self.filter, "filter")


class ClosedLoopError(Section):
    """E||y - y0||^2 of the loop with the controller designed on the model."""

    control: Control = Field(description="The control law.")
    reference: Reference = Field(
        default=Reference(), description="The reference of the loop (default: white, variance 1)."
    )
    covariance: Literal["asymptotic", "parametric"] = Field(
        default="asymptotic",
        description="asymptotic in model order, or parametric: the exact covariance of the model structure.",
    )


MOST_DECIBELS = 100.0
"""A peak of |S| of a hundred thousand: the loop may be as near to instability as that."""


class Simc(Section):
    """PI settings by the rules of Skogestad."""

    tau_c: Time | None = optional("Time constant of the closed loop, in time_unit (default: the dead time).")


class Amigo(Section):
    """PI or PID settings by the rules of Astrom and Hagglund."""

    type: Literal["pi", "pid"] = Field(default="pi", description="With or without derivative action.")


class Tuning(Section):
    """How the controller follows from gain, time constant and dead time of the nominal plant."""

    simc: Simc | None = optional("{tau_c: 25}, or {} for the dead time.")
    amigo: Amigo | None = optional("{type: pi} or {type: pid}.")
    sample: Rule = Field(default="tustin", description="How s becomes q^-1 (default tustin).")

    def check(self) -> Iterator[PathDiagnostic]:
        """There is one rule."""
        yield from self.exactly_one("simc", "amigo")


_Peak = Annotated[
    Positive, Field(le=MOST_DECIBELS), Wording("a number", "beyond it no margin is left; write 6, say")
]
# A phase margin of 60 degrees takes a peak of |S| of one, and every peak is above.
_Degrees = Annotated[
    Positive, Field(lt=60.0), Wording("a number", "write degrees between 0 and 60: 45, for example")
]
_Factor = Annotated[Positive, Field(gt=1.0), Wording("a number", "write a factor above 1: 2, for example")]


class LoopMargin(Section):
    """For every plant within r_u the loop is stable, with |S| below a peak at every frequency."""

    controller: Controller | None = optional("C of the loop (default: the controller of the experiment).")
    tuning: Tuning | None = optional("Or the rule by which it is tuned.")
    max_sensitivity_db: _Peak | None = optional("Largest |S|, in dB.")
    phase_margin: _Degrees | None = optional(
        "Least phase margin in degrees, below 60, kept by the peak of |S| for it."
    )
    gain_margin: _Factor | None = optional(
        "Least gain margin, a factor above 1, kept by the peak of |S| for it."
    )
    confidence: Fraction | None = optional("Probability that fixes alpha by chi-squared (default 0.95).")
    band: Band | None = optional("Frequencies [low, high] (default: all).")

    def check(self) -> Iterator[PathDiagnostic]:
        """There are one margin and one controller."""
        yield from self.exactly_one("max_sensitivity_db", "phase_margin", "gain_margin")
        yield from self.at_most_one("controller", "tuning")

    @property
    def peak(self) -> float:
        """The largest |S|; 1 + L keeps a distance of 1/|S| from 0, which bounds gain and phase margins."""
        if self.max_sensitivity_db is not None:
            return float(10 ** (self.max_sensitivity_db / 20))
        if self.phase_margin is not None:
            return 0.5 / math.sin(math.radians(self.phase_margin) / 2)
        assert self.gain_margin is not None
        return self.gain_margin / (self.gain_margin - 1.0)

    def allowing(self, peak: float) -> str:
        """Return an entry for the stated margin with which |S| may reach a little more than `peak`."""
        if self.phase_margin is not None:
            degrees = math.degrees(2.0 * math.asin(0.5 / peak))
            return f"phase_margin: {math.floor(10.0 * degrees) / 10.0:g}"
        if self.gain_margin is not None:
            return f"gain_margin: {1.0 + math.floor(1000.0 / (peak - 1.0)) / 1000.0:g}"
        return f"max_sensitivity_db: {math.ceil(2000.0 * math.log10(peak)) / 100.0:g}"
