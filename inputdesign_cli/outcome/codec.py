"""Typed results as plain data, and back: the names of fields are the keys of `result.json`.

A field that is None is left out, unless it is declared with `NULL`. A field that is declared by `others`
holds all keys without a field of their own. Arrays are nested lists, complex numbers {re, im}.
"""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Mapping
from enum import Enum
from functools import cache
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

T = TypeVar("T")
_OTHERS = {"others": True}
_SEQUENCES = (tuple, list)


class OutcomeError(ValueError):
    """Plain data do not have the form of the result that they should hold."""


NULL = {"null": True}
"""Metadata of a field that is written as null where it is None."""


def others() -> Any:
    """Declare the field for all keys that have no field of their own."""
    return dataclasses.field(default_factory=dict, metadata=_OTHERS)


def write_plain(value: object) -> Any:
    """Return a result as mappings, lists and numbers; arrays are left for the writer of JSON."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        plain: dict[str, object] = {}
        for field in dataclasses.fields(value):
            content = vars(value)[field.name]
            if "others" in field.metadata:
                plain |= {key: write_plain(item) for key, item in content.items()}
            elif content is not None or "null" in field.metadata:
                plain[field.name] = write_plain(content)
        return plain
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return {key: write_plain(item) for key, item in value.items()}
    if isinstance(value, _SEQUENCES):
        return [write_plain(item) for item in value]
    if isinstance(value, np.ndarray) and np.iscomplexobj(value):
        return _complex(value)
    return value


def _complex(values: np.ndarray) -> Any:
    if values.ndim == 0:
        return {"re": float(values.real), "im": float(values.imag)}
    return [_complex(part) for part in values]


def read_plain(kind: type[T], data: object, where: str = "") -> T:
    """Return a result of this type from plain data; keys that it does not know are passed over.

    Raises:
        OutcomeError: something that it needs is missing, or of another type.
    """
    result: T = _read(kind, data, where)
    return result


@cache
def _fields(kind: type) -> tuple[tuple[dataclasses.Field, Any], ...]:
    hints = get_type_hints(kind)
    return tuple((field, hints[field.name]) for field in dataclasses.fields(kind))


def _read(kind: Any, data: Any, where: str) -> Any:
    origin, arguments = get_origin(kind), get_args(kind)
    if kind is Any or kind is object:
        return data
    if origin is Annotated:
        return _read(arguments[0], data, where)
    if origin in (Union, types.UnionType):
        return _read_union(arguments, data, where)
    if origin is np.ndarray:
        return _read_array(arguments, data, where)
    if origin is tuple:
        return _read_tuple(arguments, data, where)
    if origin is Literal:
        return _one_of(arguments, data, where)
    if origin is not None:  # a mapping
        key, of = arguments
        return {
            float(name) if key is float else name: _read(of, item, _below(where, name))
            for name, item in _mapping(data, where).items()
        }
    return _read_object(kind, data, where) if dataclasses.is_dataclass(kind) else _scalar(kind, data, where)


def _read_object(kind: Any, data: Any, where: str) -> Any:
    if isinstance(data, kind):
        return data
    content = _mapping(data, where)
    known = {field.name for field, _ in _fields(kind)}
    given: dict[str, Any] = {}
    for field, hint in _fields(kind):
        if "others" in field.metadata:
            given[field.name] = {key: item for key, item in content.items() if key not in known}
        elif field.name in content:
            given[field.name] = _read(hint, content[field.name], _below(where, field.name))
    try:
        return kind(**given)
    except TypeError as error:
        raise OutcomeError(f"{_named(where)} is not complete: {error}") from error


def _read_union(kinds: tuple[Any, ...], data: Any, where: str) -> Any:
    if data is None and type(None) in kinds:
        return None
    first: OutcomeError | None = None
    for kind in kinds:
        if kind is type(None):
            continue
        try:
            return _read(kind, data, where)
        except OutcomeError as error:
            first = first or error
    raise first or OutcomeError(f"{_named(where)} is null")


def _read_tuple(arguments: tuple[Any, ...], data: Any, where: str) -> Any:
    if isinstance(data, np.ndarray):
        data = data.tolist()
    if not isinstance(data, _SEQUENCES):
        raise OutcomeError(f"{_named(where)} is no list")
    kinds = arguments[:1] * len(data) if arguments[1:] == (Ellipsis,) else arguments
    if len(kinds) != len(data):
        raise OutcomeError(f"{_named(where)} has {len(data)} entries, not {len(kinds)}")
    return tuple(
        _read(kind, item, f"{where}[{i}]") for i, (kind, item) in enumerate(zip(kinds, data, strict=True))
    )


def _read_array(arguments: tuple[Any, ...], data: Any, where: str) -> Any:
    of_complex = get_args(arguments[1])[:1] == (np.complex128,)
    try:
        plain = np.asarray(_with_complex(data)) if of_complex else data
        return np.asarray(plain, dtype=complex if np.iscomplexobj(plain) else float)
    except (TypeError, ValueError, KeyError, OverflowError) as error:
        raise OutcomeError(f"{_named(where)} is no array of numbers") from error


def _with_complex(data: Any) -> Any:
    """Return numbers with each {re, im} as one; both may be lists."""
    if isinstance(data, Mapping):
        return np.asarray(data["re"], dtype=float) + 1j * np.asarray(data["im"], dtype=float)
    return [_with_complex(item) for item in data] if isinstance(data, _SEQUENCES) else data


def _named(where: str) -> str:
    return f'"{where}"' if where else "the result"


def _below(where: str, name: str) -> str:
    return f"{where}.{name}" if where else name


def _mapping(data: Any, where: str) -> Mapping[str, Any]:
    if not isinstance(data, Mapping):
        raise OutcomeError(f"{_named(where)} is no object")
    return data


def _one_of(values: tuple[Any, ...], data: Any, where: str) -> Any:
    if data not in values:
        raise OutcomeError(f"{_named(where)} is {data!r}, not one of {', '.join(map(str, values))}")
    return data


def _scalar(kind: Any, data: Any, where: str) -> Any:
    if isinstance(data, np.generic | np.ndarray) and np.ndim(data) == 0:
        data = data.item()
    if kind is float and isinstance(data, int | float) and not isinstance(data, bool):
        try:
            return float(data)
        except OverflowError as error:
            message = f"{_named(where)} is too large for a number in double precision"
            raise OutcomeError(message) from error
    if issubclass(kind, Enum):
        return _one_of(tuple(kind), kind(data) if data in tuple(kind) else data, where)
    if not isinstance(data, kind) or (kind is int and isinstance(data, bool)):
        raise OutcomeError(f"{_named(where)} is of type {type(data).__name__}, not {kind.__name__}")
    return data
