"""Arrays of NumPy (.npz) and of MATLAB (.mat, up to version 7)."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files import isolated
from inputdesign_cli.tasks.build.files.named_arrays import of_arrays
from inputdesign_cli.tasks.build.files.pace import is_sample_time, pace_of
from inputdesign_cli.tasks.build.files.sheet import Sheet, unreadable

_MOST_BYTES = 2**30
_SHOWN, _FEWEST = 5, 2
_OBJECT = "an object"
# What scipy.sparse.save_npz writes, whatever the kind of the matrix.
_OF_SPARSE = {"format", "shape", "data"}
_CONVERT = (
    "in MATLAB: s = struct('u', data.InputData, 'y', data.OutputData, 'Ts', data.Ts);  "
    "then: save('data.mat', '-struct', 's', '-v7')"
)


def read_npz(path: Path, key: str, raw: bytes, named: str = "") -> Sheet:
    """The arrays of an .npz file, by their names.

    Args:
        named: the only one of them to read; empty: all.

    Raises:
        DataError: `data-unreadable`.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > _MOST_BYTES:
                raise unreadable(path, key, "unpacks to more than 1 GiB", "keep to what is needed")
        with np.load(io.BytesIO(raw), allow_pickle=False) as found:
            arrays = {name: _loaded(found, name) for name in found.files}
    except DataError:
        raise
    except Exception:  # whatever a broken archive leads the reader to
        hint = "write it with numpy.savez(file, u=.., y=..)"
        raise unreadable(path, key, "is no .npz file of numbers", hint) from None
    if arrays.keys() >= _OF_SPARSE:
        hint = "write it with numpy.savez(file, u=A.toarray()), where A is the matrix"
        raise unreadable(path, key, "holds a sparse matrix of SciPy, which has no name", hint)
    return _sheet(path, key, isolated.divided(arrays, named))


def read_npy(path: Path, key: str, raw: bytes) -> Sheet:
    """The columns of the one array in an .npy file, which have no names but for those of its fields.

    Raises:
        DataError: `data-unreadable`.
    """
    hint = "write several arrays, with names: numpy.savez('data.npz', u=.., y=..)"
    try:
        array = np.load(io.BytesIO(raw), allow_pickle=False)
    except Exception:  # whatever a broken file leads the reader to
        raise unreadable(path, key, "is no .npy file of numbers", hint) from None
    found = isolated.divided({"": array})
    if array.dtype.names:
        return _sheet(path, key, found)
    if not found.arrays or array.size < _FEWEST:
        held = found.left_out.get("", "a single number")
        raise unreadable(path, key, f"holds no columns of numbers, but {held}", hint)
    return replace(of_arrays(path, key, list(found.arrays.items())), names=(), head=(1, ""))


def _loaded(archive: Mapping[str, NDArray], name: str) -> NDArray:
    """An array of an archive; an empty one of objects in place of those, which are never unpickled."""
    try:
        return archive[name]
    except ValueError:
        return np.array([None])


def read_mat(path: Path, key: str, raw: bytes, named: str = "") -> Sheet:
    """The arrays of a .mat file, or the signals of an iddata that was saved as a struct.

    Args:
        named: the only variable to read; empty: all.

    Raises:
        DataError: `data-unreadable`; of an object that only MATLAB reads, with the lines that convert it.
    """
    found = isolated.arrays_of(raw, named)
    if found.fault == isolated.NEWER:
        hint = "in MATLAB: save('data.mat', 'u', 'y', '-v7')"
        raise unreadable(path, key, "is a .mat file of version 7.3", hint)
    if found.fault == isolated.BROKEN:
        raise unreadable(path, key, "is no .mat file that can be read", "save it in MATLAB anew")
    return _sheet(path, key, found)


def _sheet(path: Path, key: str, found: isolated.Arrays) -> Sheet:
    """The signals are what has several rows.

    Raises:
        DataError: `data-unreadable`, nothing has, or two have signals of one name.
    """
    if found.fault == isolated.ABSENT:
        raise unreadable(path, key, "has no such variable", f"it holds {', '.join(found.held)}")
    if found.fault == isolated.SEVERAL:
        one, other, signal = found.held
        what = f"holds {one} and {other}, each with a {signal} of its own"
        name = path.name.partition("#")[0]
        hint = f"name one as '{name}#{one}', or '{name}#{other}', or save each in a file of its own"
        raise unreadable(path, key, what, hint)
    signals, left_out = [], dict(found.left_out)
    for name, value in found.arrays.items():
        if value.size > 1:
            signals.append((name, value))
        elif not is_sample_time(name):
            left_out[name] = "a single number"
    if found.opaque:
        left_out[_OBJECT] = "what only MATLAB reads"
    if not signals:
        told = "; ".join(f"{name} holds {what}" for name, what in list(left_out.items())[:_SHOWN])
        of_matlab = path.suffix.lower().startswith(".mat")
        hint = _CONVERT if of_matlab else "write it with numpy.savez(file, u=.., y=..)"
        raise unreadable(path, key, f"holds no arrays of numbers{f' ({told})' if told else ''}", hint)
    if found.opaque:
        left_out[_OBJECT] += f" ({_CONVERT})"
    return replace(of_arrays(path, key, signals), left_out=left_out, pace=pace_of(found))
