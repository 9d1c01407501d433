"""Small logs of a time, an input and an output, as every kind of file holds them."""

import numpy as np
import scipy.io
import scipy.signal

TIME, U, Y = np.arange(4.0), np.array([1.5, -2.0, 3.25, 0.0]), np.array([10.0, 11.5, 12.0, 13.75])
ROWS = list(zip(TIME, U, Y, strict=True))


def table(mark, *, header="time,u,y", comma=False):
    """The rows as text, separated by a mark."""

    def cell(x):
        return f"{x:g}".replace(".", ",") if comma else f"{x:g}"

    head = [mark.join(header.split(","))] if header else []
    return "\n".join([*head, *(mark.join(map(cell, row)) for row in ROWS)]) + "\n"


def iddata():
    """The fields of a saved iddata object."""
    return {"InputData": U[:, None], "OutputData": Y[:, None], "Ts": 0.5, "InputName": "valve"}


def save(path, **arrays):
    """Arrays by name as .npz or .mat, by what the path ends on."""
    if path.suffix == ".npz":
        np.savez(path, **arrays)
    else:
        scipy.io.savemat(path, arrays)


def lag_log(path, *, samples=300, seed=0, noise=0.2, gain=1.0, head="time_min,input,output"):
    """A log: u about 40, held for five samples, and y about 20, a lag of first order, three samples late."""
    rng = np.random.default_rng(seed)
    u = 40.0 + np.repeat(rng.choice([-1.0, 1.0], samples // 5 + 1), 5)[:samples]
    x = scipy.signal.lfilter([0, 0, 0, 0.2], [1, -0.8], u - 40.0)
    y = 20.0 + gain * x + noise * rng.standard_normal(samples)
    rows = np.column_stack([0.5 * np.arange(samples), u, y])
    path.write_text(f"{head}\n" + "\n".join(",".join(f"{x:.8g}" for x in row) for row in rows) + "\n")
    return path
