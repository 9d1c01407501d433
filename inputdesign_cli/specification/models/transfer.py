"""Transfer functions and matrices of them: in the delay q^-1, or in s under a key `continuous:`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Annotated, ClassVar, Literal, cast

import numpy as np
from pydantic import Field

from inputdesign_cli.specification.models import fields
from inputdesign_cli.specification.models.named import TermMatrix, expressed, leading
from inputdesign_cli.specification.models.section import PathDiagnostic, Section, Wording, optional, pick
from inputdesign_cli.specification.models.wording import count
from inputdesign_cli.specification.yaml.plain import Plain


def check_shapes(numerator: tuple, denominator: tuple) -> Iterator[PathDiagnostic]:
    """Check that denominators for each entry have the shape of the numerator."""
    if fields.depth(denominator) == 3 and fields.size_of(denominator) != fields.size_of(numerator):
        message = "{key} must have the shape of the numerator: " + fields.shape_words(numerator)
        hint = "or write one polynomial, a denominator common to all entries"
        yield PathDiagnostic("wrong-shape", message, hint, ("denominator",))


def check_each(
    value: tuple, check: Callable[[fields.Polynomial], PathDiagnostic | None], *path: str
) -> Iterator[PathDiagnostic]:
    """Yield the diagnostics of a check of each polynomial of the value at `path`."""
    for indices, polynomial in fields.with_paths(value):
        if found := check(polynomial):
            yield replace(found, path=(*path, *indices))


def check_per_output(value: tuple, outputs: int, *path: str) -> Iterator[PathDiagnostic]:
    """Check that a list of polynomials at `path` has one for each output."""
    if fields.depth(value) == 2 and len(value) != outputs:
        message = f"{{key}} holds {count(len(value), 'polynomial')} for {count(outputs, 'output')}"
        hint = "write one polynomial for all outputs, or a list with one per output"
        yield PathDiagnostic("wrong-shape", message, hint, path)


def check_gain(entries: TermMatrix, *path: str) -> Iterator[PathDiagnostic]:
    """Check that some coefficient at `path` is present."""
    if not any(one.present for row in entries for p in row for one in p):
        message = "all coefficients of {key} are zero: the input has no effect"
        yield PathDiagnostic("zero-polynomial", message, path=path)


def check_proper(
    above: TermMatrix, below: fields.PolynomialMatrix, levels: int, *path: str
) -> Iterator[PathDiagnostic]:
    """Check that every entry is proper, descending in s; `levels` is the depth of nesting as written."""
    for (i, j), terms in ((at, above[at[0]][at[1]]) for at in np.ndindex(fields.size_of(below))):
        high, low = len(terms) - leading(terms) - 1, len(below[i][j]) - 1
        if high > low:
            message = f"{{key}} has degree {high} in s, more than its denominator ({low}): it is not proper"
            hint = "powers of s descend: [2, 1] is 2 s + 1; lower this degree or raise the other"
            yield PathDiagnostic(
                "improper-transfer", message, hint, (*path, *((i, j) if levels == 3 else ()))
            )


class Ratio(Section):
    """numerator / denominator, in s or in q^-1."""

    numerator: fields.Numerator = Field(description="Coefficients of the numerator.")
    denominator: fields.Denominator = Field(
        default=(1.0,), description="Coefficients of the denominator, or a list of factors (default 1)."
    )

    @property
    def denominator_factors(self) -> tuple[fields.Polynomial, ...]:
        """Return the factors of the denominator as written."""
        return cast(
            fields.PolynomialList,
            self.denominator if fields.depth(self.denominator) == 2 else (self.denominator,),
        )

    @property
    def denominator_polynomial(self) -> fields.Polynomial:
        """Return the denominator as the product of its factors."""
        return fields.product(self.denominator_factors)


class DiscreteTransfer(Ratio, family="transfer", phrase="a transfer function in q^-1"):
    """A transfer function in the delay operator: coefficients in ascending powers of q^-1."""

    kind: ClassVar[Literal["discrete"]] = "discrete"


class ContinuousRatio(Ratio):
    """A proper transfer function in s: coefficients in descending powers of s."""

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that the transfer function is proper."""
        above, below = ((expressed(self.numerator),),), ((self.denominator_polynomial,),)
        yield from check_proper(above, below, 1, "numerator")


