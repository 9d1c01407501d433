"""Matrices of transfer functions in q^-1, and the controller of an experiment."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from inputdesign_cli.specification.models.annotations import Wording
from inputdesign_cli.specification.models.fields import ContinuousDenominator, RowsMatrix
from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.section import Section, pick, tag
from inputdesign_cli.specification.models.shapes import check_shapes, denominators_of
from inputdesign_cli.specification.models.transfer import DiscreteTransfer
from inputdesign_cli.specification.models.values import PolynomialMatrix, depth


class MatrixRatio(Section):
    """numerator / denominator entry by entry: coefficients in ascending powers of q^-1."""

    numerator: RowsMatrix = Field(description="Rows of columns of coefficients.")
    denominator: ContinuousDenominator = Field(
        default=(1.0,), description="One polynomial for all entries, its factors, or one per entry."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Numerator and denominator have one shape."""
        yield from check_shapes(self.numerator, self.denominator)

    @property
    def numerator_matrix(self) -> PolynomialMatrix:
        """Rows of columns of coefficients."""
        return self.numerator

    @property
    def denominator_matrix(self) -> PolynomialMatrix:
        """The denominators in the same form, factors multiplied out."""
        return denominators_of(self.numerator, self.denominator)


class ControllerMatrix(MatrixRatio, family="transfer", phrase="a controller of several channels"):
    """C of u = r - C y: rows are inputs of the plant, columns its outputs."""

    kind: ClassVar[Literal["discrete_matrix"]] = "discrete_matrix"


def _kind(value: dict[str, Any]) -> str:
    return ControllerMatrix.phrase if depth(value.get("numerator")) > 1 else DiscreteTransfer.phrase


Controller = Annotated[
    Annotated[DiscreteTransfer, tag(DiscreteTransfer.phrase)]
    | Annotated[ControllerMatrix, tag(ControllerMatrix.phrase)],
    pick(_kind),
    Wording(
        "a mapping of keys",
        "write {numerator: [..], denominator: [..]} in q^-1; with several channels rows of columns of them",
    ),
]
"""C of a loop: one transfer function, or a matrix of them."""
