"""Transfer functions of a spec: in the delay q^-1, or in s under a key `continuous:`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal, cast

from pydantic import Field

from inputdesign_cli.specification.models.annotations import Wording
from inputdesign_cli.specification.models.fields import Denominator, Numerator
from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.polynomials import (
    Polynomial,
    check_delay_stable,
    check_left_half_plane,
    product,
)
from inputdesign_cli.specification.models.section import Section, pick, tag
from inputdesign_cli.specification.models.shapes import check_each, check_proper
from inputdesign_cli.specification.models.values import PolynomialList, depth


def factors_of(denominator: Polynomial | PolynomialList) -> PolynomialList:
    """The factors of a denominator; a single polynomial is its own only factor."""
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

    kind: ClassVar[Literal["discrete"]] = "discrete"

    def check_stable(self, *path: str) -> Iterator[PathDiagnostic]:
        """Its poles lie inside the unit circle; `path` leads to the transfer function."""
        yield from check_each(self.denominator, check_delay_stable, *path, "denominator")


class ContinuousRatio(Ratio):
    """A proper transfer function in s: coefficients in descending powers of s."""

    def check(self) -> Iterator[PathDiagnostic]:
        """It is proper."""
        yield from check_proper(self.numerator, self.denominator_polynomial, "numerator")


class ContinuousTransfer(Section, family="transfer", phrase="a continuous-time transfer function"):
    """A transfer function in s, and how it is sampled."""

    kind: ClassVar[Literal["continuous"]] = "continuous"

    continuous: ContinuousRatio = Field(description="numerator and denominator in descending powers of s.")
    sample: Literal["zoh"] | None = Field(
        default=None, description="How it is sampled at sample_time: zoh, a zero-order hold."
    )

    def check_stable(self, *path: str) -> Iterator[PathDiagnostic]:
        """Its poles lie in the left half plane; `path` leads to the transfer function."""
        yield from check_each(
            self.continuous.denominator, check_left_half_plane, *path, "continuous", "denominator"
        )


def transfer_kind(value: dict[str, Any]) -> str:
    """Which of the two a mapping of the file stands for."""
    return ContinuousTransfer.phrase if "continuous" in value else DiscreteTransfer.phrase


Transfer = Annotated[
    Annotated[DiscreteTransfer, tag(DiscreteTransfer.phrase)]
    | Annotated[ContinuousTransfer, tag(ContinuousTransfer.phrase)],
    pick(transfer_kind),
    Wording(
        "a mapping of keys",
        "write {numerator: [..], denominator: [..]} in q^-1, or "
        "{continuous: {numerator: [..], denominator: [..]}}",
    ),
]
"""A filter or weight, in q^-1 or in s."""
