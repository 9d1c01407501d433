"""Pydantic's errors in plain words, each with the path of its key and the type that is declared there."""

from __future__ import annotations

import math
import types
import typing
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, reduce
from typing import Annotated, Any, Union

import yaml
from pydantic import Tag, ValidationError
from pydantic_core import ErrorDetails

from inputdesign_cli.specification.models.section import (
    CARRIER,
    FAMILIES,
    TAG,
    PathDiagnostic,
    Section,
    Wording,
)
from inputdesign_cli.specification.models.units import SECONDS, without_unit
from inputdesign_cli.specification.models.wording import choices, describe, nearest, show, unknown_word
from inputdesign_cli.specification.yaml.places import Path, format_key
from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.specification.yaml.scalars import clip, why_not_number


@dataclass(frozen=True)
class Declared:
    """A type without its annotations, and the annotations; the outermost one stands last."""

    type: Any
    metadata: tuple[object, ...] = ()

    @property
    def wording(self) -> Wording:
        """Return the outermost wording, or an empty one."""
        return next((m for m in reversed(self.metadata) if isinstance(m, Wording)), Wording(""))

    @property
    def alternatives(self) -> dict[str, Declared]:
        """Return the types of a union by their tags; a type without a tag has an empty one."""
        found = {}
        for part in map(declared, typing.get_args(self.type) if _is_union(self.type) else ()):
            own = TAG + part.section.phrase if part.section else ""
            found[next((m.tag for m in part.metadata if isinstance(m, Tag)), own)] = part
        return found

    @property
    def section(self) -> type[Section] | None:
        """Return the type itself if it is a mapping of the spec."""
        return self.type if isinstance(self.type, type) and issubclass(self.type, Section) else None

    def at(self, step: str | int) -> Declared:
        """Return the type one step down: at a key, at an index, or behind the tag of an alternative."""
        if isinstance(step, str) and step.startswith(TAG):
            return self.alternatives.get(step, Declared(object))
        if self.section is not None:
            field = self.section.model_fields.get(str(step))
            return declared(field.annotation, tuple(field.metadata)) if field else Declared(object)
        parts = typing.get_args(self.type)
        if isinstance(step, int) and len(parts) > step and ... not in parts:
            return declared(parts[step])
        return declared(parts[-1 if isinstance(step, str) else 0]) if parts else Declared(object)


def declared(annotation: Any, metadata: tuple[object, ...] = ()) -> Declared:
    """Split an annotation into type and metadata, without the None of optional keys."""
    if typing.get_origin(annotation) is Annotated:
        inner, *outer = typing.get_args(annotation)
        return declared(inner, (*outer, *metadata))
    if _is_union(annotation):
        present = [part for part in typing.get_args(annotation) if part is not types.NoneType]
        if len(present) == 1:
            return declared(present[0], metadata)
    return Declared(annotation, metadata)


def declared_at(root: type[Section], location: Sequence[str | int]) -> Declared:
    """Return the type at the location of a pydantic error, tags included."""
    return reduce(Declared.at, location, Declared(root))


def sections_in(annotation: Any) -> set[type[Section]]:
    """Return every section in an annotation, in nested unions and lists too."""
    if section := Declared(annotation).section:
        return {section}
    return {section for part in typing.get_args(annotation) for section in sections_in(part)}


def _is_union(annotation: Any) -> bool:
    return typing.get_origin(annotation) in (Union, types.UnionType)


# Pydantic's name of a bound that a number breaks -> our words.
_BOUNDS = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}
# Words and hint for types that carry no wording.
_DEFAULTS = {
    "float_type": ("a number", ""),
    "int_type": ("a whole number", ""),
    "string_type": ("a text", "put it in quotes"),
    "tuple_type": ("a list", "write [.., ..]"),
    "model_type": ("a mapping of keys", 'write "key: value" pairs below it'),
    "dict_type": ("a mapping", 'write "key: value" pairs below it'),
}

_TYPE = f"{TAG}type: "
"""The beginning of the tags of alternatives with a key `type`."""


