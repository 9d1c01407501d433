"""Transfer functions of a spec: in the delay q^-1, or in s under a key `continuous:`."""

from __future__ import annotations

from typing import Annotated, Literal, cast

from pydantic import Discriminator, Field, model_validator

from inputdesign_cli.specification.models.fields import Denominator, Numerator
from inputdesign_cli.specification.models.findings import Findings
from inputdesign_cli.specification.models.polynomials import Polynomial, product
from inputdesign_cli.specification.models.section import Section, needs_mapping, picker, tag
from inputdesign_cli.specification.models.values import PolynomialList, depth


def factors_of(denominator: Polynomial | PolynomialList) -> PolynomialList:
    """The factors of a denominator; one polynomial is its own only factor."""
    return cast(PolynomialList, denominator if depth(denominator) == 2 else (denominator,))


class Ratio(Section):
    """numerator / denominator, whatever the variable."""

    numerator: Numerator = Field(description="Coefficients of the numerator.")
    denominator: Denominator = Field(
        default=(1.0,), description="Coefficients of the denominator, or a list of factors (default 1)."
    )

    @property
    def denominator_factors(self) -> tuple[Polynomial, ...]:
        """The factors of the denominator as written."""
        return factors_of(self.denominator)

    @property
    def denominator_polynomial(self) -> Polynomial:
        """The product of the factors."""
        return product(self.denominator_factors)


class DiscreteTransfer(Ratio, family="transfer", phrase="a transfer function in q^-1"):
    """A transfer function in the delay operator: coefficients in ascending powers of q^-1."""


class ContinuousRatio(Ratio):
    """A proper transfer function in s: coefficients in descending powers of s."""

    @model_validator(mode="after")
    def _proper(self) -> ContinuousRatio:
        findings = Findings()
        check_proper(findings, self.numerator, self.denominator_polynomial, "numerator")
        findings.stop()
        return self


class ContinuousTransfer(Section, family="transfer", phrase="a continuous-time transfer function"):
    """A transfer function in s, and how it is sampled."""

    continuous: ContinuousRatio = Field(description="numerator and denominator in descending powers of s.")
    sample: Literal["zoh"] | None = Field(
        default=None, description="How it is sampled at sample_time: zoh, a zero-order hold."
    )


Transfer = Annotated[
    Annotated[DiscreteTransfer, tag(DiscreteTransfer.phrase)]
    | Annotated[ContinuousTransfer, tag(ContinuousTransfer.phrase)],
    Discriminator(
        picker(lambda v: ContinuousTransfer.phrase if "continuous" in v else DiscreteTransfer.phrase)
    ),
    needs_mapping(
        "{numerator: [..], denominator: [..]} in q^-1, or {continuous: {numerator: [..], denominator: [..]}}"
    ),
]
"""A filter or weight, in q^-1 or in s."""


def check_proper(
    findings: Findings, numerator: Polynomial, denominator: Polynomial, *path: str | int
) -> None:
    """In s, descending: the degree of the numerator is at most that of the denominator."""
    zeros = next((i for i, c in enumerate(numerator) if c), len(numerator) - 1)
    above, below = len(numerator) - zeros - 1, len(denominator) - 1
    if above > below:
        findings.add(
            "improper-transfer",
            f"{{key}} has degree {above} in s, more than its denominator ({below}): the system is not proper",
            "powers of s descend: [2, 1] is 2 s + 1; lower this degree or raise the other",
            *path,
        )
