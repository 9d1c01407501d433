"""What must hold of single values beyond their type; each function returns the value or raises."""

from __future__ import annotations

from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.specification.models.path_diagnostic import fail
from inputdesign_cli.specification.models.polynomials import Polynomial, product
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.wording import show

PolynomialList = tuple[Polynomial, ...]
PolynomialMatrix = tuple[tuple[Polynomial, ...], ...]
Matrix = tuple[tuple[float, ...], ...]
Nested = TypeVar("Nested", bound=tuple)


def depth(value: object) -> int:
    """How deeply lists are nested: 0 for a number, 1 for a list of numbers."""
    if not isinstance(value, list | tuple):
        return 0
    return 1 + max((depth(v) for v in value), default=0)


def as_whole(value: object) -> object:
    """500.0 as 500; everything else as it is."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def as_text(value: object) -> object:
    """An unquoted number, true or false as the text that it is; everything else as it is."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value) if isinstance(value, int | float) else value


def rising(values: tuple[float, ...]) -> tuple[float, ...]:
    """Frequencies or harmonics increase."""
    for before, after in pairwise(values):
        if not before < after:
            message = f"{{key}} must increase: {show(after)} follows {show(before)}"
            raise fail("not-increasing", message, "sort the entries and remove repetitions")
    return values


def two_frequencies(value: object) -> object:
    """A band has two ends."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        message = "{key} must be two frequencies, [low, high]"
        raise fail("bad-band", message, "write [0.01, 3.0]")
    return value


def ascending(band: tuple[float, float]) -> tuple[float, float]:
    """A band is not empty."""
    low, high = band
    if not low < high:
        message = f"{{key}} must ascend: {show(low)} is not below {show(high)}"
        raise fail("bad-band", message, "write [low, high]")
    return band


def same_columns(rows: Nested) -> Nested:
    """The rows of a matrix of polynomials are equally long."""
    if len({len(row) for row in rows}) > 1:
        lengths = ", ".join(str(len(row)) for row in rows)
        raise fail(
            "wrong-shape",
            f"the rows of {{key}} must have the same number of columns (they have {lengths})",
            "one row per output, one column per input; write [0] where an input has no effect",
        )
    return rows


def product_exists(denominator: Nested) -> Nested:
    """The factors of a denominator can be multiplied out; one polynomial or a matrix of them passes."""
    if depth(denominator) != 2:
        return denominator
    multiplied = product(denominator)
    SIZES["coefficients of a denominator"].check(multiplied)
    if not np.all(np.isfinite(multiplied)):
        message = "the product of the factors of {key} is too large"
        raise fail("bad-polynomial", message, "rescale the factors")
    return denominator


def symmetric(rows: Matrix) -> Matrix:
    """A matrix is square and symmetric."""
    for row in rows:
        if len(row) != len(rows):
            message = f"it has {len(rows)} rows, and one of them has {len(row)} entries"
            raise fail("wrong-shape", f"{{key}} must be square: {message}")
    values = np.array(rows)
    for i, j in np.argwhere(np.tril(np.abs(values - values.T)) > 1e-9 * np.max(np.abs(values))):
        entry, mirrored = (
            f"({i + 1}, {j + 1}) is {show(rows[i][j])}",
            f"({j + 1}, {i + 1}) is {show(rows[j][i])}",
        )
        raise fail("not-symmetric", f"{{key}} is not symmetric: entry {entry} but {mirrored}")
    return rows


def semidefinite(rows: Matrix) -> Matrix:
    """A symmetric matrix has no negative eigenvalue beyond rounding."""
    if _smallest_eigenvalue(rows) < -1e-9:
        message = "{key} must be positive semidefinite"
        raise fail("not-positive-definite", message, "check the signs of its entries")
    return rows


def positive_definite(rows: Matrix) -> Matrix:
    """A covariance matrix has positive eigenvalues, in whatever units: so has that of correlations."""
    values = np.array(rows)
    variances = np.diag(values)
    if np.any(variances <= 0.0) or not _has_positive_correlations(values, np.sqrt(variances)):
        raise fail(
            "not-positive-definite",
            "{key} is not a covariance matrix: it must be positive definite",
            "each variance must be positive, and each covariance below the geometric mean of its variances",
        )
    return rows


def _has_positive_correlations(values: NDArray[np.float64], deviations: NDArray[np.float64]) -> bool:
    with np.errstate(over="ignore"):
        correlations = values / deviations / deviations[:, None]
    return bool(np.all(np.isfinite(correlations)) and np.linalg.eigvalsh(correlations)[0] > 0.0)


def _smallest_eigenvalue(rows: Matrix) -> float:
    """The smallest eigenvalue of a symmetric matrix, relative to its largest entry (0 for a zero matrix)."""
    values = np.array(rows)
    scale = float(np.max(np.abs(values)))
    return float(np.linalg.eigvalsh(values / scale)[0]) if scale > 0 else 0.0
