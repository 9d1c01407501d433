"""The value types of a spec, for the models: plain Python types with the validators of `values`."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from pydantic import PlainValidator, WithJsonSchema

from inputdesign_cli.specification.models.polynomials import Polynomial, check_delay_stable, check_monic
from inputdesign_cli.specification.models.values import (
    Matrix,
    PolynomialList,
    PolynomialMatrix,
    band,
    denominator,
    flag,
    fraction,
    harmonics,
    matrix,
    name,
    not_zero,
    number,
    one_or_several,
    polynomial,
    polynomials,
    rising,
    several,
    text,
    whole,
)

_NUMBER = {"type": "number"}
_NUMBERS = {"type": "array", "items": _NUMBER, "minItems": 1}
_LISTS = {"type": "array", "items": _NUMBERS, "minItems": 1}
_ROWS = {"type": "array", "items": _LISTS, "minItems": 1}


def _any(*schemas: dict[str, Any]) -> WithJsonSchema:
    return WithJsonSchema({"anyOf": list(schemas)})


_POSITIVE = partial(number, above=0.0)
_POSITIVE_SCHEMA = {"type": "number", "exclusiveMinimum": 0}
_CAP = partial(number, above=0.0, hint="to have no limit, remove the key")
_WEIGHT = partial(number, least=0.0)
_WEIGHT_SCHEMA = {"type": "number", "minimum": 0}
_MONIC = {"check": (check_monic, check_delay_stable)}
_ONE = "a list of coefficients"
_PER_OUTPUT = {1: _ONE, 2: "a list of them, one per output"}
_MATRIX = {1: _ONE, 3: "rows (outputs) of columns (inputs) of them"}
_FACTORS = {1: _ONE, 2: "a list of factors"}
_CONTINUOUS = {1: _ONE, 2: "a list of factors", 3: "rows (outputs) of columns (inputs) of coefficient lists"}

Number = Annotated[float, PlainValidator(number), WithJsonSchema(_NUMBER)]
Positive = Annotated[float, PlainValidator(_POSITIVE), WithJsonSchema(_POSITIVE_SCHEMA)]
Cap = Annotated[float, PlainValidator(_CAP), WithJsonSchema(_POSITIVE_SCHEMA)]
NonNegative = Annotated[float, PlainValidator(_WEIGHT), WithJsonSchema(_WEIGHT_SCHEMA)]
Fraction = Annotated[
    float, PlainValidator(fraction), WithJsonSchema({**_POSITIVE_SCHEMA, "exclusiveMaximum": 1})
]
Tolerance = Annotated[
    float,
    PlainValidator(partial(number, above=0.0, below=1e-2)),
    WithJsonSchema({**_POSITIVE_SCHEMA, "exclusiveMaximum": 1e-2}),
]
Count = Annotated[
    int, PlainValidator(partial(whole, least=1)), WithJsonSchema({"type": "integer", "minimum": 1})
]
Index = Annotated[
    int, PlainValidator(partial(whole, least=0)), WithJsonSchema({"type": "integer", "minimum": 0})
]
RegisterLength = Annotated[
    int,
    PlainValidator(partial(whole, least=2, most=32)),
    WithJsonSchema({"type": "integer", "minimum": 2, "maximum": 32}),
]
Harmonics = Annotated[
    int | str | tuple[int, ...],
    PlainValidator(harmonics),
    _any(
        {"type": "integer", "minimum": 1},
        {"const": "odd"},
        {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 1},
    ),
]
"""How many harmonics of a period, "odd", or which."""
Flag = Annotated[bool, PlainValidator(flag), WithJsonSchema({"type": "boolean"})]
Text = Annotated[str, PlainValidator(text), WithJsonSchema({"type": ["string", "number", "boolean"]})]
FileName = Annotated[
    str,
    PlainValidator(partial(name, what="the name of a file")),
    WithJsonSchema({"type": "string", "minLength": 1}),
]
Numbers = Annotated[
    tuple[float, ...], PlainValidator(partial(several, item=number, what="numbers")), WithJsonSchema(_NUMBERS)
]
Positives = Annotated[
    tuple[float, ...],
    PlainValidator(partial(several, item=_POSITIVE, what="numbers above 0")),
    WithJsonSchema({"type": "array", "items": _POSITIVE_SCHEMA, "minItems": 1}),
]
Names = Annotated[
    tuple[str, ...],
    PlainValidator(partial(several, item=partial(name, what="a parameter name"), what="parameter names")),
    WithJsonSchema({"type": "array", "items": {"type": "string"}, "minItems": 1}),
]
PerChannel = Annotated[
    float | tuple[float, ...],
    PlainValidator(partial(one_or_several, item=number, what="numbers, one per channel")),
    _any(_NUMBER, _NUMBERS),
]
PositivePerChannel = Annotated[
    float | tuple[float, ...],
    PlainValidator(partial(one_or_several, item=_CAP, what="numbers, one per channel")),
    _any(_POSITIVE_SCHEMA, {"type": "array", "items": _POSITIVE_SCHEMA}),
]
WeightPerChannel = Annotated[
    float | tuple[float, ...],
    PlainValidator(partial(one_or_several, item=_WEIGHT, what="weights, one per channel")),
    _any(_WEIGHT_SCHEMA, {"type": "array", "items": _WEIGHT_SCHEMA}),
]
Band = Annotated[
    tuple[float, float],
    PlainValidator(band),
    WithJsonSchema({"type": "array", "items": _WEIGHT_SCHEMA, "minItems": 2, "maxItems": 2}),
]
Frequencies = Annotated[
    tuple[float, ...],
    PlainValidator(rising),
    WithJsonSchema({"type": "array", "items": _WEIGHT_SCHEMA, "minItems": 1}),
]
SymmetricMatrix = Annotated[Matrix, PlainValidator(matrix), WithJsonSchema(_LISTS)]
Numerator = Annotated[
    Polynomial, PlainValidator(partial(polynomial, check=(not_zero,))), WithJsonSchema(_NUMBERS)
]
Denominator = Annotated[
    Polynomial | PolynomialList,
    PlainValidator(partial(denominator, depths=_FACTORS)),
    _any(_NUMBERS, _LISTS),
]
"""One polynomial or a list of factors, in whatever variable."""
MonicPerOutput = Annotated[
    Polynomial | PolynomialList,
    PlainValidator(partial(polynomials, depths=_PER_OUTPUT, check=(check_monic,))),
    _any(_NUMBERS, _LISTS),
]
StablePerOutput = Annotated[
    Polynomial | PolynomialList,
    PlainValidator(partial(polynomials, depths=_PER_OUTPUT, **_MONIC)),
    _any(_NUMBERS, _LISTS),
]
StableMatrix = Annotated[
    Polynomial | PolynomialMatrix,
    PlainValidator(partial(polynomials, depths=_MATRIX, **_MONIC)),
    _any(_NUMBERS, _ROWS),
]
GainMatrix = Annotated[
    Polynomial | PolynomialMatrix,
    PlainValidator(partial(polynomials, depths=_MATRIX)),
    _any(_NUMBERS, _ROWS),
]
RowsMatrix = Annotated[
    PolynomialMatrix,
    PlainValidator(partial(polynomials, depths={3: _MATRIX[3]})),
    WithJsonSchema(_ROWS),
]
"""A matrix of polynomials, never a single one."""
ContinuousDenominator = Annotated[
    Polynomial | PolynomialList | PolynomialMatrix,
    PlainValidator(partial(denominator, depths=_CONTINUOUS)),
    _any(_NUMBERS, _LISTS, _ROWS),
]
