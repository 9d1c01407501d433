"""Parquet and Excel, where pandas is installed (the extra `data`)."""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files.isolated import divided
from inputdesign_cli.tasks.build.files.named_arrays import of_arrays
from inputdesign_cli.tasks.build.files.sheet import Column, Sheet, elsewhere, unreadable
from inputdesign_cli.tasks.build.files.text import FORMULA, column_of, read_text

PARQUET = (".parquet", ".pq")
EXCEL = (".xlsx", ".xls", ".xlsm", ".ods")

# A sheet with fewer rows of values may have formulas in all others.
_FEW_ROWS = 3
# What would end a cell, a row or a quote.
_MARKS = re.compile(r'[\t\r\n\v\f\x1c-\x1e\x85\u2028\u2029"]')


def read_parquet(path: Path, key: str, raw: bytes) -> Sheet:
    """The columns of a parquet file that hold numbers or dates.

    Raises:
        DataError: `data-unreadable`.
    """
    every = _loaded(path, key, "a parquet file", lambda pandas: _series(pandas, path, key, raw))
    arrays = {name: _bare(array) for name, array in every.items()}
    dated = {name: column for name, array in arrays.items() for column in _dated(array)}
    found = divided({name: dated[name].numbers if name in dated else arrays[name] for name in arrays})
    sheet = of_arrays(path, key, list(found.arrays.items()))
    columns = (dated.get(name, column) for name, column in zip(sheet.names, sheet.columns, strict=True))
    return replace(sheet, columns=tuple(columns), left_out=found.left_out)


def read_workbook(path: Path, key: str, raw: bytes, named: str = "") -> Sheet:
    """The table in a sheet of a workbook, found as in a file of text; lines are its rows.

    Args:
        named: the sheet; empty: the first.

    Raises:
        DataError: `data-unreadable`, `data-extra-field`.
    """
    frames = _loaded(
        path,
        key,
        "an Excel workbook",
        lambda pandas: pandas.read_excel(io.BytesIO(raw), header=None, sheet_name=None),
    )
    if named and named not in frames:
        raise unreadable(path, key, "has no such sheet", f"the sheets are {', '.join(frames)}")
    first = next(iter(frames))
    others = () if named else tuple(name for name in frames if name != first)
    rows = frames[named or first].astype(object).to_numpy()
    text = "\n".join("\t".join(map(_written, row)) for row in _with_formulas(rows, raw, named or first))
    try:
        return replace(read_text(path, key, text, separated_by="\t"), others=others)
    except DataError as error:
        told = elsewhere(path, others)
        raise DataError([replace(d, hint=f"{d.hint}{told}") for d in error.diagnostics]) from None


def _with_formulas(rows: NDArray[np.object_], raw: bytes, name: str) -> NDArray[np.object_]:
    """Cells whose formulas have no values in the file, as those formulas; rows of nothing else are added.

    They are looked for where a column is empty in more than half of its rows; other kinds of workbooks stay.
    """
    empty = np.array([[_written(cell) == "" for cell in row] for row in rows], dtype=bool).reshape(rows.shape)
    if len(rows) >= _FEW_ROWS and not np.any(2 * empty.sum(axis=0) > len(rows)):
        return rows
    try:
        book = import_module("openpyxl").load_workbook(io.BytesIO(raw), read_only=True)
        cells = list(book[name].iter_rows(values_only=True))
    except Exception:  # other kinds, or whatever a broken file leads the reader to
        return rows
    formulas = {(i, j): _formula(cell) for i, row in enumerate(cells) for j, cell in enumerate(row)}
    held = {at: text for at, text in formulas.items() if text}
    shape = np.max([rows.shape, *(np.add(at, 1) for at in held)], axis=0)
    filled = np.full(shape, None, dtype=object)
    filled[: rows.shape[0], : rows.shape[1]] = rows
    for at, text in held.items():
        if _written(filled[at]) == "":
            filled[at] = text
    return filled


def _formula(cell: object) -> str:
    """The formula in a cell, which may be one for several cells; nothing where there is none."""
    text = getattr(cell, "text", cell)
    return text if isinstance(text, str) and text.startswith(FORMULA) else ""


def _series(pandas: Any, path: Path, key: str, raw: bytes) -> dict[str, NDArray]:
    """The columns of a frame by their names, before them what stands in its index; times of a zone in UTC.

    Raises:
        DataError: `data-unreadable`; columns have one name.
    """
    try:
        frame = pandas.read_parquet(io.BytesIO(raw))
    except ValueError:
        again = _repeated(raw)
        if not again:
            raise
        what = f"has several columns of one name: {', '.join(again)}"
        raise unreadable(path, key, what, "give each column a name of its own, or save it as CSV") from None
    levels = [frame.index.get_level_values(i) for i in range(frame.index.nlevels)]
    found: dict[str, NDArray] = {}
    for level in levels:
        if level.name is not None or not isinstance(level, pandas.RangeIndex):
            dated = pandas.api.types.is_datetime64_any_dtype(level.dtype)
            name = level.name if level.name is not None else "time" if dated else "index"
            if str(name) not in map(str, frame):
                found[str(name)] = _plain(pandas, level.to_series())
    return found | {str(name): _plain(pandas, frame[name]) for name in frame}


def _repeated(raw: bytes) -> list[str]:
    """The names in a parquet file that several columns have."""
    names = import_module("pyarrow.parquet").read_schema(io.BytesIO(raw)).names
    return sorted(name for name, count in Counter(names).items() if count > 1)


def _plain(pandas: Any, series: Any) -> NDArray:
    if isinstance(series.dtype, pandas.DatetimeTZDtype):
        return np.asarray(series.dt.tz_convert(None))
    if pandas.api.types.is_extension_array_dtype(series.dtype) and pandas.api.types.is_numeric_dtype(series):
        return np.asarray(series.to_numpy(dtype=float, na_value=np.nan))
    return np.asarray(series)


def _dated(array: NDArray) -> list[Column]:
    """The column of dates and times, read or not, of cells of text or of Python's dates; none of others."""
    if array.dtype.kind not in "OUT":
        return []
    column = column_of([_written(cell) for cell in array.ravel()])
    return [column] if column.dated or column.undated else []


def _loaded(path: Path, key: str, kind: str, load: Callable[[Any], Any]) -> Any:
    try:
        import pandas

        return load(pandas)
    except ImportError:
        hint = 'install what reads it: pip install "inputdesign-cli[data]"; or save it as CSV'
        raise unreadable(path, key, f"is {kind}, and pandas is not installed", hint) from None
    except DataError:
        raise
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
