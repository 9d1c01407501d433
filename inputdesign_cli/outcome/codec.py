"""Typed results as plain data and as JSON, and back: the names of fields are the keys of `result.json`.

A field that is None is left out, unless it is declared with `NULL`. A field that is declared by `others`
holds all keys without a field of their own. Arrays are nested lists, complex numbers {re, im}.
"""

from __future__ import annotations

import dataclasses
import json
import math
import sys
import types
from collections.abc import Mapping
from enum import Enum
from functools import cache
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

T = TypeVar("T")


class OutcomeError(ValueError):
    """Raised where plain data do not have the form of the result that they should hold."""


_NAMES = {str: "text", bool: "truth value", int: "whole number", float: "number", list: "list"}
_NAMES |= dict.fromkeys((dict, Mapping), "object")
NULL = {"null": True}
"""Metadata of a field that is written as null where it is None."""


def others() -> Any:
    """Declare the field for all keys that have no field of their own."""
    return dataclasses.field(default_factory=dict, metadata={"others": True})


def plain(value: object, where: str = "result") -> Any:
    """Return a result in JSON's own types; `where` names it in errors.

    Raises:
        ValueError: a NaN or an infinity: JSON has none, and a null in its place would hide an error.
        TypeError: a value or a key that has no place in JSON.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = _entries(value)
    if value is None or isinstance(value, str | bool | int):
        return value.value if isinstance(value, Enum) else value
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"{where} is {value}: a result must be finite")
        return value
    if isinstance(value, complex):
        value = {"re": value.real, "im": value.imag}
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise TypeError(f"{where} has the key {key!r}: keys must be text")
        return {key: plain(item, f"{where}.{key}") for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item, f"{where}[{i}]") for i, item in enumerate(value)]
    raise TypeError(f"{where} is of type {type(value).__name__}, which JSON cannot hold")


def _entries(result: Any) -> dict[str, object]:
    """Return the fields of a result that are written, by their keys."""
    found: dict[str, object] = {}
    for field in dataclasses.fields(result):
        content = vars(result)[field.name]
        if "others" in field.metadata:
            found |= content
        elif content is not None or "null" in field.metadata:
            found[field.name] = content
    return found


def json_text(value: object) -> str:
    """Return anything that `plain` accepts as JSON text with a final newline."""
    return json.dumps(plain(value), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def read_plain(kind: type[T], data: object, where: str = "") -> T:
    """Return a result of this type from plain data; unknown keys are ignored.

    Raises:
        OutcomeError: something that it needs is missing, or of another type.
    """
    result: T = _read(kind, data, where)
    return result


def _read(kind: Any, data: Any, where: str) -> Any:
    origin, arguments = get_origin(kind), get_args(kind)
    if kind is Any or kind is object:
        return data
    if origin is np.ndarray:
        return _array(arguments[1], data, where)
    if isinstance(data, np.ndarray | np.generic):
        data = data.tolist()
    if origin in (Union, types.UnionType):
        return _first_that_fits(arguments, data, where)
    if origin is tuple:
        items = _expected(data, list | tuple, where)
        kinds = arguments[:1] * len(items) if arguments[1:] == (Ellipsis,) else arguments
        if len(kinds) != len(items):
            raise OutcomeError(f'"{where}" has {len(items)} entries, not {len(kinds)}')
        return tuple(_read(of, items[i], f"{where}[{i}]") for i, of in enumerate(kinds))
    if origin is Mapping:
        key, of = arguments
        entries = _expected(data, Mapping, where).items()
        return {key(name): _read(of, item, _below(where, name)) for name, item in entries}
    if origin is Literal or issubclass(kind, Enum):
        known = arguments or tuple(kind)
        if data not in known:
            raise OutcomeError(f'"{where}" is {data!r}, not one of {", ".join(map(str, known))}')
        return data if origin is Literal else kind(data)
    if dataclasses.is_dataclass(kind):
        return _object(kind, _expected(data, Mapping, where), where)
    if kind is float and type(data) is int and abs(data) <= sys.float_info.max:
        return float(data)
    return _expected(data, kind, where)


@cache
def _fields(kind: type) -> tuple[tuple[dataclasses.Field, Any], ...]:
    hints = get_type_hints(kind)
    return tuple((field, hints[field.name]) for field in dataclasses.fields(kind))


def _object(kind: Any, content: Mapping[str, Any], where: str) -> Any:
    known = {field.name for field, _ in _fields(kind)}
    given: dict[str, Any] = {}
    for field, hint in _fields(kind):
        if "others" in field.metadata:
            given[field.name] = {key: item for key, item in content.items() if key not in known}
        elif field.name in content:
            given[field.name] = _read(hint, content[field.name], _below(where, field.name))
    needed = (one for one, _ in _fields(kind) if one.default is one.default_factory is dataclasses.MISSING)
    if missing := [one.name for one in needed if one.name not in given]:
        raise OutcomeError(f'"{where or "result"}" lacks {", ".join(missing)}')
    return kind(**given)


def _first_that_fits(kinds: tuple[Any, ...], data: Any, where: str) -> Any:
    if data is None and types.NoneType in kinds:
        return None
    errors = []
    for kind in kinds:
        if kind is not types.NoneType:
            try:
                return _read(kind, data, where)
            except OutcomeError as error:
                errors.append(error)
    raise errors[0]


def _array(dtype: Any, data: Any, where: str) -> Any:
    try:
        found = np.asarray(_with_complex(data) if get_args(dtype)[:1] == (np.complex128,) else data)
        return found.astype(complex if np.iscomplexobj(found) else float)
    except (TypeError, ValueError, KeyError, OverflowError) as error:
        raise OutcomeError(f'"{where}" is no array of numbers') from error


def _with_complex(data: Any) -> Any:
    """Return numbers with each {re, im} as one; both may be lists."""
    if isinstance(data, Mapping):
        return np.asarray(data["re"], dtype=float) + 1j * np.asarray(data["im"], dtype=float)
    return [_with_complex(item) for item in data] if isinstance(data, list | tuple) else data


def _below(where: str, name: str) -> str:
    return f"{where}.{name}" if where else name


def _expected(data: Any, kind: Any, where: str) -> Any:
    """Return data of this type; a truth value is no number."""
    if not isinstance(data, kind) or (kind is int and isinstance(data, bool)):
        found, wanted = _NAMES.get(type(data), "null"), _NAMES.get(kind, "list")
        raise OutcomeError(f'"{where or "result"}" is of type {found}, not {wanted}')
    return data
