"""`accuracy.closed_loop_error:`, the control law whose loop the identified model will serve."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from inputdesign_cli.specification.models.annotations import Wording
from inputdesign_cli.specification.models.fields import PerChannel, Positive
from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.section import Section
from inputdesign_cli.specification.models.transfer import Target, Transfer, check_stable


class Control(Section):
    """The control law that will be computed from the model: exactly one."""

    model_reference: Target | None = Field(
        default=None,
        description="Desired loop from reference to output: t I, or a matrix; from s by a zero-order hold.",
    )
    internal_model: Transfer | None = Field(
        default=None, description="Filter of an internal-model controller."
    )
    minimum_variance: (
        Annotated[Literal[True], Wording("true", "remove the key to choose another law")] | None
    ) = Field(default=None, description="true: minimum-variance control.")

    def check(self) -> Iterator[PathDiagnostic]:
        """There is one law, and what it is given is stable."""
        yield from self.exactly_one("model_reference", "internal_model", "minimum_variance")
        if self.model_reference is not None:
            yield from check_stable(self.model_reference, "model_reference")
        if self.internal_model is not None:
            yield from check_stable(self.internal_model, "internal_model")


class Reference(Section):
    """The reference that the closed loop will follow: white noise, filtered."""

    variance: PerChannel[Positive] = Field(default=1.0, description="Variance; a number or one per output.")
    filter: Transfer | None = Field(default=None, description="Filter that colours it (default 1).")

    def check(self) -> Iterator[PathDiagnostic]:
        """The filter is stable."""
        if self.filter is not None:
            yield from check_stable(self.filter, "filter")


class ClosedLoopError(Section):
    """E||y - y0||^2 of the loop with the controller designed on the model."""

    control: Control = Field(description="The control law.")
    reference: Reference = Field(
        default=Reference(), description="What the loop follows (default: white, variance 1)."
    )
    covariance: Literal["asymptotic", "parametric"] = Field(
        default="asymptotic",
        description="asymptotic in model order, or parametric: the exact covariance of the model structure.",
    )
