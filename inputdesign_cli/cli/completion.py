"""What the shell offers for the word that is being typed; `idesign --install-completion` switches it on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def error_codes(incomplete: str) -> list[tuple[str, str]]:
    """The codes that `idesign explain` knows, with their titles."""
    from inputdesign_cli.findings import explanations

    known = sorted(explanations().items())
    return [(code, entry.title) for code, entry in known if code.startswith(incomplete)]


def spec_keys(incomplete: str) -> list[str]:
    """The keys of a spec as `--set` takes them, and behind the equals sign the words that a key takes."""
    from inputdesign_cli.specification import json_schema

    schema = json_schema()
    found = list(_entries(schema, schema, ""))
    key, equals, _ = incomplete.partition("=")
    if not equals:
        return [f"{name}=" for name in dict.fromkeys(name for name, _ in found) if name.startswith(key)]
    words = dict.fromkeys(f"{key}={word}" for name, node in found if name == key for word in _words(node))
    return [word for word in words if word.startswith(incomplete)]


def _entries(node: dict[str, Any], root: dict[str, Any], path: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """The paths of all keys that hold values: through references and alternatives, not into lists."""
    if "$ref" in node:
        yield from _entries(root["$defs"][node["$ref"].rpartition("/")[2]], root, path)
    for alternative in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        yield from _entries(alternative, root, path)
    for key, below in node.get("properties", {}).items():
        name = f"{path}.{key}" if path else key
        if name != "sweep":
            yield name, below
            yield from _entries(below, root, name)


def _words(node: dict[str, Any]) -> Iterator[str]:
    """The texts that a value may be, where it is one of a few."""
    listed = [*node.get("enum", ()), *([node["const"]] if "const" in node else ())]
    yield from (word for word in listed if isinstance(word, str))
    if node.get("type") == "boolean":
        yield from ("true", "false")
    for alternative in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        yield from _words(alternative)
