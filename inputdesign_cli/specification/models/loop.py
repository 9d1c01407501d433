"""`controller:` in its forms, and the loops of `accuracy.loop:` and `accuracy.closed_loop_error:`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from inputdesign_cli.specification.models import fields, transfer
from inputdesign_cli.specification.models.section import PathDiagnostic, Section, Wording, optional, pick
from inputdesign_cli.specification.models.sizes import SIZES

Rule = Literal["tustin", "backward", "zoh"]
_RULE = "How s becomes q^-1: tustin (trapezoids), backward (backward differences) or zoh (a hold on y)."
_Delay = Annotated[fields.Index, SIZES["controller.delay"]]
_Channel = Annotated[fields.Count, SIZES["inputs or outputs"]]
_DELAY = "Samples that computing takes: u(t) answers y(t - delay)."


class Pid(Section):
    """Kp (1 + 1 / (Ti s) + Td s / (Tf s + 1)), times in time_unit."""

    ELSEWHERE: ClassVar[Mapping[str, str]] = {"Ki": "write Ti: Kp / Ki", "Kd": "write Td: Kd / Kp"}

    Kp: fields.Number = Field(description="Gain; negative if more input gives less output.", examples=[2.0])
    Ti: fields.Positive | None = optional("Integral time; absent: no integral action.")
    Td: fields.NonNegative = Field(default=0.0, description="Derivative time (default 0).")
    Tf: fields.NonNegative | None = optional("Time constant of the derivative's filter (default Td / 10).")
    sample: Rule = Field(default="tustin", description=_RULE)

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that the gain is not zero and the rule of sampling admits the derivative."""
        if self.Kp == 0.0:
            message = "{key} is zero: the controller does nothing"
            yield PathDiagnostic("out-of-range", message, "remove the controller", ("Kp",))
        if self.Td > 0.0 and self.Tf == 0.0 and self.sample != "backward":
            message = f"{{key}} is zero, and {self.sample} has no derivative without a filter"
            hint = "write Tf: a tenth of Td, or sample: backward"
            yield PathDiagnostic("improper-transfer", message, hint, ("Tf",))

    @property
    def filter_time(self) -> float:
        """Return the filter time Tf, by default Td / 10."""
        return self.Td / 10.0 if self.Tf is None else self.Tf


class PidController(Section, family="controller", phrase="a PID controller"):
    """A PID controller, run by a computer."""

    kind: ClassVar[Literal["pid"]] = "pid"

    pid: Pid = Field(description="Gain and times.", examples=[{"Kp": 2, "Ti": 180}])
    delay: _Delay = Field(default=0, description=_DELAY)


class ContinuousController(Section, family="controller", phrase="a controller in s"):
    """A transfer function in s, run by a computer."""

    kind: ClassVar[Literal["continuous"]] = "continuous"

    continuous: transfer.ContinuousRatio = Field(
        description="numerator and denominator in descending powers of s."
    )
    sample: Rule = Field(description=_RULE)
    delay: _Delay = Field(default=0, description=_DELAY)


_WORDING = Wording(
    "a mapping of keys",
    "write {numerator: [..], denominator: [..]} in q^-1, {pid: {Kp: 2, Ti: 180}} or {continuous: .., "
    "sample: tustin}; with several channels {loops: [..]}, or rows of columns in q^-1",
)


def _single(value: dict[str, object]) -> str:
    if "pid" in value:
        return PidController.phrase
    return (ContinuousController if "continuous" in value else transfer.DiscreteTransfer).phrase


SingleController = Annotated[
    transfer.DiscreteTransfer | PidController | ContinuousController, pick(_single), _WORDING
]
"""A controller from one output to one input."""


class SingleLoop(Section):
    """The controller between an output and an input, counted from one."""

    output: _Channel = Field(description="The output that it reads: 1 for y1.")
    input: _Channel = Field(description="The input that it drives: 1 for u1.")
    controller: SingleController = Field(description="From this output to this input.")


class LoopsController(Section, family="controller", phrase="a list of single loops"):
    """Controllers loop by loop; what is not listed is zero."""

    kind: ClassVar[Literal["loops"]] = "loops"

    loops: fields.Several[SingleLoop] = Field(description="One controller for each loop.")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that no loop is listed twice."""
        places = [(one.output, one.input) for one in self.loops]
        for n, place in enumerate(places):
            if place in places[:n]:
                message = f"{{key}} is that of y{place[0]} and u{place[1]}, as one before"
                yield PathDiagnostic("conflicting-keys", message, "put the two into one", ("loops", n))


def _kind(value: dict[str, object]) -> str:
    if "loops" in value:
        return LoopsController.phrase
    return transfer.DiscreteMatrix.phrase if fields.depth(value.get("numerator")) > 1 else _single(value)


Controller = Annotated[
    transfer.DiscreteTransfer
    | transfer.DiscreteMatrix
    | PidController
    | ContinuousController
    | LoopsController,
    pick(_kind),
    _WORDING,
]
"""C of a loop u = r - C y: from outputs (columns) to inputs (rows)."""


class Control(Section):
    """The control law that will be computed from the model: exactly one."""

    model_reference: transfer.Target | None = optional(
        "Desired loop from reference to output: t I, or a matrix; from s by a zero-order hold."
    )
    internal_model: transfer.Transfer | None = optional("Filter of an internal-model controller.")
    minimum_variance: (
        Annotated[Literal[True], Wording("true", "remove the key to choose another law")] | None
    ) = optional("true: minimum-variance control.")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that there is one law, and that its transfer functions are stable."""
        yield from self.choose(tuple(type(self).model_fields), 1)
        for key in self.stated("model_reference", "internal_model"):
            yield from transfer.check_stable(getattr(self, key), key)


