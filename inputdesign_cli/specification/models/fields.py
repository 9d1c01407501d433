"""The types of the values of a spec: constraints of pydantic, conditions on bands, matrices and polynomials.

`pydantic_errors` words their errors. A union names its alternatives by tags, so that pydantic tries only one.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Annotated, Literal, TypeVar

import numpy as np
from pydantic import AfterValidator, AllowInfNan, BeforeValidator, Field, Strict, WithJsonSchema

from inputdesign_cli.specification.models.section import PathDiagnostic, Wording, by_tag, carry, fail, tag
from inputdesign_cli.specification.models.sizes import COEFFICIENT, DEVIATIONS, QUANTITY, SIZES, magnitude
from inputdesign_cli.specification.models.wording import show
from inputdesign_cli.specification.yaml.plain import Plain

Polynomial = tuple[float, ...]

# Coefficients with a relative sum below this have a root at z = 1; a radius this near to 1 is 1.
_ROUNDING = 1e-12


def product(factors: Iterable[Polynomial]) -> Polynomial:
    """Return the product of polynomials, all in ascending or all in descending powers."""
    with np.errstate(all="ignore"):
        full: np.ndarray = functools.reduce(np.convolve, (np.asarray(f) for f in factors), np.ones(1))
    return tuple(float(c) for c in full)


def check_not_zero(polynomial: Polynomial) -> PathDiagnostic | None:
    """Check that some coefficient differs from zero."""
    message, hint = "all coefficients of {key} are zero", "write at least one that is not"
    return None if any(polynomial) else PathDiagnostic("zero-polynomial", message, hint)


def check_leading(polynomial: Polynomial) -> PathDiagnostic | None:
    """Check that the first coefficient differs from zero."""
    message, hint = "{key} must not start with 0", "remove the leading zeros"
    wrong = PathDiagnostic("zero-leading-coefficient", message, hint)
    return check_not_zero(polynomial) or (wrong if polynomial[0] == 0.0 else None)


def check_monic(polynomial: Polynomial) -> PathDiagnostic | None:
    """Check that the first coefficient is exactly 1, in ascending powers of q^-1."""
    lead = polynomial[0]
    if lead == 1.0:
        return None
    hint = "it is a polynomial in q^-1, ascending: the first coefficient belongs to the power 0"
    if lead and polynomial[-1] == 1.0:
        hint = f"its coefficients ascend in q^-1: did you mean {_listed(polynomial[::-1])}?"
    elif lead:
        hint = f"divide all its coefficients by {show(lead)}: {_listed([c / lead for c in polynomial])}"
    return PathDiagnostic("not-monic", f"{{key}} must start with 1, not {show(lead)}", hint)


def _listed(coefficients: Sequence[float]) -> str:
    more = ", ..." if len(coefficients) > 6 else ""
    return f"[{', '.join(show(c) for c in coefficients[:6])}{more}]"


def check_delay_stable(polynomial: Polynomial) -> PathDiagnostic | None:
    """Check that all roots in z lie strictly inside the unit circle, for ascending powers of q^-1."""
    return _check_roots(polynomial, in_s=False)


def check_left_half_plane(polynomial: Polynomial) -> PathDiagnostic | None:
    """Check that all roots lie in the open left half plane, for descending powers of s."""
    return _check_roots(polynomial, in_s=True)


def check_no_growth(polynomial: Polynomial) -> PathDiagnostic | None:
    """Check that all roots in z lie in the unit circle, integrators at z = 1 aside (ascending in q^-1)."""
    rest = np.asarray(polynomial, dtype=float)
    while rest.size > 1 and abs(np.sum(rest)) <= _ROUNDING * np.sum(np.abs(rest)):
        rest = np.cumsum(rest)[:-1]  # divided by 1 - q^-1
    return check_delay_stable(tuple(rest.tolist()))


def check_no_growth_in_s(polynomial: Polynomial) -> PathDiagnostic | None:
    """Check that all roots lie in the open left half plane, integrators at s = 0 aside (descending in s)."""
    last = max((i for i, c in enumerate(polynomial) if c), default=0)
    return check_left_half_plane(polynomial[: last + 1])


def _check_roots(polynomial: Polynomial, *, in_s: bool) -> PathDiagnostic | None:
    """Return the diagnostic of the worst root, if it is unstable or cannot be computed."""
    try:
        with np.errstate(all="ignore"):
            roots = np.roots(np.asarray(polynomial, dtype=float))
    except np.linalg.LinAlgError:
        roots = np.full(1, np.nan)
    if not np.all(np.isfinite(roots)):
        message = "the roots of {key} cannot be computed: its coefficients are of too different magnitude"
        return PathDiagnostic("bad-polynomial", message, "rescale it, or choose another time unit")
    size = roots.real if in_s else np.abs(roots) - 1.0 + _ROUNDING
    if not np.any(size >= 0.0):
        return None
    worst = complex(roots[np.argmax(size)])
    if in_s:
        pair = f" +- {abs(worst.imag):.4g}j" if abs(worst.imag) > 1e-12 else ""
        root = f"at s = {worst.real + 0.0:.4g}{pair}; all poles must lie in the left half plane"
        hint = "check the signs, and that the powers of s descend: [1, 2, 3] is s^2 + 2 s + 3"
    else:
        place = f"radius {abs(worst):.6g} at {abs(float(np.angle(worst))):.4g} rad/sample"
        root = f"of {place}; all roots (in z) must lie inside the unit circle"
        hint = "check the signs, decimal points for commas, and that the coefficients ascend in q^-1"
        if 0.0 in polynomial[1:-1] and all(float(c).is_integer() for c in polynomial):
            hint += "; if 0,7 was meant for a number, write 0.7: a comma begins the next coefficient"
    return PathDiagnostic("unstable-polynomial", f"{{key}} has a root {root}", hint)


PolynomialList = tuple[Polynomial, ...]
PolynomialMatrix = tuple[tuple[Polynomial, ...], ...]
Matrix = tuple[tuple[float, ...], ...]
Nested = TypeVar("Nested", bound=tuple)


def depth(value: object) -> int:
    """Return the depth of nested lists: 0 for a number, 1 for a list of numbers."""
    if not isinstance(value, list | tuple):
        return 0
    return 1 + max((depth(v) for v in value), default=0)


def as_matrix(value: tuple) -> Plain:
    """Return one polynomial as a 1 x 1 matrix, and a matrix unchanged."""
    return value if depth(value) == 3 else ((value,),)


def with_paths(value: tuple) -> list[tuple[tuple[int, ...], Polynomial]]:
    """Return every polynomial of a nested value with its indices."""
    if depth(value) == 1:
        return [((), value)]
    return [((i, *path), p) for i, part in enumerate(value) for path, p in with_paths(part)]


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


def as_whole(value: object) -> object:
    """Return a whole float as an integer (500.0 as 500), and everything else unchanged."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def as_text(value: object) -> object:
    """Return an unquoted number, true or false as its text, and everything else unchanged."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value) if isinstance(value, int | float) else value


def rising(values: tuple[float, ...]) -> tuple[float, ...]:
    """Check that frequencies or harmonics increase."""
    for before, after in pairwise(values):
        if not before < after:
            message = f"{{key}} must increase: {show(after)} follows {show(before)}"
            raise fail("not-increasing", message, "sort the entries and remove repetitions")
    return values


def two_frequencies(value: object) -> object:
    """Check that a band has two ends."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise fail("bad-band", "{key} must be two frequencies, [low, high]", "write [0.01, 3.0]")
    return value


