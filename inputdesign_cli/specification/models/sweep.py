"""`sweep:`: which keys a batch sweep varies, and over which values."""

from __future__ import annotations

import re
from decimal import Decimal
from typing import Annotated

from pydantic import BeforeValidator, Field, WithJsonSchema

from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.specification.models.fields import Flag, Several
from inputdesign_cli.specification.models.section import PathDiagnostic, Section, Wording, carry
from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.specification.yaml.scalars import resolve

MOST_VALUES = 100_000
_NUMBER = r"([-+]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[-+]?[0-9]+)?|\.?(?:nan|inf|infinity)))"
_RANGE = re.compile(rf"\s*{_NUMBER}\s*:\s*{_NUMBER}\s*(?::\s*{_NUMBER}\s*)?", re.IGNORECASE)


def range_values(text: str) -> tuple[str, ...] | None:
    """Return the numbers of `low:high:step` as text, both ends included; None for a text that is no range.

    Decimals make 0:1:0.1 hold 0.3, not 0.30000000000000004. Raises `SpecError` (`bad-range`).
    """
    match = _RANGE.fullmatch(text)
    if match is None:
        return None
    wrong, hint = "", "write low:high:step with numbers, as 0:40:5 or 40:0:-5"
    if match.group(3) is None or any("n" in part.lower() for part in match.groups()):
        wrong = "has no step" if match.group(3) is None else "has an end or a step that is not finite"
        raise bad_spec("bad-range", f'the range "{text.strip()}" {wrong}', hint=hint)
    low, high, step = (Decimal(part) for part in match.groups())
    if step == 0 or (high - low) * step < 0:
        wrong = f"never gets from {low} to {high}"
    elif (count := int((high - low) / step) + 1) > MOST_VALUES:
        wrong, hint = f"holds {count} values", "take a larger step"
    if wrong:
        raise bad_spec("bad-range", f'the range "{text.strip()}" {wrong}', hint=hint)
    return tuple(_plain(low + i * step) for i in range(count))


def _plain(value: Decimal) -> str:
    """Return a decimal without an exponent where it is short, and without trailing zeros."""
    normal = value.normalize()
    exponent = normal.as_tuple().exponent
    if isinstance(exponent, int) and -12 <= exponent <= 6:
        return f"{normal + 0:f}"
    return f"{normal + 0:E}"


def _expanded(value: object) -> object:
    """Return the values of a range, and everything else unchanged."""
    if not isinstance(value, str):
        return value
    try:
        found = range_values(value)
    except SpecError as error:
        raise carry(*(PathDiagnostic(d.code, d.message, d.hint) for d in error.diagnostics)) from None
    return value if found is None else tuple(resolve(text) for text in found)


Values = Annotated[
    Several[Plain],
    BeforeValidator(_expanded),
    Wording("a list of values or a range", "write [250, 500, 1000] or 0:40:5"),
    WithJsonSchema({"anyOf": [{"type": "array", "minItems": 1}, {"type": "string"}]}),
]


class Sweep(Section):
    """What `idesign sweep` varies; the other commands pay no attention to it."""

    set: Annotated[
        dict[str, Values],
        Field(json_schema_extra={"minProperties": 1}),
        Wording("a mapping of keys to values", "write set: {experiment.samples: [250, 500, 1000]}"),
    ] = Field(
        description="Keys of the spec and their values: a list, or low:high:step.",
        examples=[{"experiment.samples": [250, 500, 1000]}],
    )
    zip: Flag = Field(
        default=False, description="Take the values side by side, not in every combination (default false)."
    )