def translate(error: ValidationError, data: Plain, root: type[Section]) -> list[PathDiagnostic]:
    """Return the diagnostics of the error that `root.model_validate(data)` raised, for plain data.

    Their paths are absolute, and exist in `data` up to their last step.
    """
    details = error.errors(include_url=False)
    unit = data.get("time_unit", "s") if isinstance(data, dict) and "time_unit" in root.model_fields else None
    return [shorten(found, data) for detail in details for found in _translate(detail, root, unit)]


def shorten(diagnostic: PathDiagnostic, data: Plain) -> PathDiagnostic:
    """Drop the steps that a shorthand added: `limits.input_power: 5` has no `limits.input_power.max`."""
    kept: list[str | int] = []
    for step in diagnostic.path:
        if isinstance(data, list):
            if isinstance(step, str):
                continue
            kept.append(step)
            data = data[step] if step < len(data) else None
        elif isinstance(data, dict):
            kept.append(step)
            data = data.get(str(step))
        else:
            break
    return replace(diagnostic, path=tuple(kept))


def _translate(error: ErrorDetails, root: type[Section], time_unit: Plain) -> list[PathDiagnostic]:
    location, kind, context = error["loc"], error["type"], error.get("ctx", {})
    path = tuple(step for step in location if not (isinstance(step, str) and step.startswith(TAG)))
    if kind == CARRIER:
        return [replace(found, path=path + found.path) for found in context[CARRIER]]
    if kind == "extra_forbidden":
        return [_unknown_key(path, declared_at(root, location[:-1]).section, root)]
    if kind == "missing" and path and isinstance(path[-1], int):
        what = declared_at(root, location[:-1]).wording.what or "a longer list"
        message, hint = f"{{key}} must be {what}, not {path[-1]}", "write all of them, [.., ..]"
        return [PathDiagnostic("wrong-shape", message, hint, path[:-1])]
    if kind == "missing":
        return [_missing(path, declared_at(root, location[:-1]).section)]
    if kind == "too_short" and error["input"]:
        return []  # pydantic does not count wrong items, which have their own errors
    declared = declared_at(root, location)
    types = [tag.removeprefix(_TYPE) for tag in declared.alternatives if tag.startswith(_TYPE)]
    if types and isinstance(error["input"], dict):
        if "type" in error["input"]:
            word = unknown_word(error["input"]["type"], types)
            return [PathDiagnostic("unknown-word", *word, (*path, "type"))]
        hint = f"write type: {types[0]}; the types are {', '.join(types)}"
        return [PathDiagnostic("missing-key", "{key} needs a type", hint, path)]
    code, message, hint = _wrong_value(kind, error["input"], context, declared)
    if kind in ("float_type", "int_type") and isinstance(error["input"], str):
        unit = "s" if path[0] == "solver" else time_unit
        hint = without_unit(error["input"], unit if unit in SECONDS else None) or hint
    return [PathDiagnostic(code, message, hint, path)]


def _wrong_value(
    kind: str, value: Plain, context: dict[str, Plain], declared: Declared
) -> tuple[str, str, str]:
    """Return code, message and hint for a value that is not of the type of its key."""
    hint = declared.wording.hint
    usual, advice = _DEFAULTS.get(kind, ("something else", ""))
    what = declared.wording.what or usual
    if kind in ("float_type", "int_type", "finite_number"):
        return _no_number(value, what, hint)
    if kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        ((bound, limit),) = context.items()
        if bound == "lt" and limit == 1 and value < 100:
            hint = f"write {value / 100:g} for {value:g} percent"
        return "out-of-range", f"{{key}} must be {_BOUNDS[bound]} {show(limit)}, not {show(value)}", hint
    if kind == "literal_error":
        words = [describe(word) if word is True else word for word in typing.get_args(declared.type)]
        message, near = unknown_word(value, words)
        return "unknown-word", message, near or hint
    if kind == "bool_type":
        return "unknown-word", f"{{key}} must be true or false, not {describe(value)}", "write true or false"
    if kind == "too_short":
        empty = describe(value).replace("a ", "an empty ")
        return "wrong-shape", f"{{key}} is {empty}; it needs at least one entry", hint
    # "not a list" would mislead about a list that is nested wrongly.
    mistaken = kind == "union_tag_invalid" and isinstance(value, list)
    if kind == "too_long" and isinstance(value, list):
        return "wrong-shape", f"{{key}} must be {what}, not {len(value)}", hint or "write as many"
    wrong = f"{{key}} must be {what}" + ("" if mistaken else f", not {describe(value)}")
    if kind in ("string_type", "string_pattern_mismatch"):
        return "not-a-text", wrong, hint or advice
    if isinstance(value, int | float) and not isinstance(value, bool) and kind == "tuple_type":
        advice = f"write [{show(value)}]"
    return "wrong-shape", wrong, hint or advice


