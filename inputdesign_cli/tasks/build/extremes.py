"""Values of signals that arithmetic cannot bear: too large or small to be squared, or beside each other."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files import Sheet

# Squares of signals are powers, and a spec has none beyond the square of this, or below that of its inverse.
_EXTREME = 1e18
# A value so many times farther off than any other leaves nothing of them but rounding, when squared.
_ABSURD = 1e10
# More values than this share are no outliers, but the other level of the signal.
OFTEN = 0.05


def check_range(sheet: Sheet, name: str, x: Array) -> None:
    """Squares of a signal x (n,), some of it there, stay within double precision, beside each other too.

    Raises:
        DataError: `beyond-precision`.
    """
    row, lost = int(np.nanargmax(np.abs(x))), absurd(x)
    size = abs(float(x[row]))
    if lost is not None:
        message = f"beside {x[lost]:.6g} in column {name} all other values are lost in rounding"
        faulty = f"if it is a fault of measurement, --without {sheet.lines[lost]} leaves its row out"
        hint = "write the value that was meant" if sheet.key else faulty
        raise DataError(sheet.error("beyond-precision", message, hint, lost))
    if size and not 1.0 / _EXTREME < size < _EXTREME:
        message = (
            f"the column {name} has values up to {size:.3g}: their squares are beyond {_EXTREME**2:.0e} or "
            f"below {_EXTREME**-2:.0e}"
        )
        hint = "write the signals in a unit in which they are of the order of one"
        raise DataError(sheet.error("beyond-precision", message, hint, row))


def spread_of(x: Array) -> float:
    """A standard deviation of x (n,) that a few values do not move."""
    spread = 1.4826 * float(np.median(np.abs(x - np.median(x))))
    low, high = np.quantile(x, [0.5 * OFTEN, 1.0 - 0.5 * OFTEN])
    # Two levels have no spread about the more frequent one.
    return max(spread, float(high - low) / 4.0)


def absurd(x: Array) -> int | None:
    """The first of values of a signal x (n,), NaN where missing, beside which all others are rounding."""
    there = np.flatnonzero(~np.isnan(x))
    scaled = x[there] / max(float(np.abs(x[there]).max()), np.finfo(float).tiny)
    middle = float(np.median(scaled))
    off = np.abs(scaled - middle)
    sizes = np.sort(off[off > 0.0])
    jumps = np.flatnonzero(sizes[1:] > _ABSURD * sizes[:-1])
    if not jumps.size:
        return None
    least = sizes[jumps[-1] + 1]
    far = there[off >= least]
    # Beside a level, or as often as the other level of a signal, it is no fault.
    if far.size > OFTEN * there.size or least <= _ABSURD * max(abs(middle), spread_of(scaled)):
        return None
    return int(far[0])
