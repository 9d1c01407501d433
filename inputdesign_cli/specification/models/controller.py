"""`controller:` as polynomials in q^-1, PID, a transfer function in s, or single loops."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from inputdesign_cli.specification.models.fields import (
    Count,
    Index,
    NonNegative,
    Number,
    Several,
    Time,
    depth,
)
from inputdesign_cli.specification.models.section import PathDiagnostic, Section, Wording, optional, pick
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.models.transfer import ContinuousRatio, DiscreteMatrix, DiscreteTransfer
from inputdesign_cli.specification.models.units import TIME

Rule = Literal["tustin", "backward", "zoh"]
_RULE = "How s becomes q^-1: tustin (trapezoids), backward (backward differences) or zoh (a hold on y)."
_Delay = Annotated[Index, SIZES["controller.delay"]]
_Channel = Annotated[Count, SIZES["inputs or outputs"]]
_DELAY = "Samples that computing takes: u(t) answers y(t - delay)."


class Pid(Section):
    """Kp (1 + 1 / (Ti s) + Td s / (Tf s + 1)), times in time_unit."""

    ELSEWHERE: ClassVar[Mapping[str, str]] = {"Ki": "write Ti: Kp / Ki", "Kd": "write Td: Kd / Kp"}

    Kp: Number = Field(description="Gain; negative where more input means less output.", examples=[2.0])
    Ti: Time | None = optional("Integral time; absent: no integral action.")
    Td: Annotated[NonNegative, TIME] = Field(default=0.0, description="Derivative time (default 0).")
    Tf: Annotated[NonNegative, TIME] | None = optional(
        "Time constant of the filter of the derivative (default Td / 10)."
    )
    sample: Rule = Field(default="tustin", description=_RULE)

    def check(self) -> Iterator[PathDiagnostic]:
        """Its gain is not zero, and the rule of sampling admits its derivative."""
        if self.Kp == 0.0:
            message = "{key} is zero: the controller does nothing"
            yield PathDiagnostic("out-of-range", message, "remove the controller", ("Kp",))
        if self.Td > 0.0 and self.Tf == 0.0 and self.sample != "backward":
            message = f"{{key}} is zero, and {self.sample} has no derivative without a filter"
            hint = "write Tf: a tenth of Td, or sample: backward"
            yield PathDiagnostic("improper-transfer", message, hint, ("Tf",))

    @property
    def filter_time(self) -> float:
        """Tf, by default Td / 10."""
        return self.Td / 10.0 if self.Tf is None else self.Tf


class PidController(Section, family="controller", phrase="a PID controller"):
    """A PID controller, run by a computer."""

    kind: ClassVar[Literal["pid"]] = "pid"

    pid: Pid = Field(description="Gain and times.", examples=[{"Kp": 2, "Ti": 180}])
    delay: _Delay = Field(default=0, description=_DELAY)


class ContinuousController(Section, family="controller", phrase="a controller in s"):
    """A transfer function in s, run by a computer."""

    kind: ClassVar[Literal["continuous"]] = "continuous"

    continuous: ContinuousRatio = Field(description="numerator and denominator in descending powers of s.")
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
    return (ContinuousController if "continuous" in value else DiscreteTransfer).phrase


SingleController = Annotated[DiscreteTransfer | PidController | ContinuousController, pick(_single), _WORDING]
"""From one output to one input."""


class SingleLoop(Section):
    """The controller between an output and an input, counted from one."""

    output: _Channel = Field(description="The output that it reads: 1 for y1.")
    input: _Channel = Field(description="The input that it drives: 1 for u1.")
    controller: SingleController = Field(description="From this output to this input.")


class LoopsController(Section, family="controller", phrase="a list of single loops"):
    """Controllers loop by loop; what is not listed is zero."""

    kind: ClassVar[Literal["loops"]] = "loops"

    loops: Several[SingleLoop] = Field(description="One controller for each loop.")

    def check(self) -> Iterator[PathDiagnostic]:
        """No loop is listed twice."""
        places = [(one.output, one.input) for one in self.loops]
        for n, place in enumerate(places):
            if place in places[:n]:
                message = f"{{key}} is that of y{place[0]} and u{place[1]}, as one before"
                yield PathDiagnostic("conflicting-keys", message, "put the two into one", ("loops", n))


def _kind(value: dict[str, object]) -> str:
    if "loops" in value:
        return LoopsController.phrase
    return DiscreteMatrix.phrase if depth(value.get("numerator")) > 1 else _single(value)


Controller = Annotated[
    DiscreteTransfer | DiscreteMatrix | PidController | ContinuousController | LoopsController,
    pick(_kind),
    _WORDING,
]
"""C of a loop u = r - C y: from outputs (columns) to inputs (rows)."""
