"""MATLAB's files, read in a process of its own: on a damaged one SciPy's reader may end the process."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

BROKEN, NEWER, ABSENT, SEVERAL = "broken", "version 7.3", "absent", "several"
NOTHING, _TEXT = "nothing", "text"
# Of a sparse matrix so many entries, zeros included, are written out.
_MOST_DENSE = 10_000_000
_SPARSE = "a sparse matrix too large to be written out (in MATLAB: full(u) of the columns that are needed)"
# The fields of a saved iddata, and how its columns are called here.
_IDDATA = {"inputdata": "u", "outputdata": "y", "samplinginstants": "time"}
_COMMAND = f"from {__name__} import answer; answer()"


@dataclass(frozen=True)
class Arrays:
    """The arrays of numbers in a file; a `fault` where it cannot be read, `opaque` if MATLAB alone can.

    `left_out` says of the others, by name, what they hold; `texts` are those that are a single text. Of
    the fault `SEVERAL`, `held` are two variables and the name of a signal that each has; of `ABSENT` it is
    all variables, none of which was named.
    """

    arrays: Mapping[str, NDArray] = field(default_factory=dict)
    fault: str = ""
    opaque: bool = False
    left_out: Mapping[str, str] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    held: Sequence[str] = ()


def arrays_of(raw: bytes, named: str = "") -> Arrays:
    """What a .mat file holds, fields of structs by their own names.

    Args:
        named: the only variable to read; empty: all.
    """
    done = subprocess.run(
        [sys.executable, "-c", _COMMAND, named],
        input=raw,
        capture_output=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    if done.returncode != 0:
        return Arrays(fault=BROKEN)
    head, _, rest = done.stdout.partition(b"\n")
    told = json.loads(head)
    if told["fault"]:
        return Arrays(fault=told["fault"], held=told["held"])
    with np.load(io.BytesIO(rest), allow_pickle=False) as found:
        arrays = {name: found[f"arr_{i}"] for i, name in enumerate(told["names"])}
    return Arrays(arrays, opaque=told["opaque"], left_out=told["left_out"], texts=told["texts"])


def answer() -> None:
    """In that process: a file on standard input, its arrays on standard output."""
    found = _loaded(sys.stdin.buffer.read(), sys.argv[1])
    told = {
        "fault": found.fault,
        "opaque": found.opaque,
        "names": list(found.arrays),
        "left_out": dict(found.left_out),
        "texts": dict(found.texts),
        "held": list(found.held),
    }
    sys.stdout.buffer.write(json.dumps(told).encode() + b"\n")
    buffer = io.BytesIO()
    np.savez(buffer, *found.arrays.values())
    sys.stdout.buffer.write(buffer.getvalue())


def _loaded(raw: bytes, named: str) -> Arrays:
    import warnings

    import scipy.io

    warnings.simplefilter("ignore")
    try:
        found = scipy.io.loadmat(io.BytesIO(raw), simplify_cells=True)
    except NotImplementedError:
        return Arrays(fault=NEWER)
    except Exception:  # the reader raises whatever a broken file leads it to
        return Arrays(fault=BROKEN)
    values = {name: _plain(value) for name, value in found.items() if not name.startswith("__")}
    return replace(divided(values, named), opaque="__function_workspace__" in found)


def _plain(value: Any) -> Any:
    """A struct by the names of this house, where it is a saved iddata."""
    if not isinstance(value, Mapping):
        return value
    fields = {str(name).lower(): item for name, item in value.items()}
    if "outputdata" not in fields:
        return dict(value)
    return {_IDDATA.get(name, name): item for name, item in fields.items() if np.size(item)}


def divided(values: Mapping[str, Any], named: str = "") -> Arrays:
    """The arrays of numbers, or of times, with rows and columns at most; and what the others hold.

    Fields of structs have their own names. Where two hold different numbers under one name, that is a fault.

    Args:
        named: the only one of the values to take; empty: all.
    """
    if named and named not in values:
        return Arrays(fault=ABSENT, held=tuple(values))
    found = Arrays()
    owners: dict[str, str] = {}
    for name, value in values.items():
        if named not in ("", name):
            continue
        part = divided(value) if isinstance(value, Mapping) else _single(name, value)
        if part.fault:
            return part
        for own, array in part.arrays.items():
            if own in owners and not _same(found.arrays[own], array):
                return Arrays(fault=SEVERAL, held=(owners[own], name, own))
        owners |= dict.fromkeys(part.arrays, name)
        found = Arrays(
            {**found.arrays, **part.arrays},
            left_out={**found.left_out, **part.left_out},
            texts={**found.texts, **part.texts},
        )
    return found


def _same(a: NDArray, b: NDArray) -> bool:
    return a.dtype.kind == b.dtype.kind and np.array_equal(a, b, equal_nan=True)


def _single(name: str, value: Any) -> Arrays:
    """What one value is, or what the fields of a structured array are."""
    if hasattr(value, "toarray"):
        if value.shape[0] * value.shape[1] > _MOST_DENSE:
            return Arrays(left_out={name: _SPARSE})
        value = value.toarray()
    array = np.asarray(value) if not isinstance(value, list) else _of_cells(value)
    if array.dtype.names:
        return divided({f"{own}": array[own] for own in array.dtype.names})
    while array.ndim > 2 and array.shape[-1] == 1:
        array = array[..., 0]
    if array.dtype.kind == "c" and not np.any(array.imag):
        array = array.real
    wrong = _wrong(array)
    if not wrong:
        return Arrays({name: array})
    texts = {name: str(array.item())} if wrong == _TEXT and array.size == 1 else {}
    return Arrays(left_out={name: wrong}, texts=texts)


def _of_cells(value: list[Any]) -> NDArray:
    cells = np.empty(len(value), dtype=object)
    cells[:] = value
    return cells


def _wrong(array: NDArray) -> str:
    """What an array holds that is no column of numbers; nothing where it is one."""
    if array.size == 0:
        return NOTHING
    if array.dtype.kind == "c":
        return "complex numbers"
    if array.dtype.kind in "SU":
        return _TEXT
    if array.dtype.kind == "O":
        if any(isinstance(item, str) for item in array.ravel()):
            return _TEXT
        several = any(np.size(item) > 1 for item in array.ravel())
        return "cells, as those of several experiments (in MATLAB: getexp(data, 1))" if several else "objects"
    if array.dtype.kind not in "fiubmM":
        return f"numbers of the kind {array.dtype}"
    return f"an array of {array.ndim} dimensions" if array.ndim > 2 else ""