def ascending(band: tuple[float, float]) -> tuple[float, float]:
    """Check that a band is not empty."""
    if not band[0] < band[1]:
        message = f"{{key}} must ascend: {show(band[0])} is not below {show(band[1])}"
        raise fail("bad-band", message, "write [low, high]")
    return band


def same_columns(rows: Nested) -> Nested:
    """Check that the rows of a matrix of polynomials are equally long."""
    if len({len(row) for row in rows}) > 1:
        message = "the rows of {key} must have the same number of columns"
        hint = "one row per output, one column per input; write [0] where an input has no effect"
        raise fail("wrong-shape", message, hint)
    return rows


def product_exists(denominator: Nested) -> Nested:
    """Check that the factors of a denominator can be multiplied out; other nestings pass."""
    if depth(denominator) != 2:
        return denominator
    multiplied = product(denominator)
    SIZES["coefficients of a denominator"].check(multiplied)
    if not np.all(np.isfinite(multiplied)):
        message = "the product of the factors of {key} is too large"
        raise fail("bad-polynomial", message, "rescale the factors")
    return denominator


def symmetric(rows: Matrix) -> Matrix:
    """Check that a matrix is square and symmetric."""
    if any(len(row) != len(rows) for row in rows):
        raise fail("wrong-shape", f"{{key}} must be square: {len(rows)} rows of {len(rows)} entries")
    values = np.array(rows)
    for i, j in np.argwhere(np.tril(np.abs(values - values.T)) > 1e-9 * np.max(np.abs(values))):
        one, other = (f"({a + 1}, {b + 1}) is {show(rows[a][b])}" for a, b in ((i, j), (j, i)))
        raise fail("not-symmetric", f"{{key}} is not symmetric: entry {one} but {other}")
    return rows


