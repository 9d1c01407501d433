"""Polynomials alone, in a list, or in rows (outputs) of columns (inputs), and the checks of such shapes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from inputdesign_cli.specification.models.fields import Polynomial, PolynomialMatrix, depth, product
from inputdesign_cli.specification.models.named import TermMatrix, Terms, leading
from inputdesign_cli.specification.models.section import PathDiagnostic
from inputdesign_cli.specification.models.wording import count


def as_matrix(value: tuple) -> PolynomialMatrix:
    """Return one polynomial as a 1 x 1 matrix, and a matrix unchanged."""
    return value if depth(value) == 3 else ((value,),)


def check_shapes(numerator: tuple, denominator: tuple) -> Iterator[PathDiagnostic]:
    """Denominators for each entry have the shape of the numerator."""
    if depth(denominator) == 3 and size_of(denominator) != size_of(as_matrix(numerator)):
        message = "{key} must have the shape of the numerator: " + shape_words(numerator)
        hint = "or write one polynomial, a denominator common to all entries"
        yield PathDiagnostic("wrong-shape", message, hint, ("denominator",))


def check_each(
    value: tuple, check: Callable[[Polynomial], PathDiagnostic | None], *path: str
) -> Iterator[PathDiagnostic]:
    """Yield the diagnostics of a check of each polynomial of the value at `path`."""
    for indices, polynomial in with_paths(value):
        if found := check(polynomial):
            yield replace(found, path=(*path, *indices))


def denominators_of(numerator: tuple, denominator: tuple) -> PolynomialMatrix:
    """Return denominators as rows of columns, common ones repeated and factors multiplied out."""
    if depth(denominator) == 3:
        return as_matrix(denominator)
    common = product(factor for _, factor in with_paths(denominator))
    return tuple(tuple(common for _ in row) for row in as_matrix(numerator))


def with_paths(value: tuple) -> list[tuple[tuple[int, ...], Polynomial]]:
    """Return every polynomial of a nested value with its indices."""
    if depth(value) == 1:
        return [((), value)]
    return [((i, *path), p) for i, part in enumerate(value) for path, p in with_paths(part)]


def check_per_output(value: tuple, outputs: int, *path: str) -> Iterator[PathDiagnostic]:
    """A list of polynomials at `path` has one for each output."""
    if depth(value) == 2 and len(value) != outputs:
        message = f"{{key}} holds {count(len(value), 'polynomial')} for {count(outputs, 'output')}"
        hint = "write one polynomial for all outputs, or a list with one per output"
        yield PathDiagnostic("wrong-shape", message, hint, path)


def check_gain(entries: TermMatrix, name: str) -> Iterator[PathDiagnostic]:
    """Some coefficient is present."""
    if not any(one.present for row in entries for p in row for one in p):
        message = "all coefficients of {key} are zero: the input has no effect"
        yield PathDiagnostic("zero-polynomial", message, path=(name,))


def size_of(value: tuple) -> tuple[int, int]:
    """Return the numbers of rows and columns."""
    entries = as_matrix(value)
    return len(entries), len(entries[0])


def shape_words(value: tuple) -> str:
    """Return the shape in words."""
    if depth(value) == 1:
        return "one list of coefficients"
    rows, columns = size_of(value)
    return f"{rows} x {columns} lists of coefficients"


def check_proper(numerator: Terms, degree: int, *path: str | int) -> Iterator[PathDiagnostic]:
    """In s, descending: the degree of the numerator is at most that of the denominator, `degree`."""
    above = len(numerator) - leading(numerator) - 1
    if above > degree:
        message = f"{{key}} has degree {above} in s, more than its denominator ({degree}): it is not proper"
        hint = "powers of s descend: [2, 1] is 2 s + 1; lower this degree or raise the other"
        yield PathDiagnostic("improper-transfer", message, hint, path)
