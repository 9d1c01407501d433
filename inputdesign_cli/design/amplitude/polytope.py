"""The autocovariances that signals within an amplitude can have: a polytope, known by its best cycles."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.amplitude.windows import Windows, weighted

_MOST, _CLOSE = 400, 1e-5
_BOX = 1e3


@dataclass(frozen=True)
class Face:
    """A form (m, r, r) that no signal within the amplitude takes beyond one, and what some lags have of it."""

    form: Array
    share: float


@dataclass
class LagPolytope:
    """The convex hull of the lags of all cycles of windows, and of zero."""

    windows: Windows
    cycles: list[Array] = field(default_factory=list)
    _columns: list[Array] = field(default_factory=list)
    _values: Array | None = None

    def __post_init__(self) -> None:
        n = 60
        rng = np.random.default_rng(0)
        L = self.windows.letters
        for c in [np.ones((1, 1)), np.array([[1.0], [-1.0]])] if L.shape[1] == 1 else []:
            self._add(c * L.max())
        for letter in L:
            self._add(letter[None])
        for _ in range(n):
            self._add(L[rng.integers(len(L), size=2 * self.windows.length)])

    def _add(self, cycle: Array) -> None:
        self.cycles.append(cycle)
        self._columns.append(self.windows.lags(cycle).ravel())

    def gauge(self, lags: Array) -> tuple[float, Face]:
        """Return the least factor of the polytope that contains lags (m, r, r), and a face that shows it."""
        c = lags.ravel()
        scale = float(np.abs(self._columns[0]).max())
        r = self.windows.letters.shape[1]
        lower = np.full(c.size, -_BOX)
        for i in range(r):
            lower[i * r + i] = 0.0
        two = np.full((self.windows.length, r, r), 2.0)
        two[0] = 1.0
        w = two.ravel()
        best = None
        for _ in range(_MOST):
            A = np.array(self._columns) * w / scale
            found = scipy.optimize.linprog(
                -c * w / scale, A_ub=A, b_ub=np.ones(len(A)), bounds=np.column_stack([lower, np.full(c.size, _BOX)])
            )
            q = found.x.reshape(lags.shape) / scale
            h, cycle, self._values = self.windows.largest_mean(q, self._values, 1.0 + 1e-3)
            if best is None or -found.fun / h > best.share:
                best = Face(q / h, -found.fun / h)
            if h <= 1.0 + _CLOSE:
                break
            before = len(self._columns)
            self._add(cycle)
            if np.abs(np.array(self._columns[:before]) - self._columns[-1]).max(axis=1).min() < 1e-12:
                break
        return -found.fun, best


def form_density(form: Array, w: Array) -> Array:
    """Return the density (n, r, r) whose mean over a spectrum is the form (m, r, r) of its lags."""
    turns = np.exp(-1j * np.multiply.outer(w, np.arange(len(form))))
    half = np.tensordot(turns[:, 1:], form[1:], axes=1)
    density = form[0] + half + half.conj().swapaxes(1, 2)
    return density.real if form.shape[1] == 1 else density
