"""Tables as CSV, exact to the last bit and strict about their content; signals as files."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterable, Mapping

import numpy as np
import orjson

from inputdesign_cli.outcome.results import Array, Table

_A_LINE = 4  # numbers in a line of a C array


def csv_text(table: Table) -> str:
    """Return a header line and a line for each row, in the fewest digits that give back every bit.

    Raises:
        ValueError: A column that is not a real vector, or columns of different lengths.
    """
    columns = {name: np.asarray(values) for name, values in table.columns.items()}
    for name, values in columns.items():
        if values.ndim != 1 or values.dtype.kind not in "fiu":
            raise ValueError(f"column {name} is no real vector, but {values.dtype} of shape {values.shape}")
    if len({len(values) for values in columns.values()}) > 1:
        lengths = ", ".join(f"{name}: {len(values)}" for name, values in columns.items())
        raise ValueError(f"the columns of a table differ in length ({lengths})")
    rows = zip(*(_shortest(values) for values in columns.values()), strict=True)
    return csv_line(columns) + "".join(f"{','.join(row)}\n" for row in rows)


def csv_line(cells: Iterable[str]) -> str:
    """Write one line of a table; a cell with a comma, a quote or the end of a line in it is quoted.

    Spreadsheets run a text that begins like a formula, so an apostrophe goes before it: `'=1+1`. Numbers stay
    unchanged.
    """
    buffer, end = io.StringIO(), "\r\n"  # the writer quotes cells with a character of its line end
    csv.writer(buffer, lineterminator=end).writerow(map(_escaped, cells))
    return f"{buffer.getvalue().removesuffix(end)}\n"


# Leading apostrophes of the text count as well, so that removing one restores every text.
_FORMULA = re.compile(r"'*[=+\-@\t\r\n\uff1d\uff0b\uff0d\uff20]")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|-inf", re.ASCII | re.IGNORECASE)


def _escaped(cell: str) -> str:
    return f"'{cell}" if _FORMULA.match(cell) and not _NUMBER.fullmatch(cell) else cell


def _unescaped(cell: str) -> str:
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def shortest(value: float) -> str:
    """Return the shortest text of a number that gives it back, a whole one without its point."""
    return repr(value).removesuffix(".0")


def _shortest(values: Array) -> list[str]:
    """Return the shortest text of each of (n,) numbers, a whole one without its point."""
    if not np.all(np.isfinite(values)):
        return [shortest(value) for value in values.tolist()]
    if not values.size:
        return []
    native = np.ascontiguousarray(
        values, dtype=float if values.dtype.kind == "f" else values.dtype.newbyteorder("=")
    )
    text = orjson.dumps(native, option=orjson.OPT_SERIALIZE_NUMPY).decode()[1:-1]
    return f"{text},".replace(".0,", ",").split(",")[:-1]


def csv_columns(content: bytes) -> dict[str, Array]:
    """Return the columns of a table that `csv_text` made: name -> (n,).

    Raises:
        ValueError: it is no table of numbers.
    """
    header, *rows = csv_rows(content)
    values = np.array(rows, dtype=float).reshape(len(rows), len(header))
    return {name: values[:, i] for i, name in enumerate(header)}


def csv_rows(content: bytes) -> list[list[str]]:
    """Read the cells of each line of a table as `csv_line` was given them, its header first.

    Raises:
        ValueError: it is no table.
    """
    try:
        lines = csv.reader(io.StringIO(content.decode(), newline=""))
        return [[_unescaped(cell) for cell in line] for line in lines]
    except csv.Error as error:
        raise ValueError(str(error)) from error


def mat_bytes(channels: Mapping[str, Array], sample_time: float) -> bytes:
    """Return a file for MATLAB: columns under their names, which have no units, and `sample_time`."""
    import scipy.io

    content: dict[str, object] = {name.split()[0]: values[:, None] for name, values in channels.items()}
    buffer = io.BytesIO()
    scipy.io.savemat(buffer, content | {"sample_time": sample_time})
    # The first 116 bytes are a text with the date, which would make equal runs differ.
    return b"MATLAB 5.0 MAT-file".ljust(116) + buffer.getvalue()[116:]


def npz_bytes(channels: Mapping[str, Array], sample_time: float) -> bytes:
    """Return a file for numpy: columns under their names, and `sample_time`."""
    buffer = io.BytesIO()
    arrays = {name.split()[0]: values for name, values in channels.items()}
    np.savez(buffer, allow_pickle=False, **arrays, sample_time=np.asarray(sample_time))
    return buffer.getvalue()


def header_bytes(channels: Mapping[str, Array], sample_time: float) -> bytes:
    """Return a C header: an array of doubles for each channel but time, their length and sample time."""
    signals = {name: values for name, values in channels.items() if not name.startswith("time")}
    unit = next((name.removeprefix("time_") for name in channels if name.startswith("time_")), "s")
    samples = len(next(iter(signals.values())))
    lines = [
        "#pragma once",  # a guard macro would silently skip the header of another signal
        "",
        f"#define SIGNAL_SAMPLES {samples}",
        f"#define SIGNAL_SAMPLE_TIME {sample_time!r} /* {unit} */",
    ]
    for name, values in signals.items():
        head, _, label = name.partition(" ")
        note = f" /* {label.replace('*/', '* /')} */" if label else ""
        rows = [
            "    " + ", ".join(repr(float(v)) for v in values[i : i + _A_LINE])
            for i in range(0, samples, _A_LINE)
        ]
        lines += ["", f"static const double {head}[SIGNAL_SAMPLES] = {{{note}", ",\n".join(rows), "};"]
    return "\n".join([*lines, ""]).encode()


WRITERS: dict[str, Callable[[Mapping[str, Array], float], bytes]] = {
    "mat": mat_bytes,
    "npz": npz_bytes,
    "h": header_bytes,
}
"""The function that writes a file, by its ending."""
