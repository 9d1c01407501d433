"""`accuracy.closed_loop_error:`, the control law whose loop the identified model will serve."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, PlainValidator, WithJsonSchema, model_validator

from inputdesign_cli.specification.models.controller import MatrixRatio
from inputdesign_cli.specification.models.experiment import exactly_one
from inputdesign_cli.specification.models.fields import PositivePerChannel, RowsMatrix
from inputdesign_cli.specification.models.findings import Findings, describe, fail
from inputdesign_cli.specification.models.plant import ContinuousMatrix, with_paths
from inputdesign_cli.specification.models.polynomials import check_delay_stable, check_left_half_plane
from inputdesign_cli.specification.models.section import Section, needs_mapping, picker, tag
from inputdesign_cli.specification.models.transfer import (
    ContinuousTransfer,
    DiscreteTransfer,
    Ratio,
    Transfer,
)


class DiscreteMatrix(MatrixRatio, family="transfer", phrase="a transfer matrix in q^-1"):
    """A stable transfer matrix in the delay operator, rows are outputs."""

    @model_validator(mode="after")
    def _stable(self) -> DiscreteMatrix:
        findings = Findings()
        for path, factor in with_paths(self.denominator):
            if finding := check_delay_stable(factor):
                findings.add(finding.code, finding.message, finding.hint, "denominator", *path)
        findings.stop()
        return self


class ContinuousTarget(ContinuousMatrix):
    """A transfer matrix in s that is written as one."""

    numerator: RowsMatrix = Field(description="Rows (outputs) of columns of coefficients.")


class ContinuousMatrixTransfer(Section, family="transfer", phrase="a continuous-time transfer matrix"):
    """A transfer matrix in s, sampled with a zero-order hold."""

    continuous: ContinuousTarget = Field(description="numerator and denominator in descending powers of s.")
    sample: Literal["zoh"] | None = Field(default=None, description="How it is sampled: zoh.")


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
    Discriminator(picker(_target_kind)),
    needs_mapping(
        "{continuous: {numerator: [1], denominator: [10, 1]}}, or the same in q^-1 or with matrices"
    ),
]
"""t(q) I from one transfer function, or a square matrix."""


def _yes(value: Any) -> bool:
    if value is True:
        return True
    raise fail(
        "out-of-range",
        f"{{key}} can only be true, not {describe(value)}",
        "remove the key to choose another law",
    )


Yes = Annotated[bool, PlainValidator(_yes), WithJsonSchema({"const": True})]


def _check_stable(findings: Findings, transfer: ContinuousTransfer | DiscreteTransfer, key: str) -> None:
    continuous = isinstance(transfer, ContinuousTransfer)
    ratio: Ratio = transfer.continuous if isinstance(transfer, ContinuousTransfer) else transfer
    path = (key, "continuous", "denominator") if continuous else (key, "denominator")
    check = check_left_half_plane if continuous else check_delay_stable
    for i, factor in enumerate(ratio.denominator_factors):
        if finding := check(factor):
            where = (*path, i) if len(ratio.denominator_factors) > 1 else path
            findings.add(finding.code, finding.message, finding.hint, *where)


class Control(Section):
    """The control law that will be computed from the model: exactly one."""

    model_reference: Target | None = Field(
        default=None,
        description="Desired loop from reference to output: t I, or a matrix; from s by a zero-order hold.",
    )
    internal_model: Transfer | None = Field(
        default=None, description="Filter of an internal-model controller."
    )
    minimum_variance: Yes | None = Field(default=None, description="true: minimum-variance control.")

    @model_validator(mode="after")
    def _one(self) -> Control:
        findings = Findings()
        exactly_one(findings, self, "model_reference", "internal_model", "minimum_variance")
        for key in ("model_reference", "internal_model"):
            transfer = getattr(self, key)
            if isinstance(transfer, ContinuousTransfer | DiscreteTransfer):
                _check_stable(findings, transfer, key)
        findings.stop()
        return self


class Reference(Section):
    """The reference that the closed loop will follow: white noise, filtered."""

    variance: PositivePerChannel = Field(default=1.0, description="Variance; a number or one per output.")
    filter: Transfer | None = Field(default=None, description="Filter that colours it (default 1).")

    @model_validator(mode="after")
    def _stable(self) -> Reference:
        findings = Findings()
        if self.filter is not None:
            _check_stable(findings, self.filter, "filter")
        findings.stop()
        return self


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
