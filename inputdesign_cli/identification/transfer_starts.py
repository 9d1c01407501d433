"""Where to begin a search for a transfer matrix in s: estimates that need no start themselves.

Derivatives of inputs and outputs are had through a state-variable filter 1 / (s + cutoff)^m, and a model with
one denominator for the whole row of an output follows by least squares ([young-jakeman-1980];
[garnier-wang-2008], Chapter 1). Entries of lower order have its slowest poles.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial import polynomial as ascending

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.records import shifted
from inputdesign_cli.plant import ContinuousModel, Intersample
from inputdesign_cli.plant.held import HeldEntry, integrators, polynomial_roots
from inputdesign_cli.plant.model import DELAY

_CUTOFFS = 5
# Dead times are tried sample by sample up to _FINE samples, then in steps that grow by _GROWTH.
_FINE, _GROWTH = 20, 1.2
_SWEEPS, _MINIMA = 2, 6

Place = tuple[int, int]


def starting_points(
    model: ContinuousModel, between: Intersample, held: Mapping[Place, float], u: Array, y: Array
) -> Array:
    """Return dead times and denominators (points, k), numerators zero, for each cutoff, from one record.

    Cutoffs lie between the record's length and its step. Dead times are searched on a grid, one after the
    other, by the residuals of the regression of the row. A single one also takes its next best minima.

    Args:
        model: gives the structure.
        held: known dead times of entries.
        u, y: (N, r), (N, p).
    """
    samples, step, points = len(y), between.sample_time, []
    for cutoff in np.geomspace(8.0 * np.pi / (samples * step), 0.5 * np.pi / step, _CUTOFFS):
        behind = _Filtered(model, between, u, y, float(cutoff))
        for delays in _delays(model, behind, held, _grid(samples) * step):
            theta = np.zeros(len(model.parameters))
            for index, parameter in enumerate(model.parameters):
                i, j = parameter.places[0]
                if parameter.letter == DELAY:
                    theta[index] = delays[i, j]
                elif parameter.letter == "a":
                    theta[index] = behind.denominator(i, j, delays)[parameter.power]
            points.append(theta)
    return np.array(points)


def _delays(
    model: ContinuousModel, filtered: _Filtered, held: Mapping[Place, float], grid: Array
) -> list[dict[Place, float]]:
    """Return dead times of all entries: the best on the grid, and for a single one its next best minima."""
    best = {place: held.get(place, model.dead_time(*place)) for place in model.active}
    groups = [
        p.places for p in model.parameters if p.letter == DELAY and not any(x in held for x in p.places)
    ]
    if not groups:
        return [best]
    ranked, alone = grid, len(groups) == 1
    for _ in range(1 if alone else _SWEEPS):
        for places in groups:
            outputs = {i for i, _ in places}
            tried = [best | dict.fromkeys(places, float(delay)) for delay in grid]
            left = np.array([sum(filtered.regression(i, delays)[1] for i in outputs) for delays in tried])
            padded = np.concatenate([[np.inf], left, [np.inf]])
            minima = np.flatnonzero((left <= padded[:-2]) & (left <= padded[2:]))
            ranked = grid[minima[np.argsort(left[minima])]]
            best |= dict.fromkeys(places, float(ranked[0]))
    beside = ranked[1:_MINIMA].tolist() if alone else []
    return [best, *(best | dict.fromkeys(groups[0], delay) for delay in beside)]


def _grid(samples: int) -> Array:
    """Return dead times in samples: one by one, then ever longer ones, up to a third of the record."""
    longest = max(samples // 3, 1)
    fine = np.arange(min(_FINE, longest))
    steps = 1 + int(np.log(max(longest / _FINE, 1.0)) / np.log(_GROWTH))
    far = np.rint(np.geomspace(_FINE, longest, steps)) if longest > _FINE else np.zeros(0)
    return np.concatenate([fine, far])


@dataclass
class _Filtered:
    """Derivatives of the signals of a record behind one state-variable filter, in units of its cutoff."""

    model: ContinuousModel
    between: Intersample
    u: Array
    y: Array
    cutoff: float
    _columns: dict[tuple[int, int, float], Array] = field(default_factory=dict)

    def denominator(self, output: int, input: int, delays: Mapping[Place, float]) -> Array:
        """Return the denominator of an entry, ascending in s: of the slowest poles that do not integrate."""
        own = self.model.denominator[output][input]
        zeros = integrators(own)
        below = np.append(self.regression(output, delays)[0], 1.0)
        poles = self.cutoff * np.array(sorted(polynomial_roots(below), key=abs))
        found = np.atleast_1d(np.poly(poles[zeros : own.size - 1])).real[::-1]
        return np.concatenate([np.zeros(zeros), found])

    def regression(self, output: int, delays: Mapping[Place, float]) -> tuple[Array, float]:
        """Return the denominator of a row, and the unexplained share of the power of its highest derivative.

        This derivative of the output is regressed on lower ones and on derivatives of the inputs.
        """
        places = [place for place in self.model.active if place[0] == output]
        m = max(self.model.denominator[i][j].size - 1 for i, j in places)
        y = self._derivatives(-1 - output, m, 0.0, hold=False)
        hold, above = self.between.hold, [self.model.numerator[i][j].size for i, j in places]
        parts = [
            self._derivatives(j, m, delays[i, j], hold=hold)[:, :most]
            for (i, j), most in zip(places, above, strict=True)
        ]
        matrix, target = np.column_stack([-y[:, :m], *parts]), y[:, m]
        scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        solution = np.linalg.lstsq(matrix / scale, target, rcond=1e-10)[0] / scale
        left = float(np.sum((target - matrix @ solution) ** 2))
        return solution[:m], left / max(float(np.sum(target**2)), 1e-300)

    def _derivatives(self, signal: int, m: int, delay: float, *, hold: bool) -> Array:
        """Return derivatives (N, m + 1) of input j >= 0 or output -1 - j, filtered by 1 / (s + 1)^m."""
        key = (signal, m, delay)
        if key not in self._columns:
            step = self.between.sample_time
            x = self.u[:, signal] if signal >= 0 else self.y[:, -1 - signal]
            chain = HeldEntry.of(np.ones(1), _power(self.cutoff, m), step, delay or None)
            low = self.between.responses(chain, x, hold=hold)[:, :m]
            late = shifted(x, int(np.rint(delay / step)), (x.size,))
            self._columns[key] = np.column_stack([low, late - low @ _power(1.0, m)[:-1]])
        return self._columns[key]


def _power(cutoff: float, order: int) -> Array:
    """Return the coefficients of (s + cutoff)^order, ascending."""
    return np.asarray(ascending.polypow([cutoff, 1.0], order), dtype=float)