def semidefinite(rows: Matrix) -> Matrix:
    """Check that a symmetric matrix has no negative eigenvalue beyond rounding."""
    values = np.array(rows)
    scale = float(np.max(np.abs(values)))
    if scale > 0.0 and np.linalg.eigvalsh(values / scale)[0] < -1e-9:
        message = "{key} must be positive semidefinite"
        raise fail("not-positive-definite", message, "check the signs of its entries")
    return rows


def positive_definite(rows: Matrix) -> Matrix:
    """Check that a covariance matrix is positive definite, by correlations: units do not matter."""
    values = np.array(rows)
    with np.errstate(all="ignore"):
        deviations = np.sqrt(np.diag(values))
        correlations = values / deviations / deviations[:, None]
    # A variance of zero, or below, makes entries that are not finite.
    if not np.all(np.isfinite(correlations)) or np.linalg.eigvalsh(correlations)[0] <= 0.0:
        message = "{key} is not a covariance matrix: it must be positive definite"
        hint = "each variance must be positive, and each covariance below the geometric mean of its variances"
        raise fail("not-positive-definite", message, hint)
    return rows


T = TypeVar("T")


def holds(check: Callable[[Polynomial], PathDiagnostic | None]) -> AfterValidator:
    """Return the validator that raises the diagnostic of a check of a polynomial."""

    def checked(polynomial: Polynomial) -> Polynomial:
        if found := check(polynomial):
            raise carry(found)
        return polynomial

    return AfterValidator(checked)


def nested(levels: int, what: str, hint: str) -> BeforeValidator:
    """Return the validator that refuses lists which are not nested `levels` deep."""

    def check(value: object) -> object:
        if depth(value) != levels:
            raise fail("wrong-shape", f"{{key}} must be {what}", hint)
        return value

    return BeforeValidator(check)


_WHOLE = BeforeValidator(as_whole)
_DEPTH = by_tag(lambda value: str(depth(value)))
_LIST_OR_NOT = by_tag(lambda value: "list" if depth(value) else "one")

# Single values
Number = Annotated[float, Strict(), AllowInfNan(False), COEFFICIENT]
Positive = Annotated[float, Strict(), AllowInfNan(False), Field(gt=0), QUANTITY]
NonNegative = Annotated[float, Strict(), AllowInfNan(False), Field(ge=0), QUANTITY]
Deviation = Annotated[
    float, Strict(), AllowInfNan(False), Field(gt=0), magnitude(*DEVIATIONS), Wording("a number")
]
CorrelationTime = Annotated[Positive, Wording("a number", "white noise has none: remove the key")]
Cap = Annotated[Positive, Wording("a number", "to have no limit, remove the key")]
Fraction = Annotated[Number, Field(ge=1e-9, lt=1)]  # a smaller probability is no requirement
Tolerance = Annotated[Number, Field(gt=0, lt=1e-2)]
Count = Annotated[int, Strict(), Field(ge=1, le=2**53), _WHOLE]
AtLeastTwo = Annotated[int, Strict(), Field(ge=2, le=2**53), _WHOLE]
Index = Annotated[int, Strict(), Field(ge=0, le=2**53), _WHOLE]
RegisterLength = Annotated[int, Strict(), Field(ge=2, le=32), _WHOLE]
Flag = Annotated[bool, Strict()]
Text = Annotated[
    str, Strict(), BeforeValidator(as_text), WithJsonSchema({"type": ["string", "number", "boolean"]})
]
FILE_FORMAT = "path"
"""The format by which the JSON schema marks the name of a file."""
FileName = Annotated[
    str,
    Strict(),
    Field(pattern=r"\S", json_schema_extra={"format": FILE_FORMAT}),
    Wording("the name of a file"),
]
FileOr = Annotated[
    Annotated[FileName, tag("file")] | Annotated[T, tag("matrix")],
    by_tag(lambda value: "file" if isinstance(value, str) else "matrix"),
]
"""The name of a file, or a matrix."""
Name = Annotated[str, Strict(), Field(pattern=r"\S"), Wording("a parameter name")]

# Lists
Several = Annotated[tuple[T, ...], Field(min_length=1)]
Numbers = Annotated[Several[Number], Wording("a list of numbers")]
Names = Annotated[Several[Name], Wording("a list of parameter names")]
PerChannel = Annotated[Annotated[T, tag("one")] | Annotated[Several[T], tag("list")], _LIST_OR_NOT]
"""One value, or a list with one per channel."""
Band = Annotated[tuple[NonNegative, NonNegative], BeforeValidator(two_frequencies), AfterValidator(ascending)]
Frequencies = Annotated[Several[NonNegative], AfterValidator(rising), Wording("a list of frequencies")]
Harmonics = Annotated[
    Annotated[Count, tag("count")]
    | Annotated[Literal["odd"], Wording("odd", "write odd, a number of harmonics, or a list"), tag("word")]
    | Annotated[Several[Index], AfterValidator(rising), tag("list")],
    by_tag(lambda value: "list" if depth(value) else "word" if isinstance(value, str) else "count"),
]
"""A number of harmonics of a period, "odd", or a list of harmonics."""

