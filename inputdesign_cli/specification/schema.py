"""The JSON schema of a spec, for editors that complete and check YAML, and the keys that name files."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path as FilePath

from inputdesign_cli.specification.models.fields import FILE_FORMAT
from inputdesign_cli.specification.models.spec import OF_DESIGNS, Spec
from inputdesign_cli.specification.plugins import install
from inputdesign_cli.specification.yaml.files import is_outside, outside
from inputdesign_cli.specification.yaml.overrides import KEY
from inputdesign_cli.specification.yaml.places import Path, format_key
from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.specification.yaml.reader import Tree
from inputdesign_cli.version import __version__


def json_schema() -> dict[str, Plain]:
    """Return the schema (draft 2020-12) of a spec file: keys, types, choices and descriptions.

    `idesign validate` checks conditions on several keys (shapes, stability, contradictions).
    """
    install()
    schema = _tidy(Spec.model_json_schema())
    names = {"type": "string", "minLength": 1}
    schema["properties"][KEY] = {
        "description": "Files whose blocks the spec takes over, for example model.yaml of `identify`.",
        "anyOf": [names, {"type": "array", "items": names, "minItems": 1}],
    }
    schema.pop("required")
    size = ({"required": [key]} for key in (*schema["$defs"]["Noise"].pop("required"), "standard_deviation"))
    variance = {"noise": {"anyOf": [*size]}}
    schema["anyOf"] = [
        {"required": ["plant", "noise"], "properties": variance},
        {"required": [KEY]},
        # A spec for an estimate alone: the noise is estimated as well.
        {"required": ["plant"], "properties": {key: {"not": {}} for key in OF_DESIGNS}},
    ]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:inputdesign-cli:spec:{__version__}",
        "title": "idesign experiment design",
        **{key: value for key, value in schema.items() if key != "title"},
    }


def _tidy(node: Plain) -> Plain:
    """Remove nulls, class names as titles and whole sections as defaults, which are for Python alone."""
    if isinstance(node, list):
        return [_tidy(item) for item in node]
    if not isinstance(node, dict):
        return node
    kept = {
        key: _tidy(value)
        for key, value in node.items()
        if not (key == "title" and isinstance(value, str))
        and not (key == "default" and (value is None or isinstance(value, dict)))
    }
    options = kept.get("anyOf")
    if isinstance(options, list):
        kept["anyOf"] = [option for option in options if option != {"type": "null"}]
        if len(kept["anyOf"]) == 1:
            kept = {**kept.pop("anyOf")[0], **kept}
    return kept


def named_files(data: Plain, path: Path = ()) -> Iterator[tuple[Path, str]]:
    """Find every text at a key that may name a file, with its path; a title is never one."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for step, value in items:
        if isinstance(value, str) and step in _keys():
            yield (*path, step), value
        yield from named_files(value, (*path, step))


def keep_inside(tree: Tree, confine: FilePath) -> None:
    """Add a diagnostic to the tree for every file that lies outside `confine`."""
    for path, name in named_files(tree.data):
        if is_outside(tree.folder / name, confine):
            tree.diagnostics.append(outside(name, confine, format_key(path), tree.places.at(path)))


@cache
def _keys() -> frozenset[str]:
    install()
    return frozenset(_file_keys(Spec.model_json_schema()))


def _file_keys(node: Plain) -> Iterator[str]:
    if isinstance(node, list):
        for item in node:
            yield from _file_keys(item)
    elif isinstance(node, dict):
        yield from (name for name, below in node.get("properties", {}).items() if _may_name_a_file(below))
        for below in node.values():
            yield from _file_keys(below)


def _may_name_a_file(value: dict[str, Plain]) -> bool:
    """Return whether some alternative of a value, in nested unions too, is the name of a file."""
    unions = (option for union in ("anyOf", "oneOf", "allOf") for option in value.get(union, ()))
    return value.get("format") == FILE_FORMAT or any(map(_may_name_a_file, unions))
