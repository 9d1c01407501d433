"""Parquet and Excel, where pandas is installed (the extra `data`)."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import replace
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.tasks.build.files.isolated import divided
from inputdesign_cli.tasks.build.files.sheet import Sheet, of_arrays, unreadable
from inputdesign_cli.tasks.build.files.text import read_text

PARQUET = (".parquet", ".pq")
EXCEL = (".xlsx", ".xls", ".xlsm", ".ods")

# What would end a cell, a row or a quote.
_MARKS = re.compile(r'[\t\r\n\v\f\x1c-\x1e\x85\u2028\u2029"]')


def read_parquet(path: Path, key: str, raw: bytes) -> Sheet:
    """The columns of a parquet file that hold numbers or dates.

    Raises:
        DataError: `data-unreadable`.
    """
    frame = _loaded(path, key, "a parquet file", lambda pandas: pandas.read_parquet(io.BytesIO(raw)))
    arrays = {str(name): np.asarray(frame[name]) for name in frame}
    found = divided({name: _bare(array) for name, array in arrays.items()})
    return replace(of_arrays(path, key, list(found.arrays.items())), left_out=found.left_out)


def read_workbook(path: Path, key: str, raw: bytes) -> Sheet:
    """The table in the first sheet of a workbook, found as in a file of text; lines are its rows.

    Raises:
        DataError: `data-unreadable`, `data-extra-field`.
    """
    frame = _loaded(
        path, key, "an Excel workbook", lambda pandas: pandas.read_excel(io.BytesIO(raw), header=None)
    )
    rows = frame.astype(object).to_numpy()
    text = "\n".join("\t".join(map(_written, row)) for row in rows)
    return read_text(path, key, text, separated_by="\t")


def _loaded(path: Path, key: str, kind: str, load: Callable[[Any], Any]) -> Any:
    try:
        import pandas

        return load(pandas)
    except ImportError:
        hint = 'install what reads it: pip install "inputdesign-cli[data]"; or save it as CSV'
        raise unreadable(path, key, f"is {kind}, and pandas is not installed", hint) from None
    except Exception:  # whatever a broken file leads the reader to
        raise unreadable(path, key, f"is not {kind} that can be read", "save it as CSV") from None


def _written(cell: object) -> str:
    """A cell as text: numbers with a point, so that none looks like one with a mark between thousands."""
    if cell is None or cell != cell:  # NaN, or no date
        return ""
    return repr(float(cell)) if isinstance(cell, Real) else _MARKS.sub(" ", str(cell))


def _bare(array: NDArray) -> NDArray:
    """Cells that are all numbers or empty as numbers."""
    if array.dtype.kind != "O":
        return array
    try:
        return np.array([np.nan if cell is None else cell for cell in array.tolist()], dtype=float)
    except (TypeError, ValueError):
        return array
