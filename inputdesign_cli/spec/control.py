"""`accuracy.closed_loop_error:`, the control law whose loop the identified model will serve."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, WithJsonSchema, model_validator

from inputdesign_cli.spec.experiment import exactly_one
from inputdesign_cli.spec.fields import PositivePerChannel
from inputdesign_cli.spec.findings import Findings, describe, fail
from inputdesign_cli.spec.polynomials import check_delay_stable, check_left_half_plane
from inputdesign_cli.spec.section import Section
from inputdesign_cli.spec.transfer import ContinuousTransfer, Ratio, Transfer


def _yes(value: Any) -> bool:
    if value is True:
        return True
    raise fail(
        "out-of-range",
        f"{{key}} can only be true, not {describe(value)}",
        "remove the key to choose another law",
    )


Yes = Annotated[bool, PlainValidator(_yes), WithJsonSchema({"const": True})]


class Control(Section):
    """The control law that will be computed from the model: exactly one."""

    model_reference: Transfer | None = Field(
        default=None,
        description="Desired closed loop t(s) I from reference to output, sampled zero-order hold.",
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
            if transfer is None:
                continue
            continuous = isinstance(transfer, ContinuousTransfer)
            ratio: Ratio = transfer.continuous if continuous else transfer
            path = (key, "continuous", "denominator") if continuous else (key, "denominator")
            check = check_left_half_plane if continuous else check_delay_stable
            for i, factor in enumerate(ratio.denominator_factors):
                finding = check(factor)
                if finding:
                    where = (*path, i) if len(ratio.denominator_factors) > 1 else path
                    findings.add(finding.code, finding.message, finding.hint, *where)
        findings.stop()
        return self


class Reference(Section):
    """The reference that the closed loop will follow: white noise, filtered."""

    variance: PositivePerChannel = Field(default=1.0, description="Variance; a number or one per output.")
    filter: Transfer | None = Field(default=None, description="Filter that colours it (default 1).")


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
