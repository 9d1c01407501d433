"""Parquet and Excel, where pandas is installed (the extra `data`)."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from inputdesign_cli.tasks.build.files.sheet import Sheet, of_arrays, unreadable

PARQUET = (".parquet", ".pq")
EXCEL = (".xlsx", ".xls", ".xlsm", ".ods")


def read_frame(path: Path, key: str, raw: bytes) -> Sheet:
    """The columns of a parquet file, or of the first sheet of a workbook, that hold numbers.

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
    numbers = frame.select_dtypes("number")
    return of_arrays(path, key, [(str(name), np.asarray(numbers[name], dtype=float)) for name in numbers])
