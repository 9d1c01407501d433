"""Named parameters of a plant, and the expressions in them that stand for coefficients."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from pydantic import GetJsonSchemaHandler
from pydantic_core import core_schema

from inputdesign_cli.expressions import Expression, ExpressionError, is_name
from inputdesign_cli.specification.models.section import PathDiagnostic
from inputdesign_cli.specification.models.units import without_unit
from inputdesign_cli.specification.models.wording import nearest
from inputdesign_cli.specification.yaml.places import Path
from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.specification.yaml.scalars import clip


class TakesExpressions:
    """Allows texts in place of numbers in the JSON schema; models read the values of these expressions."""

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Plain]:
        return _with_texts(handler(schema))


def _with_texts(node: Plain) -> Plain:
    if isinstance(node, list):
        return [_with_texts(part) for part in node]
    if not isinstance(node, dict):
        return node
    if node.get("type") == "number":
        return {"anyOf": [node, {"type": "string", "minLength": 1}]}
    return {key: _with_texts(part) for key, part in node.items()}


EXPRESSIONS = TakesExpressions()

# Keys whose texts are words, not expressions.
_WORDS = ("time",)

Terms = tuple[Expression, ...]
TermMatrix = tuple[tuple[Terms, ...], ...]


@dataclass(frozen=True)
class CoefficientTerms:
    """The coefficients of a plant in s, descending, and its dead times, as expressions entry by entry."""

    numerator: TermMatrix
    denominator: TermMatrix
    delay: tuple[Terms, ...]


@dataclass(frozen=True)
class NamedParameter:
    """A parameter with a name of its own: `label` for the user, and `symbol` in expressions.

    The `place` is the path of its value, from the section of the plant.
    """

    label: str
    symbol: str
    value: float
    place: Path


def values_of(parameters: dict[str, Plain]) -> dict[str, float]:
    """Return the values by name; one that cannot be read counts as 1, and pydantic reports it."""

    def number(value: Plain) -> float:
        usable = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300
        return float(value) if usable else 1.0

    return {str(name): number(value) for name, value in parameters.items()}


def check_names(parameters: Mapping[str, float]) -> Iterator[PathDiagnostic]:
    """Check that names of parameters can stand in expressions."""
    for name in parameters:
        if not is_name(name):
            message = f"{clip(name)} is no name of a parameter"
            hint = "a name is a letter (a to z), then letters, digits, _; functions, pi and lambda are taken"
            yield PathDiagnostic("bad-name", message, hint, ("parameters", name), at_key=True)


def worth(
    value: Plain, parameters: Mapping[str, float], path: Path, found: list[PathDiagnostic], used: set[str]
) -> Plain:
    """Return a nested value with numbers in place of texts; adds to `found` errors and `used` parameters."""
    if isinstance(value, list | tuple):
        return [worth(part, parameters, (*path, i), found, used) for i, part in enumerate(value)]
    if isinstance(value, dict):
        return {
            key: part if key in _WORDS else worth(part, parameters, (*path, key), found, used)
            for key, part in value.items()
        }
    if not isinstance(value, str):
        return value
    try:
        expression = Expression.of(value)
        used |= expression.names
    except ExpressionError as error:
        message = f"{{key}} {error.message}: {clip(value)}"
        hint = without_unit(value, None) or error.hint
        found.append(PathDiagnostic("bad-expression", message, hint, path))
        return 1.0
    unknown = sorted(expression.names - parameters.keys())
    for name in unknown:
        near = nearest(name, parameters)
        hint = f'did you mean "{near}"?' if near else f"add {name} and its value to plant.parameters"
        message = f"{{key}} names {name}, which is no parameter"
        found.append(PathDiagnostic("unknown-name", message, hint, path))
    if unknown:
        return 1.0
    number, slope = expression.at(list(parameters), np.array(list(parameters.values()), dtype=float))
    if math.isfinite(number) and np.all(np.isfinite(slope)):
        return number
    message = f"{{key}} has no value or no derivative at the nominal parameters: {clip(value)}"
    hint = "look for a division by zero, or a root or logarithm of a number that is not positive"
    found.append(PathDiagnostic("undefined-expression", message, hint, path))
    return 1.0


def leading(terms: Terms) -> int:
    """Return the index of the first coefficient that is present; the length if none is."""
    return next((i for i, one in enumerate(terms) if one.present), len(terms))


def expressed(value: Plain) -> Plain:
    """Return a nested value with an expression in place of each number and text."""
    if isinstance(value, list | tuple):
        return tuple(expressed(part) for part in value)
    return Expression(value if isinstance(value, str) else repr(float(value)))
