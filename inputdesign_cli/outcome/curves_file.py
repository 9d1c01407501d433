"""figures.json: what the figures of a run show, so that a page draws them again, in its own size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from functools import cache
from pathlib import Path
from types import UnionType
from typing import get_args, get_origin, get_type_hints

import numpy as np
import orjson

from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.record import FIGURES, unreadable
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.regular_file import read_regular

_KIND = "kind"
# Of single precision: seven digits are more than a figure shows. Other numbers keep all of theirs.
_LEAST, _MOST = 1e-30, 1e30
_OPTIONS = orjson.OPT_NON_STR_KEYS


def curves_json(curves: Mapping[str, Curves]) -> bytes:
    """Curves by the file stem of their figure as JSON: fields by name, arrays as lists, NaN as null."""
    content = {stem: {_KIND: type(one).__name__, **_fields(one)} for stem, one in curves.items()}
    return orjson.dumps(content, default=_plain, option=_OPTIONS)


def read_curves(directory: Path) -> dict[str, Curves]:
    """Return the curves of a run by file stem, an empty mapping if it has no such file.

    Raises:
        DataError: `run-unreadable`, the file holds something else.
    """
    file = directory / FIGURES
    if not file.is_file():
        return {}
    try:
        content = orjson.loads(read_regular(file))
        return {stem: _curves(fields) for stem, fields in content.items()}
    except (ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError) as error:
        raise unreadable(file, str(error)) from error


def _fields(curves: Curves) -> dict[str, Json]:
    if not is_dataclass(curves):
        raise TypeError(f"{type(curves).__name__} is no dataclass")
    return asdict(curves)


def _plain(value: object) -> Json:
    """What JSON has no type for."""
    if isinstance(value, np.generic):
        return value.item()
    if not isinstance(value, np.ndarray):
        raise TypeError(f"a figure cannot hold a {type(value).__name__}")
    if np.iscomplexobj(value):
        return {"re": _numbers(value.real), "im": _numbers(value.imag)}
    return _numbers(value)


def _numbers(values: np.ndarray) -> orjson.Fragment:
    size = np.abs(values[np.isfinite(values) & (values != 0)])
    short = not size.size or (size.min() > _LEAST and size.max() < _MOST)
    kept = np.ascontiguousarray(values, dtype=np.float32 if short else np.float64)
    return orjson.Fragment(orjson.dumps(kept, option=orjson.OPT_SERIALIZE_NUMPY))


def _curves(fields: dict[str, Json]) -> Curves:
    kind = _kinds()[fields.pop(_KIND)]
    found = _restored(kind, fields)
    assert isinstance(found, Curves)
    return found


@cache
def _kinds() -> dict[str, type[Curves]]:
    return {kind.__name__: kind for kind in Curves.__subclasses__()}


@cache
def _hints(kind: type) -> dict[str, Json]:
    return get_type_hints(kind)


def _restored(kind: Json, value: Json) -> Json:
    """A value of JSON as the type that a field of curves has."""
    of: object = get_origin(kind)
    inner = get_args(kind)
    if of is UnionType:  # with None
        return None if value is None else _restored(inner[0], value)
    if of is np.ndarray:
        if isinstance(value, dict):
            return np.array(value["re"], dtype=float) + 1j * np.array(value["im"], dtype=float)
        return np.array(value, dtype=float)
    if of is tuple:
        each = inner[:1] * len(value) if ... in inner else inner
        return tuple(_restored(one, item) for one, item in zip(each, value, strict=True))
    if of is Mapping:
        key, item = inner
        return {key(name): _restored(item, one) for name, one in value.items()}
    if isinstance(kind, type) and is_dataclass(kind):
        hints = _hints(kind)
        return kind(**{name: _restored(hints[name], one) for name, one in value.items()})
    return kind(value)
