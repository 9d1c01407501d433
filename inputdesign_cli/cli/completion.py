"""What the shell offers for the word that is being typed; `idesign --install-completion` switches it on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def error_codes(incomplete: str) -> list[tuple[str, str]]:
    """The codes that `idesign explain` knows, with their titles."""
    from inputdesign_cli.error_codes import explanations

    known = sorted(explanations().items())
    return [(code, entry.title) for code, entry in known if code.startswith(incomplete)]


def spec_keys(incomplete: str) -> list[str]:
    """The keys of a spec as `--set` takes them, up to the equals sign."""
    if "=" in incomplete:
        return []
    from inputdesign_cli.specification import json_schema

    schema = json_schema()
    keys = dict.fromkeys(_keys(schema, schema, ""))
    return [f"{key}=" for key in keys if key.startswith(incomplete)]


def _keys(node: dict[str, Any], root: dict[str, Any], path: str) -> Iterator[str]:
    """The paths of all keys that hold values: through references and alternatives, not into lists."""
    if "$ref" in node:
        yield from _keys(root["$defs"][node["$ref"].rpartition("/")[2]], root, path)
    for alternative in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        yield from _keys(alternative, root, path)
    for key, below in node.get("properties", {}).items():
        name = f"{path}.{key}" if path else key
        if name != "sweep":
            yield name
            yield from _keys(below, root, name)
