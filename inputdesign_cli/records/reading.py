"""A file of data becomes a sheet: its ending says the kind."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

from inputdesign_cli.errors import STANDARD_STREAM, DataError
from inputdesign_cli.records.arrays import MOST_UNPACKED, check_unpacked, read_mat, read_npz
from inputdesign_cli.records.moments import with_days
from inputdesign_cli.records.preparation import Preparation
from inputdesign_cli.records.sheet import Sheet, unreadable
from inputdesign_cli.records.text import decoded, read_text, sheet_of, written_out
from inputdesign_cli.regular_file import read_regular

_MOST_BYTES = 100 * 2**20
PARQUET = (".parquet", ".pq")
EXCEL = (".xlsx", ".xls", ".xlsm", ".ods")
_OF_VARIABLES = (".mat", ".npz")


def read_sheet(path: Path, *, key: str = "", preparation: Preparation | None = None) -> Sheet:
    """Return the columns of a data file, times of a day with their days.

    Args:
        key: the key of the spec that names the file, for diagnostics.
        preparation: separator, decimal mark and form of times, where the user says so.

    Raises:
        DataError: `data-unreadable`, `data-extra-field`.
    """
    return with_days(_read(path, key, preparation or Preparation()))


def _read(path: Path, key: str, given: Preparation) -> Sheet:
    file, _, named = path.name.partition("#")
    kind = Path(file).suffix.lower()
    if kind not in (*EXCEL, *_OF_VARIABLES):  # only their sheets and variables have names
        kind, named = path.suffix.lower(), ""
    raw = _bytes(path.with_name(file) if named else path, key)
    if len(raw) > _MOST_BYTES:
        raise unreadable(path, key, "is larger than 100 MiB", "keep the rows and columns that are needed")
    if kind == ".npz":  # an archive itself
        return read_npz(path, key, raw, named, given)
    if kind == ".mat":
        return read_mat(path, key, raw, named, given)
    if kind in PARQUET:
        return _read_parquet(path, key, raw, given)
    if kind in EXCEL:
        check_unpacked(path, key, raw)
        return _read_workbook(path, key, raw, named, given)
    return read_text(path, key, decoded(path, key, raw), given)


def _bytes(path: Path, key: str) -> bytes:
    try:
        return read_regular(path, _MOST_BYTES + 1)
    except FileNotFoundError:
        what, hint = "does not exist", "check the name and the folder"
        if str(path) == STANDARD_STREAM:
            what += ": data are not read from standard input"
            hint = "write them to a file, whose ending shows its kind, and name that"
        elif key:
            hint = "paths are relative to the folder of the spec"
        raise unreadable(path, key, what, hint) from None
    except IsADirectoryError:
        raise unreadable(path, key, "is a folder", "name a CSV file") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise unreadable(path, key, f"cannot be read: {reason}", "name a CSV file") from None


def _read_parquet(path: Path, key: str, raw: bytes, given: Preparation) -> Sheet:
    """The columns of a parquet file, its index among them."""
    frame = _loaded(path, key, "a parquet file", lambda pandas: _frame(pandas, path, key, raw))
    names = [str(name) for name in frame]
    rows = zip(*(written_out(frame[name].to_numpy()) for name in frame), strict=True)
    body = [(line, list(row)) for line, row in enumerate(rows, start=1)]
    return sheet_of(path, key, (1, ", ".join(names)), names, body, replace(given, decimal="."))


def _read_workbook(path: Path, key: str, raw: bytes, named: str, given: Preparation) -> Sheet:
    """The table in a sheet of a workbook, the first unless one is named; lines are its rows."""
    how = {"header": None, "sheet_name": None, "dtype": object}
    frames = _loaded(path, key, "a workbook", lambda pandas: pandas.read_excel(io.BytesIO(raw), **how))
    if named and named not in frames:
        raise unreadable(path, key, "has no such sheet", f"the sheets are {', '.join(frames)}")
    first, *others = frames
    rows = map(written_out, frames[named or first].to_numpy(dtype=object))
    stated = replace(given, separator="\t", decimal=".")
    try:
        sheet = read_text(path, key, "\n".join(map("\t".join, rows)), stated)
    except DataError as error:
        also = (
            f"; its sheets are {', '.join(frames)}: name one as '{path.name}#{others[0]}'" if others else ""
        )
        raise DataError([replace(one, hint=f"{one.hint}{also}") for one in error.diagnostics]) from None
    return replace(sheet, others=() if named else tuple(others))


def _frame(pandas: Any, path: Path, key: str, raw: bytes) -> Any:
    """The frame in a parquet file, with its index in columns before the others."""
    parquet = import_module("pyarrow.parquet").ParquetFile(io.BytesIO(raw))
    names = parquet.schema_arrow.names
    if 8 * parquet.metadata.num_rows * len(names) > MOST_UNPACKED:
        raise unreadable(path, key, "unpacks to more than 1 GiB", "keep the rows that are needed")
    frame = pandas.read_parquet(io.BytesIO(raw))
    if isinstance(frame.index, pandas.RangeIndex) and frame.index.name is None:
        return frame
    if frame.index.nlevels == 1 and frame.index.name is None:
        frame.index.name = "time" if pandas.api.types.is_datetime64_any_dtype(frame.index.dtype) else "index"
    return frame.reset_index()


def _loaded(path: Path, key: str, kind: str, load: Callable[[Any], Any]) -> Any:
    import pandas

    try:
        return load(pandas)
    except ImportError:
        hint = 'install what reads it: pip install "inputdesign-cli[data]"; or save it as CSV'
        raise unreadable(path, key, f"is {kind}, and what reads it is not installed", hint) from None
    except DataError:
        raise
    except Exception:  # a broken file makes its reader raise anything
        raise unreadable(path, key, f"is not {kind} that can be read", "save it as CSV") from None
