"""Filters whose coefficients differ from run to run, on signals that stream through in blocks.

One pass over time serves all runs, each row being contiguous. Everything starts from rest, so that filters
commute exactly.
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.plant.filtering import filtered

# With fewer runs than this, a call of lfilter a run is faster than a loop over time.
FEW = 24


class Stream:
    """Named signals, of which the present block (`rows`, runs) and the last `history` rows are held.

    With fewer than `FEW` runs there must be a single block.
    """

    def __init__(self, rows: int, history: int, runs: int) -> None:
        self.length = 0
        self._rows, self._history, self._runs = rows, history, runs
        self._held: dict[str, Array] = {}
        self._lines: dict[str, list[Array]] = {}
        self._product = np.empty((rows, runs))
        self._taps: dict[str, list[Array]] = {}

    def advance(self, length: int) -> None:
        """Begin the next block, of `length` rows; only the last one may be shorter than `rows`."""
        for held in self._held.values():
            held[: self._history] = held[self._rows :]
        self.length = length

    def now(self, name: str) -> Array:
        """Return the present block of a signal."""
        return self.delayed(name, 0)

    def delayed(self, name: str, lag: int) -> Array:
        """Return x(t - lag) over the present block."""
        first = self._history - lag
        return self._signal(name)[first : first + self.length]

    def enter(self, name: str, block: Array) -> None:
        """Return the present block of a signal from outside."""
        self.now(name)[:] = block

    def multiply(self, name: str, source: str, coefficients: Array) -> None:
        """name = sum_i coefficients[:, i] source(t - i), `coefficients` (runs, m + 1)."""
        out, product = self.now(name), self._product[: self.length]
        taps = self._columns(f"{name} {source}", coefficients)
        np.multiply(taps[0], self.now(source), out)
        for lag, tap in enumerate(taps[1:], 1):
            np.multiply(tap, self.delayed(source, lag), product)
            np.add(out, product, out)

    def divide(self, name: str, source: str, monic: Array) -> None:
        """name = source / D for monic polynomials D (runs, m + 1)."""
        out = self.now(name)
        out[:] = self.now(source)
        if monic.shape[1] == 1:
            return
        if self._runs < FEW:
            for run in range(self._runs):
                out[:, run] = filtered([1.0], monic[run], out[:, run])
            return
        taps = self._columns(f"{name} {source}", monic)[1:]
        if name not in self._lines:
            self._lines[name] = list(self._held[name])
        lines = self._lines[name]
        product = self._product[0]
        for t in range(self._history, self._history + self.length):
            row = lines[t]
            for lag, tap in enumerate(taps, 1):
                np.multiply(tap, lines[t - lag], product)
                np.subtract(row, product, row)

    def _signal(self, name: str) -> Array:
        if name not in self._held:
            self._held[name] = np.zeros((self._history + self._rows, self._runs))
        return self._held[name]

    def _columns(self, key: str, coefficients: Array) -> list[Array]:
        if key not in self._taps:
            self._taps[key] = list(np.ascontiguousarray(coefficients.T))
        return self._taps[key]
