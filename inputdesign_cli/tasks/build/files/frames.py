"""Parquet and Excel, where pandas is installed (the extra `data`)."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.tasks.build.files.isolated import divided
from inputdesign_cli.tasks.build.files.sheet import Sheet, of_arrays, unreadable

PARQUET = (".parquet", ".pq")
EXCEL = (".xlsx", ".xls", ".xlsm", ".ods")


def read_frame(path: Path, key: str, raw: bytes) -> Sheet:
    """The columns of a parquet file, or of the first sheet of a workbook, that hold numbers or dates.

    Raises:
        DataError: `data-unreadable`.
    """
    kind = "a parquet file" if path.suffix.lower() in PARQUET else "an Excel workbook"
    try:
        import pandas

        reader = pandas.read_parquet if path.suffix.lower() in PARQUET else pandas.read_excel
        frame = reader(io.BytesIO(raw))
    except ImportError:
        hint = 'install what reads it: pip install "inputdesign-cli[data]"; or save it as CSV'
        raise unreadable(path, key, f"is {kind}, and pandas is not installed", hint) from None
    except Exception:  # whatever a broken file leads the reader to
        raise unreadable(path, key, f"is not {kind} that can be read", "save it as CSV") from None
    arrays = {str(name): np.asarray(frame[name]) for name in frame}
    found = divided({name: _bare(array) for name, array in arrays.items()})
    return replace(of_arrays(path, key, list(found.arrays.items())), left_out=found.left_out)


def _bare(array: NDArray) -> NDArray:
    """Cells that are all numbers or empty as numbers."""
    if array.dtype.kind != "O":
        return array
    try:
        return np.array([np.nan if cell is None else cell for cell in array.tolist()], dtype=float)
    except (TypeError, ValueError):
        return array
