"""Transfer functions and matrices of them: in the delay q^-1, or in s under a key `continuous:`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal, cast

from pydantic import Field

from inputdesign_cli.specification.models.fields import (
    ContinuousDenominator,
    Denominator,
    GainMatrix,
    Numerator,
    Polynomial,
    PolynomialList,
    PolynomialMatrix,
    RowsMatrix,
    check_delay_stable,
    check_left_half_plane,
    depth,
    product,
)
from inputdesign_cli.specification.models.named import TermMatrix, expressed
from inputdesign_cli.specification.models.section import PathDiagnostic, Section, Wording, optional, pick
from inputdesign_cli.specification.models.shapes import (
    as_matrix,
    check_each,
    check_gain,
    check_proper,
    check_shapes,
    denominators_of,
)
from inputdesign_cli.specification.yaml.plain import Plain


class Ratio(Section):
    """numerator / denominator, in s or in q^-1."""

    numerator: Numerator = Field(description="Coefficients of the numerator.")
    denominator: Denominator = Field(
        default=(1.0,), description="Coefficients of the denominator, or a list of factors (default 1)."
    )

    @property
    def denominator_factors(self) -> tuple[Polynomial, ...]:
        """The factors of the denominator as written."""
        return cast(PolynomialList, self.denominator if depth(self.denominator) == 2 else (self.denominator,))

    @property
    def denominator_polynomial(self) -> Polynomial:
        """The product of the factors."""
        return product(self.denominator_factors)


class DiscreteTransfer(Ratio, family="transfer", phrase="a transfer function in q^-1"):
    """A transfer function in the delay operator: coefficients in ascending powers of q^-1."""

    kind: ClassVar[Literal["discrete"]] = "discrete"


class ContinuousRatio(Ratio):
    """A proper transfer function in s: coefficients in descending powers of s."""

    def check(self) -> Iterator[PathDiagnostic]:
        """It is proper."""
        yield from check_proper(expressed(self.numerator), len(self.denominator_polynomial) - 1, "numerator")


class ContinuousTransfer(Section, family="transfer", phrase="a continuous-time transfer function"):
    """A transfer function in s, and how it is sampled."""

    kind: ClassVar[Literal["continuous"]] = "continuous"

    continuous: ContinuousRatio = Field(description="numerator and denominator in descending powers of s.")
    sample: Literal["zoh"] | None = optional("How it is sampled at sample_time: zoh, a zero-order hold.")


class TransferMatrix(Section):
    """numerator / denominator entry by entry, in s or in q^-1."""

    numerator: GainMatrix = Field(description="Coefficients; a matrix is rows (outputs) of columns (inputs).")
    denominator: ContinuousDenominator = Field(
        description="One polynomial for all entries, a list of its factors, or one polynomial per entry."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Some coefficient is not zero, and numerator and denominator have one shape."""
        yield from check_gain(expressed(self.numerator_matrix), "numerator")
        yield from check_shapes(self.numerator, self.denominator)

    @property
    def numerator_matrix(self) -> PolynomialMatrix:
        """The numerators as rows (outputs) of columns (inputs)."""
        return as_matrix(self.numerator)

    @property
    def denominator_matrix(self) -> PolynomialMatrix:
        """The denominators in the same form, factors multiplied out."""
        return denominators_of(self.numerator, self.denominator)


class DiscreteMatrix(TransferMatrix, family="transfer", phrase="a transfer matrix in q^-1"):
    """A transfer matrix in the delay operator: coefficients in ascending powers of q^-1."""

    kind: ClassVar[Literal["discrete_matrix"]] = "discrete_matrix"

    numerator: RowsMatrix = Field(description="Rows of columns of coefficients.")
    denominator: ContinuousDenominator = Field(
        default=(1.0,), description="One polynomial for all entries, its factors, or one per entry."
    )


def check_each_proper(above: TermMatrix, below: PolynomialMatrix, levels: int) -> Iterator[PathDiagnostic]:
    """Every entry of a matrix in s is proper; `levels` is the nesting of its numerator as written."""
    for i, row in enumerate(above):
        for j, entry in enumerate(row):
            where = (i, j) if levels == 3 else ()
            yield from check_proper(entry, len(below[i][j]) - 1, "numerator", *where)


class ContinuousTarget(TransferMatrix):
    """A stable transfer matrix in s that is written as one, coefficients in descending powers."""

    numerator: RowsMatrix = Field(description="Rows (outputs) of columns of coefficients.")

    def check(self) -> Iterator[PathDiagnostic]:
        """Numerator and denominator have one shape, the poles lie on the left, every entry is proper."""
        if shapes := list(super().check()):
            yield from shapes
            return
        yield from check_each(self.denominator, check_left_half_plane, "denominator")
        yield from check_each_proper(expressed(self.numerator_matrix), self.denominator_matrix, 3)


class ContinuousMatrixTransfer(Section, family="transfer", phrase="a continuous-time transfer matrix"):
    """A transfer matrix in s, sampled with a zero-order hold."""

    kind: ClassVar[Literal["continuous_matrix"]] = "continuous_matrix"

    continuous: ContinuousTarget = Field(description="numerator and denominator in descending powers of s.")
    sample: Literal["zoh"] | None = optional("How it is sampled: zoh.")


def transfer_kind(value: dict[str, Plain]) -> str:
    """Whether a mapping of the file is in q^-1 or in s."""
    return ContinuousTransfer.phrase if "continuous" in value else DiscreteTransfer.phrase


def _target_kind(value: dict[str, Plain]) -> str:
    inside = value.get("continuous", value)
    if depth(inside.get("numerator") if isinstance(inside, dict) else None) < 2:
        return transfer_kind(value)
    return ContinuousMatrixTransfer.phrase if "continuous" in value else DiscreteMatrix.phrase


Transfer = Annotated[
    DiscreteTransfer | ContinuousTransfer,
    pick(transfer_kind),
    Wording(
        "a mapping of keys",
        "write {numerator: [..], denominator: [..]} in q^-1, or "
        "{continuous: {numerator: [..], denominator: [..]}}",
    ),
]
"""A filter or weight, in q^-1 or in s."""

Target = Annotated[
    DiscreteTransfer | ContinuousTransfer | DiscreteMatrix | ContinuousMatrixTransfer,
    pick(_target_kind),
    Wording(
        "a mapping of keys",
        "write {continuous: {numerator: [1], denominator: [10, 1]}}, or the same in q^-1 or with matrices",
    ),
]
"""t(q) I from one transfer function, or a square matrix."""


def check_stable(transfer: Target, *path: str) -> Iterator[PathDiagnostic]:
    """The poles of the transfer function at `path` are stable; a matrix in s has its own check."""
    if transfer.kind == "continuous":
        inside = (*path, "continuous", "denominator")
        yield from check_each(transfer.continuous.denominator, check_left_half_plane, *inside)
    elif transfer.kind != "continuous_matrix":
        yield from check_each(transfer.denominator, check_delay_stable, *path, "denominator")
