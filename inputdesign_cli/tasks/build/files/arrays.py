"""Arrays of NumPy (.npz) and of MATLAB (.mat, up to version 7)."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from inputdesign_cli.tasks.build.files.sheet import Array, Sheet, of_arrays, unreadable

_MOST_BYTES = 2**30
_SAMPLE_TIMES = ("ts", "sample_time", "dt")
# The fields of a saved iddata, and how its columns are called here.
_IDDATA = {"inputdata": "u", "outputdata": "y", "samplinginstants": "time"}
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
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        hint = "write it with numpy.savez(file, u=.., y=..)"
        raise unreadable(path, key, f"is no .npz file of numbers: {error}", hint) from None
    return _sheet(path, key, arrays)


def read_mat(path: Path, key: str, raw: bytes) -> Sheet:
    """The arrays of a .mat file, or the signals of an iddata that was saved as a struct.

    Raises:
        DataError: `data-unreadable`; of an object that only MATLAB reads, with the lines that convert it.
    """
    import warnings

    import scipy.io

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = scipy.io.loadmat(io.BytesIO(raw), simplify_cells=True)
    except NotImplementedError:
        hint = "in MATLAB: save('data.mat', 'u', 'y', '-v7')"
        raise unreadable(path, key, "is a .mat file of version 7.3", hint) from None
    except Exception as error:  # the reader raises whatever a broken file leads it to
        raise unreadable(path, key, f"is no .mat file: {error}", "save it in MATLAB anew") from None
    arrays = {name: value for name, value in found.items() if not name.startswith("__")}
    arrays = {name: _plain(value) for name, value in arrays.items()}
    flat: dict[str, Any] = {}
    for name, value in arrays.items():
        flat |= value if isinstance(value, Mapping) else {name: value}
    kept = {name: value for name, value in flat.items() if _numeric(value)}
    if not any(np.size(value) > 1 for value in kept.values()):
        opaque = "__function_workspace__" in found
        what = "holds an object that only MATLAB reads" if opaque else "holds no arrays of numbers"
        raise unreadable(path, key, what, _CONVERT)
    return _sheet(path, key, kept)


def _plain(value: Any) -> Any:
    """A struct by the names of this house, where it is a saved iddata."""
    if not isinstance(value, Mapping):
        return value
    fields = {str(name).lower(): item for name, item in value.items()}
    if "outputdata" not in fields:
        return dict(value)
    return {_IDDATA.get(name, name): item for name, item in fields.items() if np.size(item)}


def _numeric(value: Any) -> bool:
    array = np.asarray(value)
    return array.dtype.kind in "fiub" and array.ndim <= 2


def _sheet(path: Path, key: str, arrays: Mapping[str, Any]) -> Sheet:
    """Scalars called Ts, sample_time or dt are the sample time; the signals are what has several rows."""
    times = [
        float(np.ravel(value)[0])
        for name, value in arrays.items()
        if name.lower() in _SAMPLE_TIMES and np.size(value) == 1 and _numeric(value)
    ]
    signals: list[tuple[str, Array]] = [
        (name, np.asarray(value, dtype=float))
        for name, value in arrays.items()
        if _numeric(value) and np.size(value) > 1
    ]
    return of_arrays(path, key, signals, times[0] if times else None)
