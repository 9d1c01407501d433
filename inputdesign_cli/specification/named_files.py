"""The files that a spec names, found before it is checked, and the folder that they may be kept to."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path as FilePath

from inputdesign_cli.specification.models.fields import FILE_FORMAT
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.yaml.files import is_outside, outside
from inputdesign_cli.specification.yaml.places import Path, format_key
from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.specification.yaml.reader import Tree


def named_files(data: Plain, path: Path = ()) -> Iterator[tuple[Path, str]]:
    """Find every text at a key that may name a file, with its path; a title is none, whatever it says."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for step, value in items:
        if isinstance(value, str) and step in _keys():
            yield (*path, step), value
        yield from named_files(value, (*path, step))


def keep_inside(tree: Tree, folder: FilePath, confine: FilePath) -> None:
    """Make a diagnostic of the tree of every file that lies outside `confine`."""
    for path, name in named_files(tree.data):
        if is_outside(folder / name, confine):
            location = tree.places.location(tree.places.mark(path))
            tree.diagnostics.append(outside(name, confine, format_key(path), location))


@cache
def _keys() -> frozenset[str]:
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
    """Whether some alternative of a value, however deep in unions, is the name of a file."""
    unions = (option for union in ("anyOf", "oneOf", "allOf") for option in value.get(union, ()))
    return value.get("format") == FILE_FORMAT or any(map(_may_name_a_file, unions))
