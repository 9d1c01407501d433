"""`accuracy.closed_loop_error:`, the control law whose loop the identified model will serve."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from inputdesign_cli.specification.models.annotations import Wording
from inputdesign_cli.specification.models.controller import MatrixRatio
from inputdesign_cli.specification.models.experiment import exactly_one
from inputdesign_cli.specification.models.fields import PerChannel, Positive, RowsMatrix
from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.plant import ContinuousMatrix
from inputdesign_cli.specification.models.polynomials import check_delay_stable
from inputdesign_cli.specification.models.section import Section, pick, tag
from inputdesign_cli.specification.models.shapes import check_each
from inputdesign_cli.specification.models.transfer import (
    ContinuousTransfer,
    DiscreteTransfer,
    Transfer,
)


class DiscreteMatrix(MatrixRatio, family="transfer", phrase="a transfer matrix in q^-1"):
    """A stable transfer matrix in the delay operator, rows are outputs."""

    kind: ClassVar[Literal["discrete_matrix"]] = "discrete_matrix"

    def check_stable(self, *path: str) -> Iterator[PathDiagnostic]:
        """Its poles lie inside the unit circle; `path` leads to the matrix."""
        yield from check_each(self.denominator, check_delay_stable, *path, "denominator")


class ContinuousTarget(ContinuousMatrix):
    """A transfer matrix in s that is written as one."""

    numerator: RowsMatrix = Field(description="Rows (outputs) of columns of coefficients.")


class ContinuousMatrixTransfer(Section, family="transfer", phrase="a continuous-time transfer matrix"):
    """A transfer matrix in s, sampled with a zero-order hold."""

    kind: ClassVar[Literal["continuous_matrix"]] = "continuous_matrix"

    continuous: ContinuousTarget = Field(description="numerator and denominator in descending powers of s.")
    sample: Literal["zoh"] | None = Field(default=None, description="How it is sampled: zoh.")

    def check_stable(self, *path: str) -> Iterator[PathDiagnostic]:
        """Nothing is left to check: a matrix in s is stable, or it is not read."""
        return iter(())


def _target_kind(value: dict[str, Any]) -> str:
    inside = value.get("continuous", value)
    numerator = inside.get("numerator") if isinstance(inside, dict) else None
    matrix = isinstance(numerator, list | tuple) and any(isinstance(row, list | tuple) for row in numerator)
    if "continuous" in value:
        return ContinuousMatrixTransfer.phrase if matrix else ContinuousTransfer.phrase
    return DiscreteMatrix.phrase if matrix else DiscreteTransfer.phrase


Target = Annotated[
    Annotated[DiscreteTransfer, tag(DiscreteTransfer.phrase)]
    | Annotated[ContinuousTransfer, tag(ContinuousTransfer.phrase)]
    | Annotated[DiscreteMatrix, tag(DiscreteMatrix.phrase)]
    | Annotated[ContinuousMatrixTransfer, tag(ContinuousMatrixTransfer.phrase)],
    pick(_target_kind),
    Wording(
        "a mapping of keys",
        "write {continuous: {numerator: [1], denominator: [10, 1]}}, or the same in q^-1 or with matrices",
    ),
]
"""t(q) I from one transfer function, or a square matrix."""


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
        yield from exactly_one(self, "model_reference", "internal_model", "minimum_variance")
        if self.model_reference is not None:
            yield from self.model_reference.check_stable("model_reference")
        if self.internal_model is not None:
            yield from self.internal_model.check_stable("internal_model")


class Reference(Section):
    """The reference that the closed loop will follow: white noise, filtered."""

    variance: PerChannel[Positive] = Field(default=1.0, description="Variance; a number or one per output.")
    filter: Transfer | None = Field(default=None, description="Filter that colours it (default 1).")

    def check(self) -> Iterator[PathDiagnostic]:
        """The filter is stable."""
        if self.filter is not None:
            yield from self.filter.check_stable("filter")


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