class ContinuousTransfer(Section, family="transfer", phrase="a continuous-time transfer function"):
    """A transfer function in s, and how it is sampled."""

    kind: ClassVar[Literal["continuous"]] = "continuous"

    continuous: ContinuousRatio = Field(description="numerator and denominator in descending powers of s.")
    sample: Literal["zoh"] | None = optional("How it is sampled at sample_time: zoh, a zero-order hold.")


class TransferMatrix(Section):
    """numerator / denominator entry by entry, in s or in q^-1."""

    numerator: fields.GainMatrix = Field(description="Coefficients; rows (outputs) of columns (inputs).")
    denominator: fields.ContinuousDenominator = Field(
        default=(1.0,), description="One polynomial for all entries, its factors, or one per entry."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that some coefficient is not zero, and that numerator and denominator have one shape."""
        yield from check_gain(expressed(self.numerator_matrix), "numerator")
        yield from check_shapes(self.numerator, self.denominator)

    @property
    def numerator_matrix(self) -> fields.PolynomialMatrix:
        """Return the numerators as rows (outputs) of columns (inputs)."""
        return fields.as_matrix(self.numerator)

    @property
    def denominator_matrix(self) -> fields.PolynomialMatrix:
        """Return the table of denominators, a row for each output, with factors multiplied out."""
        if fields.depth(self.denominator) == 3:
            return fields.as_matrix(self.denominator)
        common = fields.product(factor for _, factor in fields.with_paths(self.denominator))
        return tuple(tuple(common for _ in row) for row in self.numerator_matrix)


class TransferRows(TransferMatrix):
    """A transfer matrix that is written as rows of columns, never as one polynomial."""

    numerator: fields.RowsMatrix = Field(description="Rows (outputs) of columns (inputs) of coefficients.")


class DiscreteMatrix(TransferRows, family="transfer", phrase="a transfer matrix in q^-1"):
    """A transfer matrix in the delay operator: coefficients in ascending powers of q^-1."""

    kind: ClassVar[Literal["discrete_matrix"]] = "discrete_matrix"


class ContinuousMatrixTransfer(Section, family="transfer", phrase="a continuous-time transfer matrix"):
    """A transfer matrix in s, sampled with a zero-order hold."""

    kind: ClassVar[Literal["continuous_matrix"]] = "continuous_matrix"

    continuous: TransferRows = Field(description="numerator and denominator in descending powers of s.")
    sample: Literal["zoh"] | None = optional("How it is sampled: zoh.")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that every entry is proper."""
        above, below = expressed(self.continuous.numerator_matrix), self.continuous.denominator_matrix
        yield from check_proper(above, below, 3, "continuous", "numerator")


def transfer_kind(value: dict[str, Plain]) -> str:
    """Return the tag of a transfer function as the file has it: in q^-1 or in s."""
    return ContinuousTransfer.phrase if "continuous" in value else DiscreteTransfer.phrase


def _target_kind(value: dict[str, Plain]) -> str:
    inside = value.get("continuous", value)
    if fields.depth(inside.get("numerator") if isinstance(inside, dict) else None) < 2:
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
    """Check that the poles of the transfer function at `path` are stable."""
    if transfer.kind == "continuous" or transfer.kind == "continuous_matrix":
        inside = (*path, "continuous", "denominator")
        yield from check_each(transfer.continuous.denominator, fields.check_left_half_plane, *inside)
    else:
        yield from check_each(transfer.denominator, fields.check_delay_stable, *path, "denominator")
