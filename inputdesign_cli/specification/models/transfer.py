"""Transfer functions and matrices of them: in the delay q^-1, or in s under a key `continuous:`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Annotated, ClassVar, Literal, cast

from pydantic import Field

from inputdesign_cli.specification.models import fields
from inputdesign_cli.specification.models.named import TermMatrix, Terms, expressed, leading
from inputdesign_cli.specification.models.section import PathDiagnostic, Section, Wording, optional, pick
from inputdesign_cli.specification.models.wording import count
from inputdesign_cli.specification.yaml.plain import Plain


def as_matrix(value: tuple) -> Plain:
    """Return one polynomial as a 1 x 1 matrix, and a matrix unchanged."""
    return value if fields.depth(value) == 3 else ((value,),)


def check_shapes(numerator: tuple, denominator: tuple) -> Iterator[PathDiagnostic]:
    """Check that denominators for each entry have the shape of the numerator."""
    if fields.depth(denominator) == 3 and size_of(denominator) != size_of(as_matrix(numerator)):
        message = "{key} must have the shape of the numerator: " + shape_words(numerator)
        hint = "or write one polynomial, a denominator common to all entries"
        yield PathDiagnostic("wrong-shape", message, hint, ("denominator",))


def check_each(
    value: tuple, check: Callable[[fields.Polynomial], PathDiagnostic | None], *path: str
) -> Iterator[PathDiagnostic]:
    """Yield the diagnostics of a check of each polynomial of the value at `path`."""
    for indices, polynomial in with_paths(value):
        if found := check(polynomial):
            yield replace(found, path=(*path, *indices))


def denominators_of(numerator: tuple, denominator: tuple) -> fields.PolynomialMatrix:
    """Return denominators as rows of columns, common ones repeated and factors multiplied out."""
    if fields.depth(denominator) == 3:
        return as_matrix(denominator)
    common = fields.product(factor for _, factor in with_paths(denominator))
    return tuple(tuple(common for _ in row) for row in as_matrix(numerator))


def with_paths(value: tuple) -> list[tuple[tuple[int, ...], fields.Polynomial]]:
    """Return every polynomial of a nested value with its indices."""
    if fields.depth(value) == 1:
        return [((), value)]
    return [((i, *path), p) for i, part in enumerate(value) for path, p in with_paths(part)]


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


def size_of(value: tuple) -> tuple[int, int]:
    """Return the numbers of rows and columns."""
    entries = as_matrix(value)
    return len(entries), len(entries[0])


def shape_words(value: tuple) -> str:
    """Return the shape in words."""
    if fields.depth(value) == 1:
        return "one list of coefficients"
    rows, columns = size_of(value)
    return f"{rows} x {columns} lists of coefficients"


def check_proper(numerator: Terms, degree: int, *path: str | int) -> Iterator[PathDiagnostic]:
    """Check that the numerator has at most the degree of the denominator, `degree` (descending in s)."""
    above = len(numerator) - leading(numerator) - 1
    if above > degree:
        message = f"{{key}} has degree {above} in s, more than its denominator ({degree}): it is not proper"
        hint = "powers of s descend: [2, 1] is 2 s + 1; lower this degree or raise the other"
        yield PathDiagnostic("improper-transfer", message, hint, path)


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
        yield from check_proper(expressed(self.numerator), len(self.denominator_polynomial) - 1, "numerator")


class ContinuousTransfer(Section, family="transfer", phrase="a continuous-time transfer function"):
    """A transfer function in s, and how it is sampled."""

    kind: ClassVar[Literal["continuous"]] = "continuous"

    continuous: ContinuousRatio = Field(description="numerator and denominator in descending powers of s.")
    sample: Literal["zoh"] | None = optional("How it is sampled at sample_time: zoh, a zero-order hold.")


class TransferMatrix(Section):
    """numerator / denominator entry by entry, in s or in q^-1."""

    numerator: fields.GainMatrix = Field(description="Coefficients; rows (outputs) of columns (inputs).")
    denominator: fields.ContinuousDenominator = Field(
        description="One polynomial for all entries, a list of its factors, or one polynomial per entry."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that some coefficient is not zero, and that numerator and denominator have one shape."""
        yield from check_gain(expressed(self.numerator_matrix), "numerator")
        yield from check_shapes(self.numerator, self.denominator)

    @property
    def numerator_matrix(self) -> fields.PolynomialMatrix:
        """Return the numerators as rows (outputs) of columns (inputs)."""
        return as_matrix(self.numerator)

    @property
    def denominator_matrix(self) -> fields.PolynomialMatrix:
        """Return the denominators as rows of columns, factors multiplied out."""
        return denominators_of(self.numerator, self.denominator)


class DiscreteMatrix(TransferMatrix, family="transfer", phrase="a transfer matrix in q^-1"):
    """A transfer matrix in the delay operator: coefficients in ascending powers of q^-1."""

    kind: ClassVar[Literal["discrete_matrix"]] = "discrete_matrix"

    numerator: fields.RowsMatrix = Field(description="Rows of columns of coefficients.")
    denominator: fields.ContinuousDenominator = Field(
        default=(1.0,), description="One polynomial for all entries, its factors, or one per entry."
    )


def check_each_proper(
    above: TermMatrix, below: fields.PolynomialMatrix, levels: int, *path: str
) -> Iterator[PathDiagnostic]:
    """Check that every entry of a matrix in s is proper; `levels` is the nesting of the written numerator."""
    for i, row in enumerate(above):
        for j, entry in enumerate(row):
            where = (i, j) if levels == 3 else ()
            yield from check_proper(entry, len(below[i][j]) - 1, *path, *where)


class ContinuousTarget(TransferMatrix):
    """A stable transfer matrix in s that is written as one, coefficients in descending powers."""

    numerator: fields.RowsMatrix = Field(description="Rows (outputs) of columns of coefficients.")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that shapes agree, the poles lie in the left half plane, and every entry is proper."""
        if shapes := list(super().check()):
            yield from shapes
            return
        yield from check_each(self.denominator, fields.check_left_half_plane, "denominator")
        above = expressed(self.numerator_matrix)
        yield from check_each_proper(above, self.denominator_matrix, 3, "numerator")


class ContinuousMatrixTransfer(Section, family="transfer", phrase="a continuous-time transfer matrix"):
    """A transfer matrix in s, sampled with a zero-order hold."""

    kind: ClassVar[Literal["continuous_matrix"]] = "continuous_matrix"

    continuous: ContinuousTarget = Field(description="numerator and denominator in descending powers of s.")
    sample: Literal["zoh"] | None = optional("How it is sampled: zoh.")


def transfer_kind(value: dict[str, Plain]) -> str:
    """Return the tag of a mapping of the file: in q^-1 or in s."""
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
    """Check that the poles of the transfer function at `path` are stable; a matrix in s has its own check."""
    if transfer.kind == "continuous":
        inside = (*path, "continuous", "denominator")
        yield from check_each(transfer.continuous.denominator, fields.check_left_half_plane, *inside)
    elif transfer.kind != "continuous_matrix":
        yield from check_each(transfer.denominator, fields.check_delay_stable, *path, "denominator")
