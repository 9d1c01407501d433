"""figures.json: the content of the figures of a run, so that a page draws them again, in its own size."""

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


def curves_json(curves: Mapping[str, Curves]) -> bytes:
    """Return curves by the file stem of their figure as JSON: arrays are lists, NaN is null."""
    content = {stem: {_KIND: type(one).__name__, **asdict(cast(Any, one))} for stem, one in curves.items()}
    return orjson.dumps(content, default=_plain, option=orjson.OPT_NON_STR_KEYS | orjson.OPT_SERIALIZE_NUMPY)


def _plain(value: object) -> object:
    """Return values without a type in JSON: complex numbers, and arrays that are not contiguous."""
    if not isinstance(value, np.ndarray):
        raise TypeError(f"a figure cannot hold a {type(value).__name__}")
    if np.iscomplexobj(value):
        return {"re": np.ascontiguousarray(value.real), "im": np.ascontiguousarray(value.imag)}
    return np.ascontiguousarray(value)


def read_curves(directory: Path) -> dict[str, Curves]:
    """Return the curves of a run by file stem, an empty mapping if it has no such file.

    Raises:
        DataError: `run-unreadable`, the file holds something else.
    """
    file = directory / FIGURES
    if not file.is_file():
        return {}
    try:
        kinds = {kind.__name__: kind for kind in Curves.__subclasses__()}
        content = orjson.loads(read_regular(file))
        return {stem: read_plain(kinds[fields[_KIND]], fields) for stem, fields in content.items()}
    except (ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError) as error:
        raise unreadable(file, str(error)) from error
