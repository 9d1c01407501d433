"""A file of data becomes a sheet: its ending says the kind."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import STANDARD_STREAM, DataError
from inputdesign_cli.records.arrays import MOST_UNPACKED, arrays_of_mat, columns_of_arrays
from inputdesign_cli.records.sheet import Preparation, Sheet, Source
from inputdesign_cli.records.text import decoded, sheet_of, table_in
from inputdesign_cli.regular_file import read_regular

_MOST_BYTES = 100 * 2**20
_PARQUET = (".parquet", ".pq")
_EXCEL = (".xlsx", ".xls", ".xlsm", ".ods")
_OF_VARIABLES = (".mat", ".npz")


def read_sheet(path: Path, *, key: str = "", preparation: Preparation | None = None) -> Sheet:
    """Return the columns of a data file; its ending says the kind.

    Args:
        key: the key of the spec that names the file, for diagnostics.
        preparation: separator, decimal mark and form of times, where the user says so.

    Raises:
        DataError: `data-unreadable`, `data-extra-field`.
    """
    source = Source(path, key, preparation or Preparation())
    file, _, named = path.name.partition("#")
    kind = Path(file).suffix.lower()
    if kind not in (*_EXCEL, *_OF_VARIABLES):  # only their sheets and variables have names
        kind, named = path.suffix.lower(), ""
    raw = _bytes(source, path.with_name(file) if named else path)
    if len(raw) > _MOST_BYTES:
        raise source.unreadable("is larger than 100 MiB", "keep the rows and columns that are needed")
    if kind in (*_EXCEL, ".npz"):
        _check_unpacked(source, raw)
    if kind in _OF_VARIABLES:
        values = _arrays_of_npz(source, raw) if kind == ".npz" else arrays_of_mat(source, raw)
        names, columns, step, unit = columns_of_arrays(source, values, named)
        sheet = _of_columns(source, names, columns)
        return replace(sheet, texts=(), sample_time=step, time_unit=unit)
    if kind in _PARQUET:
        frame = _loaded(source, "a parquet file", lambda pandas: _frame(pandas, source, raw))
        return _of_columns(source, list(map(str, frame)), [frame[name].to_numpy() for name in frame])
    return _workbook(source, raw, named) if kind in _EXCEL else table_in(source, decoded(source, raw))


def _bytes(source: Source, path: Path) -> bytes:
    try:
        return read_regular(path, _MOST_BYTES + 1)
    except FileNotFoundError:
        what, hint = "does not exist", "check its name; paths in a spec begin at the folder of the spec"
        if str(path) == STANDARD_STREAM:
            hint = "data are not read from standard input: write them to a file, and name that"
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        what, hint = f"cannot be read: {reason}", "name a CSV file"
    raise source.unreadable(what, hint)


def _check_unpacked(source: Source, raw: bytes) -> None:
    """Raise `DataError` (`data-unreadable`) for an archive that unpacks to too much."""
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
    except Exception:  # its reader says what is wrong with a broken one
        return
    if size > MOST_UNPACKED:
        raise source.unreadable("unpacks to more than 1 GiB", "keep the rows that are needed")


def _arrays_of_npz(source: Source, raw: bytes) -> dict[str, Any]:
    try:
        with np.load(io.BytesIO(raw), allow_pickle=False) as found:
            return {name: found[name] for name in found.files}
    except Exception:  # a broken archive makes its reader raise anything; objects are never unpickled
        hint = "write it with numpy.savez(file, u=.., y=..)"
        raise source.unreadable("is no .npz file of numbers", hint) from None


def _workbook(source: Source, raw: bytes, named: str) -> Sheet:
    """Read the table in a sheet of a workbook, the first unless one is named; lines are its rows."""
    how = {"header": None, "sheet_name": None, "dtype": object}
    frames = _loaded(source, "a workbook", lambda pandas: pandas.read_excel(io.BytesIO(raw), **how))
    if named and named not in frames:
        raise source.unreadable("has no such sheet", f"the sheets are {', '.join(frames)}")
    first, *others = frames
    rows = map(_written, frames[named or first].to_numpy(dtype=object))
    given = replace(source.given, separator="\t", decimal=".")
    stated = replace(source, given=given, others=() if named else tuple(others))
    return table_in(stated, "\n".join(map("\t".join, rows)))


def _frame(pandas: Any, source: Source, raw: bytes) -> Any:
    """Read the frame in a parquet file, with its index in columns before the others."""
    parquet = import_module("pyarrow.parquet").ParquetFile(io.BytesIO(raw))
    if 8 * parquet.metadata.num_rows * len(parquet.schema_arrow.names) > MOST_UNPACKED:
        raise source.unreadable("unpacks to more than 1 GiB", "keep the rows that are needed")
    frame = pandas.read_parquet(io.BytesIO(raw))
    plain = isinstance(frame.index, pandas.RangeIndex) and frame.index.name is None
    return frame if plain else frame.reset_index()


def _loaded(source: Source, kind: str, load: Callable[[Any], Any]) -> Any:
    import pandas

    try:
        return load(pandas)
    except ImportError:
        hint = 'install what reads it: pip install "inputdesign-cli[data]"; or save it as CSV'
        raise source.unreadable(f"is {kind}, and what reads it is not installed", hint) from None
    except DataError:
        raise
    except Exception:  # a broken file makes its reader raise anything
        raise source.unreadable(f"is not {kind} that can be read", "save it as CSV") from None


def _of_columns(source: Source, names: Sequence[str], columns: Sequence[NDArray]) -> Sheet:
    """Build the sheet of a file that stores columns as such; their numbers have decimal points."""
    rows = zip(*map(_written, columns), strict=True)
    body = [(line, list(row)) for line, row in enumerate(rows, start=1)]
    stated = replace(source, given=replace(source.given, decimal="."))
    return sheet_of(stated, (1, ", ".join(names)), names, body)


def _written(values: NDArray) -> list[str]:
    """Return numbers, dates, lengths of time or text as cells of text, numbers with a decimal point."""
    if values.dtype.kind == "m":
        values = values / np.timedelta64(1, "s")
    if values.dtype.kind in "fiub":
        return [repr(value) for value in values.astype(float).tolist()]
    return [_cell(value) for value in values]


def _cell(value: object) -> str:
    if value is None or str(value) in ("nan", "NaT", "<NA>"):
        return ""
    return repr(float(value)) if isinstance(value, Real) else " ".join(str(value).replace('"', " ").split())