class Reference(Section):
    """The reference that the closed loop will follow: white noise, filtered."""

    variance: fields.PerChannel[fields.Positive] = Field(default=1.0, description="One, or one per output.")
    filter: transfer.Transfer | None = optional("Filter that colours it (default 1).")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that the filter is stable."""
        if self.filter is not None:
            yield from transfer.check_stable(self.filter, "filter")


class ClosedLoopError(Section):
    """E||y - y0||^2 of the loop with the controller designed on the model."""

    control: Control = Field(description="The control law.")
    reference: Reference = Field(default=Reference(), description="The reference of the loop.")
    covariance: Literal["asymptotic", "parametric"] = Field(
        default="asymptotic", description="Asymptotic in model order, or exact for the model structure."
    )


MOST_DECIBELS = 100.0
"""The largest peak of |S| that a spec may state, in dB."""


class Simc(Section):
    """PI settings by the rules of Skogestad."""

    tau_c: fields.Positive | None = optional(
        "Time constant of the closed loop (default: the dead time, half of a second lag and half a sample)."
    )


class Amigo(Section):
    """PI or PID settings by the rules of Astrom and Hagglund."""

    type: Literal["pi", "pid"] = Field(default="pi", description="With or without derivative action.")


class Tuning(Section, one_of=(("simc", "amigo"),)):
    """How the controller follows from gain, time constant and dead time of the nominal plant."""

    simc: Simc | None = optional("{tau_c: 25}, or {} for the dead time.")
    amigo: Amigo | None = optional("{type: pi} or {type: pid}.")
    sample: Rule = Field(default="tustin", description="How s becomes q^-1 (default tustin).")


_Peak = Annotated[
    fields.Positive, Field(le=MOST_DECIBELS), Wording("a number", "beyond it no margin is left; write 6, say")
]
# A phase margin of 60 degrees would need a peak of |S| of one, but every peak is larger.
_Degrees = Annotated[
    fields.Positive, Field(lt=60.0), Wording("a number", "write degrees between 0 and 60: 45, for example")
]
_Factor = Annotated[
    fields.Positive, Field(gt=1.0), Wording("a number", "write a factor above 1: 2, for example")
]


class LoopMargin(
    Section,
    one_of=(("max_sensitivity_db", "phase_margin", "gain_margin"),),
    not_both=(("controller", "tuning"),),
):
    """For every plant within r_u the loop is stable, with |S| below a peak at every frequency."""

    controller: Controller | None = optional("C of the loop (default: the controller of the experiment).")
    tuning: Tuning | None = optional("Or the rule by which it is tuned.")
    max_sensitivity_db: _Peak | None = optional("Largest |S|, in dB.")
    phase_margin: _Degrees | None = optional("Least phase margin in degrees, below 60, by the peak of |S|.")
    gain_margin: _Factor | None = optional("Least gain margin, a factor above 1, by the peak of |S|.")
    confidence: fields.Fraction | None = optional("Probability that fixes alpha (default 0.95).")
    band: fields.Band | None = optional("Frequencies [low, high] (default: all).")

    @property
    def peak(self) -> float:
        """Return the largest |S|; 1 + L keeps a distance of 1/|S| from 0, which bounds both margins."""
        if self.max_sensitivity_db is not None:
            return float(10 ** (self.max_sensitivity_db / 20))
        if self.phase_margin is not None:
            return 0.5 / math.sin(math.radians(self.phase_margin) / 2)
        assert self.gain_margin is not None
        return self.gain_margin / (self.gain_margin - 1.0)

    def allowing(self, peak: float) -> str:
        """Return an entry of the stated margin with which |S| may reach a little more than `peak`."""
        if self.phase_margin is not None:
            degrees = math.degrees(2.0 * math.asin(0.5 / peak))
            return f"phase_margin: {math.floor(10.0 * degrees) / 10.0:g}"
        if self.gain_margin is not None:
            return f"gain_margin: {1.0 + math.floor(1000.0 / (peak - 1.0)) / 1000.0:g}"
        return f"max_sensitivity_db: {math.ceil(2000.0 * math.log10(peak)) / 100.0:g}"