def _no_number(value: Plain, what: str, hint: str) -> tuple[str, str, str]:
    if isinstance(value, str):
        code, reason, mend = why_not_number(value)
        return code, f"{{key}} {reason}", mend or hint
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "not-a-number", f"{{key}} must be {what}, not {describe(value)}", hint
    if abs(value) >= 2**1024 or math.isnan(value):
        return "not-finite", "{key} must be finite", "numbers must stay below 1.8e308"
    below = math.floor(value)
    message = f"{{key}} must be {what}, not {show(value)}"
    return "not-a-whole-number", message, f"write {below} or {below + 1}"


def _missing(path: Path, model: type[Section] | None) -> PathDiagnostic:
    key = str(path[-1])
    field = model.model_fields.get(key) if model else None
    owner = format_key(path[:-1]) or "the spec"
    if model is not None and model.phrase.startswith("type: "):
        owner = f"{owner} of {model.phrase}"
    hint = f"add {key}"
    if field and field.examples:
        example = yaml.safe_dump({key: field.examples[0]}, default_flow_style=None, sort_keys=False)
        hint = f"for example {example.strip()}"
    elif field and field.description:
        hint = f"add {key}: {field.description}"
    return PathDiagnostic("missing-key", f'{owner} needs "{key}"', hint.rstrip("."), path)


def _unknown_key(path: Path, model: type[Section] | None, root: type[Section]) -> PathDiagnostic:
    key, known = str(path[-1]), list(model.model_fields) if model else []
    owner = format_key(path[:-1]) or root.phrase or "this file"
    siblings = FAMILIES.get(model.family, []) if model else []
    others = [sibling.phrase for sibling in siblings if key in sibling.model_fields]
    if others and model:
        message = f"{format_key(path)} does not go with {model.phrase}"
        hint = f'"{key}" belongs to {choices(list(dict.fromkeys(others)))}; remove it, or change to that'
        return PathDiagnostic("unsuitable-key", message, hint, path, at_key=True)
    near, homes = nearest(key, known), _homes(root).get(key, [])
    homes = [home for home in homes if home.startswith(f"under {owner}.")] or homes
    hint = f"the keys of {owner} are {', '.join(known)}" if known else "remove it"
    if model is not None and key in model.ELSEWHERE:
        hint = model.ELSEWHERE[key]
    elif 0 < len(homes) <= 3 and not (near and near.lower() == key.lower()):
        hint = f"{key} belongs {choices(homes)}"
    elif near:
        hint = f'did you mean "{near}"?'
    message = f"{clip(key)} is not a key of {owner}"
    return PathDiagnostic("unknown-key", message, hint, path, at_key=True, meant=near or "")


@cache
def _homes(root: type[Section]) -> dict[str, list[str]]:
    """Return the places where each key below the root belongs."""
    homes: dict[str, set[str]] = {}

    def walk(model: type[Section], path: str) -> None:
        for name, field in model.model_fields.items():
            homes.setdefault(name, set()).add(f"under {path}" if path else "at the top level")
            for part in sections_in(field.annotation):
                walk(part, f"{path}.{name}" if path else name)

    walk(root, "")
    return {name: sorted(home) for name, home in homes.items()}
