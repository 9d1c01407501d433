"""figures.json: what the figures of a run show, so that a page draws them again, in its own size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

import numpy as np
import orjson

from inputdesign_cli.outcome.codec import read_plain
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.record import FIGURES, unreadable
from inputdesign_cli.regular_file import read_regular

_KIND = "kind"
# Of single precision: seven digits are more than a figure shows. Other numbers keep all of theirs.
_LEAST, _MOST = 1e-30, 1e30


def curves_json(curves: Mapping[str, Curves]) -> bytes:
    """Curves by the file stem of their figure as JSON: fields by name, arrays as lists, NaN as null."""
    content = {stem: {_KIND: type(one).__name__, **asdict(cast(Any, one))} for stem, one in curves.items()}
    return orjson.dumps(content, default=_plain, option=orjson.OPT_NON_STR_KEYS)


def read_curves(directory: Path) -> dict[str, Curves]:
    """Return the curves of a run by file stem, an empty mapping if it has no such file.

    Raises:
        DataError: `run-unreadable`, the file holds something else.
    """
    file = directory / FIGURES
    if not file.is_file():
        return {}
    try:
        content = orjson.loads(read_regular(file))
        return {stem: _curves(fields) for stem, fields in content.items()}
    except (ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError) as error:
        raise unreadable(file, str(error)) from error


def _plain(value: object) -> object:
    """What JSON has no type for."""
    if isinstance(value, np.generic):
        return value.item()
    if not isinstance(value, np.ndarray):
        raise TypeError(f"a figure cannot hold a {type(value).__name__}")
    if np.iscomplexobj(value):
        return {"re": _numbers(value.real), "im": _numbers(value.imag)}
    return _numbers(value)


def _numbers(values: np.ndarray) -> orjson.Fragment:
    size = np.abs(values[np.isfinite(values) & (values != 0)])
    short = not size.size or (size.min() > _LEAST and size.max() < _MOST)
    kept = np.ascontiguousarray(values, dtype=np.float32 if short else np.float64)
    return orjson.Fragment(orjson.dumps(kept, option=orjson.OPT_SERIALIZE_NUMPY))


def _curves(fields: dict[str, Any]) -> Curves:
    kinds = {kind.__name__: kind for kind in Curves.__subclasses__()}
    return read_plain(kinds[fields[_KIND]], fields)
