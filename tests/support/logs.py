"""Small logs of a time, an input and an output, as every kind of file holds them."""

import numpy as np
import scipy.io

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
