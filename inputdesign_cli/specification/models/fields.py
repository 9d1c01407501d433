"""The types of the values of a spec, with pydantic's constraints; `pydantic_errors` words what they refuse.

A union names its alternatives by tags, so that pydantic tries only the one that is meant.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Literal, TypeVar

from pydantic import (
    AfterValidator,
    AllowInfNan,
    BeforeValidator,
    Discriminator,
    Field,
    Strict,
    WithJsonSchema,
)

from inputdesign_cli.specification.models.section import TAG, PathDiagnostic, Wording, carry, fail, tag
from inputdesign_cli.specification.models.sizes import COEFFICIENT, QUANTITY, SIZES
from inputdesign_cli.specification.models.units import FRACTION, FREQUENCY, SIGNAL, TIME
from inputdesign_cli.specification.models.values import (
    Polynomial,
    as_text,
    as_whole,
    ascending,
    check_delay_stable,
    check_leading,
    check_monic,
    check_no_growth,
    check_not_zero,
    depth,
    positive_definite,
    product_exists,
    rising,
    same_columns,
    semidefinite,
    symmetric,
    two_frequencies,
)

T = TypeVar("T")


def holds(check: Callable[[Polynomial], PathDiagnostic | None]) -> AfterValidator:
    """The validator that raises what a check of a polynomial finds."""

    def checked(polynomial: Polynomial) -> Polynomial:
        if found := check(polynomial):
            raise carry(found)
        return polynomial

    return AfterValidator(checked)


def nested(levels: int, what: str, hint: str) -> BeforeValidator:
    """The validator that refuses lists which are not nested `levels` deep."""

    def check(value: object) -> object:
        if depth(value) != levels:
            raise fail("wrong-shape", f"{{key}} must be {what}", hint)
        return value

    return BeforeValidator(check)


_WHOLE = BeforeValidator(as_whole)
_DEPTH = Discriminator(lambda value: f"{TAG}{depth(value)}")
_LIST_OR_NOT = Discriminator(lambda value: TAG + ("list" if depth(value) else "one"))

# Single values
Number = Annotated[float, Strict(), AllowInfNan(False), COEFFICIENT]
Positive = Annotated[float, Strict(), AllowInfNan(False), Field(gt=0), QUANTITY]
NonNegative = Annotated[float, Strict(), AllowInfNan(False), Field(ge=0), QUANTITY]
Cap = Annotated[Positive, Wording("a number", "to have no limit, remove the key")]
Time = Annotated[Positive, TIME]
Level = Annotated[Cap, SIGNAL]
"""A bound on samples of a signal, in its unit."""
Fraction = Annotated[Number, Field(ge=1e-9, lt=1), FRACTION]  # a smaller probability is no requirement
Tolerance = Annotated[Number, Field(gt=0, lt=1e-2), FRACTION]
Count = Annotated[int, Strict(), Field(ge=1, le=2**53), _WHOLE]
AtLeastTwo = Annotated[int, Strict(), Field(ge=2, le=2**53), _WHOLE]
Index = Annotated[int, Strict(), Field(ge=0, le=2**53), _WHOLE]
RegisterLength = Annotated[int, Strict(), Field(ge=2, le=32), _WHOLE]
Flag = Annotated[bool, Strict()]
Text = Annotated[
    str, Strict(), BeforeValidator(as_text), WithJsonSchema({"type": ["string", "number", "boolean"]})
]
FILE_FORMAT = "path"
"""What the JSON schema calls a text that names a file."""
FileName = Annotated[
    str,
    Strict(),
    Field(pattern=r"\S", json_schema_extra={"format": FILE_FORMAT}),
    Wording("the name of a file"),
]
Name = Annotated[str, Strict(), Field(pattern=r"\S"), Wording("a parameter name")]

# Lists
Several = Annotated[tuple[T, ...], Field(min_length=1)]
Numbers = Annotated[Several[Number], Wording("a list of numbers")]
Names = Annotated[Several[Name], Wording("a list of parameter names")]
PerChannel = Annotated[Annotated[T, tag("one")] | Annotated[Several[T], tag("list")], _LIST_OR_NOT]
"""One value, or a list with one per channel."""
Band = Annotated[
    tuple[NonNegative, NonNegative], BeforeValidator(two_frequencies), AfterValidator(ascending), FREQUENCY
]
Frequencies = Annotated[
    Several[NonNegative], AfterValidator(rising), Wording("a list of frequencies"), FREQUENCY
]
Harmonics = Annotated[
    Annotated[Count, tag("count")]
    | Annotated[Literal["odd"], Wording("odd", "write odd, a number of harmonics, or a list"), tag("word")]
    | Annotated[Several[Index], AfterValidator(rising), tag("list")],
    Discriminator(
        lambda value: TAG + ("list" if depth(value) else "word" if isinstance(value, str) else "count")
    ),
]
"""How many harmonics of a period, "odd", or which."""

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
"""One polynomial or a list of factors, in whatever variable."""
MonicPerOutput = Annotated[_OneOrList[_Monic], _PER_OUTPUT]
StablePerOutput = Annotated[_OneOrList[_Stable], _PER_OUTPUT]
StableMatrix = Annotated[_OneOrRows[Annotated[_Monic, holds(check_no_growth)]], _MATRIX]
"""Stable but for integrators."""
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