# Matrices of numbers
_ROWS = nested(2, "a matrix", "write rows: [[1, 0], [0, 1]]")
SymmetricMatrix = Annotated[Several[Several[Number]], _ROWS, AfterValidator(symmetric)]
SemidefiniteMatrix = Annotated[SymmetricMatrix, AfterValidator(semidefinite)]
CovarianceMatrix = Annotated[SymmetricMatrix, AfterValidator(positive_definite)]
Variance = Annotated[
    Annotated[Positive, Wording("a number", "noise without power needs no experiment"), tag("one")]
    | Annotated[CovarianceMatrix, tag("list")],
    _LIST_OR_NOT,
]
"""A variance, or a covariance matrix."""

# Polynomials, one or nested in lists: depth 1 is one, 2 a list, 3 rows of columns of them
_ONE = "a list of coefficients"
_PER_OUTPUT = Wording(f"{_ONE}, or a list of them, one per output")
_FACTORS = Wording(f"{_ONE}, or a list of factors")
_MATRIX = Wording(
    f"{_ONE}, or rows (outputs) of columns (inputs) of them",
    "for one input and one output write a list of coefficients: [0, 1]; for several, rows of columns of "
    "them: [[[0, 1], [0, 2]]]",
)
_CONTINUOUS = Wording(f"{_ONE}, or a list of factors, or rows (outputs) of columns (inputs) of coefficients")
_Coefficient = Annotated[
    Number, Wording("a number", "names of parameters stand in a plant with parameters: {K: 2.1}")
]
_Coefficients = Annotated[Several[_Coefficient], SIZES["coefficients of a numerator"], Wording(_ONE)]
_Rooted = Annotated[Several[_Coefficient], SIZES["coefficients of a denominator"], Wording(_ONE)]
_Monic = Annotated[_Rooted, holds(check_monic)]
_Stable = Annotated[_Monic, holds(check_delay_stable)]
_Leading = Annotated[_Rooted, holds(check_leading)]
_Channels = Annotated[Several[T], SIZES["inputs or outputs"]]
_Rows = Annotated[_Channels[_Channels[T]], AfterValidator(same_columns)]
_Grid = Annotated[
    Annotated[T, tag("0")] | Annotated[_Rows[T], tag("2")],
    _DEPTH,
    Wording("a number, or rows (outputs) of columns (inputs) of numbers", "write 25, or [[1, 3], [7, 3]]"),
]
_OneOrList = Annotated[Annotated[T, tag("1")] | Annotated[Several[T], tag("2")], _DEPTH]
_OneOrRows = Annotated[Annotated[T, tag("1")] | Annotated[_Rows[T], tag("3")], _DEPTH]

Numerator = Annotated[_Coefficients, holds(check_not_zero)]
Denominator = Annotated[_OneOrList[_Leading], AfterValidator(product_exists), _FACTORS]
"""One polynomial or a list of factors, in q^-1 or in s."""
MonicPerOutput = Annotated[_OneOrList[_Monic], _PER_OUTPUT]
StablePerOutput = Annotated[_OneOrList[_Stable], _PER_OUTPUT]
StableMatrix = Annotated[_OneOrRows[Annotated[_Monic, holds(check_no_growth)]], _MATRIX]
"""A stable polynomial, integrators aside, or a matrix of them."""
GainMatrix = Annotated[_OneOrRows[_Coefficients], _MATRIX]
RowsMatrix = Annotated[
    _Rows[_Coefficients],
    nested(3, "rows (outputs) of columns (inputs) of coefficients", "write [[[0, 1], [0, 2]]]"),
]
"""A matrix of polynomials, never a single one."""
NumberGrid = _Grid[Number]
PositiveGrid = _Grid[Positive]
NonNegativeGrid = _Grid[NonNegative]
"""One number, or one for each entry of a transfer matrix."""
ContinuousDenominator = Annotated[
    Annotated[_Leading, tag("1")]
    | Annotated[Several[_Leading], tag("2")]
    | Annotated[_Rows[_Leading], tag("3")],
    _DEPTH,
    AfterValidator(product_exists),
    _CONTINUOUS,
]
