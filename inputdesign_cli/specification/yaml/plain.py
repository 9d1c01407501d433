"""Plain data, as YAML gives them: from Python objects, to text, and their fingerprint."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import yaml

from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.specification.yaml.scalars import NUMBER

Plain = Any
"""A number, a text, true, false or nothing, or lists and mappings of them, not checked by any model yet.

The type is open here only: with a recursive union every reader would have to check the type of each step.
"""

FORBIDDEN_IN_TEXT = re.compile("[\x00-\x08\x0b-\x1f\x7f\ud800-\udfff\ufffe\uffff]")
"""Characters that no text of a spec may hold."""
_DEEPEST = 50


def plain(value: object, where: str = "", depth: int = 0) -> Plain:
    """Return mappings, lists, tuples, numbers, arrays of numpy and paths of files as plain data.

    `where` is its key, inside `depth` mappings and lists. Raises `SpecError` (`bad-argument`) for other
    values.
    """
    if depth > _DEEPEST:
        raise _no_data("holds itself, or is too deep", where)
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, Mapping):
        if len({str(key) for key in value}) < len(value):
            raise _no_data("has two keys that are the same text", where)
        return {str(k): plain(v, f"{where}.{k}" if where else str(k), depth + 1) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part, f"{where}[{i}]", depth + 1) for i, part in enumerate(value)]
    if isinstance(value, str) and FORBIDDEN_IN_TEXT.search(value):
        raise _no_data("holds an unprintable character", where)
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise _no_data(f"is a {type(value).__name__}", where)


def _no_data(message: str, where: str) -> SpecError:
    hint = "a spec is made of mappings, lists, numbers, texts, true and false"
    return bad_spec("bad-argument", f"{where or 'the spec'} {message}", hint=hint, key=where)


class _Dumper(yaml.SafeDumper):
    """Quotes texts that our reader or a YAML 1.1 reader would read as other values; writes no aliases."""

    def ignore_aliases(self, data: Plain) -> bool:
        return True


_Dumper.add_implicit_resolver("tag:yaml.org,2002:float", NUMBER, list("-+.0123456789"))


def to_yaml(data: dict[str, Plain]) -> str:
    """Return plain data as YAML: keys in their order, lists of numbers on one line."""
    return yaml.dump(
        data, Dumper=_Dumper, sort_keys=False, default_flow_style=None, allow_unicode=True, width=2**20
    )


def fingerprint(data: dict[str, Plain]) -> str:
    """Return the SHA-256 of the data as canonical JSON: order of keys and `1` or `1.0` make no difference."""
    text = json.dumps(_canonical(data), sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _canonical(value: Plain) -> Plain:
    if isinstance(value, dict):
        return {k: _canonical(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_canonical(v) for v in value]
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) <= 2**53:
        return float(value) + 0.0
    return value
