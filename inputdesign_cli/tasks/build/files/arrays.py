"""Arrays of NumPy (.npz) and of MATLAB (.mat, up to version 7)."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files import isolated
from inputdesign_cli.tasks.build.files.sheet import Array, Sheet, of_arrays, unreadable

_MOST_BYTES = 2**30
_SAMPLE_TIMES = ("ts", "sample_time", "dt")
_CONVERT = (
    "in MATLAB: s = struct('u', data.InputData, 'y', data.OutputData, 'Ts', data.Ts);  "
    "then: save('data.mat', '-struct', 's', '-v7')"
)


def read_npz(path: Path, key: str, raw: bytes) -> Sheet:
    """The arrays of an .npz file, by their names.

    Raises:
        DataError: `data-unreadable`.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > _MOST_BYTES:
                raise unreadable(path, key, "unpacks to more than 1 GiB", "keep to what is needed")
        with np.load(io.BytesIO(raw), allow_pickle=False) as found:
            arrays = {name: found[name] for name in found.files}
    except DataError:
        raise
    except Exception:  # whatever a broken archive leads the reader to
        hint = "write it with numpy.savez(file, u=.., y=..)"
        raise unreadable(path, key, "is no .npz file of numbers", hint) from None
    return _sheet(path, key, arrays)


def read_mat(path: Path, key: str, raw: bytes) -> Sheet:
    """The arrays of a .mat file, or the signals of an iddata that was saved as a struct.

    Raises:
        DataError: `data-unreadable`; of an object that only MATLAB reads, with the lines that convert it.
    """
    found = isolated.arrays_of(raw)
    if found.fault == isolated.NEWER:
        hint = "in MATLAB: save('data.mat', 'u', 'y', '-v7')"
        raise unreadable(path, key, "is a .mat file of version 7.3", hint)
    if found.fault:
        raise unreadable(path, key, "is no .mat file that can be read", "save it in MATLAB anew")
    if not any(value.size > 1 for value in found.arrays.values()):
        what = "holds an object that only MATLAB reads" if found.opaque else "holds no arrays of numbers"
        raise unreadable(path, key, what, _CONVERT)
    return _sheet(path, key, found.arrays)


def _sheet(path: Path, key: str, arrays: Mapping[str, NDArray]) -> Sheet:
    """Scalars called Ts, sample_time or dt are the sample time; the signals are what has several rows."""
    numbers = {name: value for name, value in arrays.items() if isolated.is_numeric(value)}
    times = [
        float(np.ravel(value)[0])
        for name, value in numbers.items()
        if name.lower() in _SAMPLE_TIMES and value.size == 1
    ]
    signals: list[tuple[str, Array]] = [
        (name, np.asarray(value, dtype=float)) for name, value in numbers.items() if value.size > 1
    ]
    return of_arrays(path, key, signals, times[0] if times else None)
