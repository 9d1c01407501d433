"""Arrays of NumPy (.npz) and of MATLAB (.mat, up to version 7) as columns."""

from __future__ import annotations

import io
import struct
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.records.sheet import Source

MOST_UNPACKED = 2**30
_MATLAB = (
    "in MATLAB: s = struct('u', data.InputData, 'y', data.OutputData, 'Ts', data.Ts);  then: "
    "save('data.mat', '-struct', 's', '-v7')"
)
# The fields of a saved iddata, and how its columns are called here.
_IDDATA = {"InputData": "u", "OutputData": "y", "SamplingInstants": "time"}
_SAMPLE_TIMES, _TIME_UNITS = ("ts", "sample_time", "dt"), ("timeunit", "time_unit")
_TIMES = ("time", "t", "tout")
# Types of the elements of MATLAB's files: numbers and texts, arrays, and compressed elements.
_PLAIN, _ARRAY, _COMPRESSED = {*range(1, 8), 9, 12, 13, 16, 17, 18}, 14, 15
_DEEPEST = 30


def arrays_of_mat(source: Source, raw: bytes) -> dict[str, Any]:
    """Return the variables of a .mat file.

    Raises:
        DataError: `data-unreadable`.
    """
    import warnings

    import scipy.io

    try:
        if raw[:4].count(0) == 0 and raw[124:126] != b"\x00\x02":  # version 4 has zeros there, 7.3 is HDF5
            _check_elements(raw[128:], "<" if raw[126:128] == b"IM" else ">", MOST_UNPACKED)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = scipy.io.loadmat(io.BytesIO(raw), simplify_cells=True)
    except NotImplementedError:
        hint = "in MATLAB: save('data.mat', 'u', 'y', '-v7')"
        raise source.unreadable("is a .mat file of version 7.3", hint) from None
    except Exception:  # a broken file makes its reader raise anything
        raise source.unreadable("is no .mat file that can be read", "save it in MATLAB anew") from None
    return {name: value for name, value in found.items() if name[:2] != "__"}


def _check_elements(data: bytes, order: str, most: int, depth: int = 0) -> int:
    """Check the sizes in a .mat file, at which SciPy's reader may crash; return the bytes left of `most`."""
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(f"{order}II", data, at)
        small = kind >> 16
        kind, size, start = (kind & 0xFFFF, small, at + 4) if small else (kind, size, at + 8)
        at = at + 8 if small else start + (size if kind == _COMPRESSED else -(-size // 8) * 8)
        content = data[start : start + size]
        if len(content) < size or depth > _DEEPEST or small > 4:
            raise ValueError("sizes do not fit")
        if kind == _COMPRESSED:
            unpacker = zlib.decompressobj()
            content = unpacker.decompress(content, most)
            most -= len(content)
            if not unpacker.eof:
                raise ValueError("too large, or cut off")
        if kind in (_COMPRESSED, _ARRAY):
            most = _check_elements(content, order, most, depth + 1)
        elif kind not in _PLAIN and (kind, size) != (0, 0):
            raise ValueError("no known type")
    return most


def columns_of_arrays(
    source: Source, values: Mapping[str, Any], named: str
) -> tuple[list[str], list[NDArray], float | None, str | None]:
    """Return names and columns of variables or of the `named` one, their sample time and unit, if stated.

    Fields of structs have their own names.

    Raises:
        DataError: `data-unreadable`; for an object that only MATLAB reads, with the lines that convert it.
    """
    if named and named not in values:
        raise source.unreadable("has no such variable", f"it holds {', '.join(values)}")
    arrays, owners, left_out = dict[str, NDArray](), dict[str, str](), list[str]()
    step, unit = None, None
    fields = {owner: [*_flat(owner, value)] for owner, value in values.items() if named in ("", owner)}
    signals = {o: [n for n, x in own if x.size > 1 and n.lower() not in _TIMES] for o, own in fields.items()}
    counts = Counter(name for names in signals.values() for name in names)
    for owner, own in fields.items():
        for field, array in own:
            # Simulink logs each signal as a struct, and their fields have the same names.
            name = owner if counts[field] > 1 and signals[owner] == [field] else field
            if array.size == 1 and name.lower() in _TIME_UNITS:
                unit = str(array.item())
            elif array.size == 1 and name.lower() in _SAMPLE_TIMES:
                step = float(array.item()) if array.dtype.kind in "fiu" else np.nan
                if not 0.0 < step < np.inf:
                    what = f"states the sample time {array.item()}"
                    raise source.unreadable(what, "make it a positive number")
            elif not (array.dtype.kind in "fiubmM" and array.ndim in (1, 2) and array.size > 1):
                left_out.append(f"{name}: {'text' if array.dtype.kind in 'SU' else array.dtype}")
            elif name not in arrays:
                arrays[name], owners[name] = array if array.ndim == 2 else array[:, None], owner
            elif not np.array_equal(arrays[name].ravel(), array.ravel()):
                what = f"holds {owners[name]} and {owner}, each with a {name} of its own"
                file = source.path.name.partition("#")[0]
                whole = [f"'{file}#{one}'" for one, names in signals.items() if len(names) > 1]
                hint = f"name one: {' or '.join(whole)}" if whole else "log all signals at the same times"
                raise source.unreadable(what, hint)
    if not arrays:
        held = f" ({', '.join(left_out[:5])})" if left_out else ""
        raise source.unreadable(f"holds no arrays of numbers{held}", _MATLAB)
    rows = {name: array.T if array.shape[0] == 1 else array for name, array in arrays.items()}
    if len({*map(len, rows.values())}) > 1:
        shapes = ", ".join(f"{name} {' x '.join(map(str, one.shape))}" for name, one in rows.items())
        more = "keep the signals of one experiment in a file, all of one length, a sample in each row"
        raise source.unreadable(f"holds arrays of different lengths ({shapes})", more)
    names = [
        name if one.shape[1] == 1 else f"{name}{i + 1}"
        for name, one in rows.items()
        for i in range(one.shape[1])
    ]
    return names, [column for one in rows.values() for column in one.T], step, unit


def _flat(name: str, value: Any) -> Iterator[tuple[str, NDArray]]:
    """Yield the arrays in a value by name; a struct gives the arrays of its fields by their names."""
    if isinstance(value, Mapping):
        for own, inner in value.items():
            if np.size(inner):
                yield from _flat(_IDDATA.get(str(own), str(own)), inner)
        return
    array = np.array(value, dtype=object) if isinstance(value, list) else np.asarray(value)
    yield name, array.real if array.dtype.kind == "c" and not np.any(array.imag) else array
