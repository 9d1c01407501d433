"""`sweep:`: which keys a batch sweep varies, and over which values."""

from __future__ import annotations

import re
from decimal import Decimal
from typing import Annotated, Any

from pydantic import Field, PlainValidator, StrictBool, WithJsonSchema

from inputdesign_cli.specification.models.findings import Findings, describe, fail
from inputdesign_cli.specification.models.section import Section
from inputdesign_cli.specification.models.values import collect
from inputdesign_cli.specification.yaml.scalars import resolve

MOST_VALUES = 100_000
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(rf"\s*({_NUMBER})\s*:\s*({_NUMBER})\s*(?::\s*({_NUMBER})\s*)?")


def range_values(text: str) -> tuple[str, ...] | None:
    """The numbers of `low:high:step` as text, both ends included; None for a text that is no range.

    They are counted in decimals, so that 0:1:0.1 holds 0.3 and not 0.30000000000000004.

    Raises
    ------
    PydanticCustomError : `bad-range`.
    """
    match = _RANGE.fullmatch(text)
    if match is None:
        return None
    if match.group(3) is None:
        raise fail("bad-range", f'the range "{text.strip()}" has no step', "write low:high:step, as 0:40:5")
    low, high, step = (Decimal(part) for part in match.groups())
    if step == 0 or (high - low) * step < 0:
        raise fail(
            "bad-range",
            f'the range "{text.strip()}" never gets from {low} to {high}',
            "the step must lead from the first number to the second, as in 0:40:5 or 40:0:-5",
        )
    count = int((high - low) / step) + 1
    if count > MOST_VALUES:
        raise fail("bad-range", f'the range "{text.strip()}" holds {count} values', "take a larger step")
    return tuple(_plain(low + i * step) for i in range(count))


def _plain(value: Decimal) -> str:
    """A decimal without an exponent where it is short, and without trailing zeros."""
    normal = value.normalize()
    exponent = normal.as_tuple().exponent
    if isinstance(exponent, int) and -12 <= exponent <= 6:
        return f"{normal + 0:f}"
    return f"{normal + 0:E}"


def _values(value: Any) -> tuple[Any, ...]:
    """The values of one key: a list, or a range as text."""
    if isinstance(value, str) and (found := range_values(value)) is not None:
        return tuple(resolve(text) for text in found)
    if not isinstance(value, list | tuple):
        hint = "write [250, 500, 1000] or 0:40:5"
        raise fail("wrong-shape", f"{{key}} must be a list of values or a range, not {describe(value)}", hint)
    if not value:
        raise fail("wrong-shape", "{key} is an empty list", "name at least one value")
    return tuple(value)


def _axes(value: Any) -> dict[str, tuple[Any, ...]]:
    if not isinstance(value, dict):
        hint = "write set: {experiment.samples: [250, 500, 1000]}"
        raise fail("wrong-shape", f"{{key}} must be a mapping of keys to values, not {describe(value)}", hint)
    findings = Findings()
    axes = {key: collect(findings, _values, entry, key) for key, entry in value.items()}
    findings.stop()
    return axes


_SCHEMA = {
    "type": "object",
    "minProperties": 1,
    "additionalProperties": {"anyOf": [{"type": "array", "minItems": 1}, {"type": "string"}]},
}


class Sweep(Section):
    """What `idesign sweep` varies; the other commands pay no attention to it."""

    set: Annotated[dict[str, tuple[Any, ...]], PlainValidator(_axes), WithJsonSchema(_SCHEMA)] = Field(
        description="Keys of the spec and their values: a list, or low:high:step.",
        examples=[{"experiment.samples": [250, 500, 1000]}],
    )
    zip: StrictBool = Field(
        default=False,
        description="Take the values side by side, not in every combination (default false).",
    )
