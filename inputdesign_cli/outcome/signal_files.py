"""A signal as files for other programs and for hardware: .mat, .npz, a C header."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping

import numpy as np

from inputdesign_cli.outcome.results import Array

_A_LINE = 4


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
        "#pragma once",  # two of them in one file clash by their names, and none is left out silently
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
"""By the ending of the file."""
