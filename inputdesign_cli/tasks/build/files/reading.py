"""A file -> its sheet: the ending tells the kind."""

from __future__ import annotations

from pathlib import Path

from inputdesign_cli.errors import STANDARD_STREAM
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.tasks.build.files.arrays import read_mat, read_npy, read_npz
from inputdesign_cli.tasks.build.files.clocks import with_days
from inputdesign_cli.tasks.build.files.decoding import decoded
from inputdesign_cli.tasks.build.files.frames import EXCEL, PARQUET, read_parquet, read_workbook
from inputdesign_cli.tasks.build.files.numeric_dates import with_numeric_dates
from inputdesign_cli.tasks.build.files.packed import check_unpacked
from inputdesign_cli.tasks.build.files.sheet import Sheet, unreadable
from inputdesign_cli.tasks.build.files.text import read_text

_MOST_BYTES = 100 * 2**20
_OF_VARIABLES = (".mat", ".npz")


def read_sheet(path: Path, *, key: str) -> Sheet:
    """The columns of a data file, its times of a day with their days.

    Args:
        key: the key of the spec that names the file, for diagnostics.

    Raises:
        DataError: `data-unreadable`, `data-extra-field`.
    """
    return with_days(with_numeric_dates(_read(path, key)))


def _read(path: Path, key: str) -> Sheet:
    file, _, named = path.name.partition("#")
    kind = Path(file).suffix.lower()
    if kind not in (*EXCEL, *_OF_VARIABLES):  # whose sheets and variables alone have names
        kind, named = path.suffix.lower(), ""
    raw = _bytes(path.with_name(file) if named else path, key)
    if len(raw) > _MOST_BYTES:
        raise unreadable(path, key, "is larger than 100 MiB", "keep the rows and columns that are needed")
    if kind == ".npz":  # an archive itself
        return read_npz(path, key, raw, named)
    check_unpacked(path, key, raw, workbook=kind in EXCEL)
    if kind == ".mat":
        return read_mat(path, key, raw, named)
    if kind == ".npy":
        return read_npy(path, key, raw)
    if kind in PARQUET:
        return read_parquet(path, key, raw)
    if kind in EXCEL:
        return read_workbook(path, key, raw, named)
    return read_text(path, key, decoded(path, key, raw))


def _bytes(path: Path, key: str) -> bytes:
    try:
        return read_regular(path, _MOST_BYTES + 1)
    except FileNotFoundError:
        if str(path) == STANDARD_STREAM:
            hint = "write them to a file, whose ending tells its kind, and name that"
            raise unreadable(
                path, key, "does not exist: data are not read from standard input", hint
            ) from None
        hint = "paths are relative to the folder of the spec" if key else "check the name and the folder"
        raise unreadable(path, key, "does not exist", hint) from None
    except IsADirectoryError:
        raise unreadable(path, key, "is a folder", "name a CSV file") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise unreadable(path, key, f"cannot be read: {reason}", "name a CSV file") from None
