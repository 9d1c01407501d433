"""Pydantic's errors in the words of this house, each with the path of the key it concerns."""

from __future__ import annotations

import re
import typing
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import yaml
from pydantic_core import ErrorDetails

from inputdesign_cli.specification.models.findings import CARRIER, Finding, describe
from inputdesign_cli.specification.models.section import FAMILIES, TAG, Section
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.near_words import choices, nearest, unknown_word
from inputdesign_cli.specification.yaml.places import Path, format_key
from inputdesign_cli.specification.yaml.scalars import clip

Readers = Mapping[int, type[Section]]
"""Identity of a mapping of the input -> the model that read it."""


def translate(errors: list[ErrorDetails], data: Any, readers: Readers) -> list[Finding]:
    """The findings behind pydantic's errors; paths are absolute and exist in `data` up to their last step."""
    return [finding for error in errors for finding in _translate(error, data, readers)]


def _translate(error: ErrorDetails, data: Any, readers: Readers) -> list[Finding]:
    path = tuple(step for step in error["loc"] if not (isinstance(step, str) and step.startswith(TAG)))
    kind, context = error["type"], error.get("ctx", {})
    if kind == CARRIER:
        return [shorten(replace(f, path=path + f.path), data) for f in context[CARRIER]]
    if kind == "extra_forbidden":
        return [_unknown_key(path, data, readers)]
    if kind == "missing":
        return [_missing(path, data, readers)]
    if kind == "literal_error":
        words = re.findall(r"'([^']*)'", str(context.get("expected", "")))
        message, hint = unknown_word(error["input"], words)
        return [shorten(Finding("unknown-word", message, hint, path), data)]
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        wrong = f"{{key}} must be a mapping of keys, not {describe(error['input'])}"
        return [shorten(Finding("wrong-shape", wrong, 'write "key: value" pairs below it', path), data)]
    if kind in ("tuple_type", "list_type"):
        wrong = f"{{key}} must be a list, not {describe(error['input'])}"
        return [shorten(Finding("wrong-shape", wrong, "write [.., ..]", path), data)]
    wrong = f"{{key}} cannot be {describe(error['input'])}"
    return [shorten(Finding("wrong-shape", wrong, "see the example specs for its form", path), data)]


def shorten(finding: Finding, data: Any) -> Finding:
    """Drop the steps that a shorthand added: `limits.input_power: 5` has no `limits.input_power.max`."""
    kept: list[str | int] = []
    for step in finding.path:
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
    return replace(finding, path=tuple(kept))


def _reader(path: Path, data: Any, readers: Readers) -> type[Section] | None:
    for step in path:
        try:
            data = data[step]
        except (KeyError, IndexError, TypeError):
            return None
    return readers.get(id(data))


def _missing(path: Path, data: Any, readers: Readers) -> Finding:
    parent, key = path[:-1], str(path[-1])
    model = _reader(parent, data, readers)
    field = model.model_fields.get(key) if model else None
    owner = format_key(parent) or "the spec"
    if model is not None and model.phrase and model.family == "spectrum":
        owner = f"{owner} of {model.phrase}"
    hint = f"add {key}"
    if field and field.examples:
        example = yaml.safe_dump({key: field.examples[0]}, default_flow_style=None, sort_keys=False)
        hint = f"for example {example.strip()}"
    elif field and field.description:
        hint = f"add {key}: {field.description}"
    return shorten(Finding("missing-key", f'{owner} needs "{key}"', hint.rstrip("."), path), data)


def _unknown_key(path: Path, data: Any, readers: Readers) -> Finding:
    parent, key = path[:-1], str(path[-1])
    model = _reader(parent, data, readers)
    owner = format_key(parent) or ("a spec" if model is Spec else "this file")
    siblings = FAMILIES.get(model.family, []) if model and model.family else []
    others = [s.phrase for s in siblings if key in s.model_fields]
    if others and model:
        return Finding(
            "unsuitable-key",
            f"{format_key(path)} does not go with {model.phrase}",
            f'"{key}" belongs to {choices(list(dict.fromkeys(others)))}; remove it, or change to that',
            path,
            at_key=True,
        )
    return Finding(
        "unknown-key",
        f"{clip(key)} is not a key of {owner}",
        _mend_key(key, owner, model),
        path,
        at_key=True,
        meant=nearest(key, model.model_fields) or "" if model else "",
    )


def _mend_key(key: str, owner: str, model: type[Section] | None) -> str:
    known = list(model.model_fields) if model else []
    # Golden files are made of sections too, but their keys have nothing to do with those of a spec.
    homes = _homes().get(key, []) if model in _models() else []
    near = nearest(key, known)
    if 0 < len(homes) <= 3 and not (near and near.lower() == key.lower()):
        return f"{key} belongs {choices(homes)}"
    if near:
        return f'did you mean "{near}"?'
    if known:
        return f"the keys of {owner} are {', '.join(known)}"
    return "remove it"


@cache
def _homes() -> dict[str, list[str]]:
    """Every key of the spec -> where it belongs, for a key that was written elsewhere."""
    homes: dict[str, set[str]] = {}
    for path, model in _walk(Spec, ""):
        for name in model.model_fields:
            homes.setdefault(name, set()).add(f"under {path}" if path else "at the top level")
    return {name: sorted(home) for name, home in homes.items()}


@cache
def _models() -> frozenset[type[Section]]:
    return frozenset(model for _, model in _walk(Spec, ""))


def _walk(model: type[Section], path: str) -> Iterator[tuple[str, type[Section]]]:
    yield path, model
    for name, field in model.model_fields.items():
        for part in _sections(field.annotation):
            yield from _walk(part, f"{path}.{name}" if path else name)


def _sections(annotation: Any) -> set[type[Section]]:
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return {annotation}
    found: set[type[Section]] = set()
    for part in typing.get_args(annotation):
        found |= _sections(part)
    return found
