"""The resolved spec as YAML text, and its fingerprint."""

from __future__ import annotations

import hashlib
import json

import yaml

from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.specification.yaml.scalars import NUMBER


class _Dumper(yaml.SafeDumper):
    """Quotes whatever our reader or a YAML 1.1 reader would not read as text; writes no aliases."""

    def ignore_aliases(self, data: Plain) -> bool:
        return True


_Dumper.add_implicit_resolver("tag:yaml.org,2002:float", NUMBER, list("-+.0123456789"))


def to_yaml(data: dict[str, Plain]) -> str:
    """Plain data as YAML: keys in their order, lists of numbers on one line."""
    return yaml.dump(
        data, Dumper=_Dumper, sort_keys=False, default_flow_style=None, allow_unicode=True, width=2**20
    )


def fingerprint(data: dict[str, Plain]) -> str:
    """SHA-256 of the data as canonical JSON: order of keys and `1` against `1.0` make no difference."""
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
