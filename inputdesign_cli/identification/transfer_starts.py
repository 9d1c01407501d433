"""Where to begin a search for a transfer matrix in s: estimates that need no start themselves.

Output by output, derivatives of inputs and output are had through a state-variable filter
1 / (s + cutoff)^m, and a model with one denominator for the whole row follows by least squares
([young-jakeman-1980]; [garnier-wang-2008], Chapter 1). Entries of the orders asked for are then fitted to its
frequency response by the iteration of [sanathanan-koerner-1963].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial import polynomial as ascending

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.identification.records import shifted
from inputdesign_cli.plant import ContinuousModel, Intersample
from inputdesign_cli.plant.held import HeldEntry
from inputdesign_cli.plant.model import DELAY

_CUTOFFS = 5
_HIGHEST_ORDER = 8
_ITERATIONS = 8
_MOST_FREQUENCIES = 1000
# Dead times are tried sample by sample up to _FINE samples, then in steps that grow by _GROWTH.
_FINE, _GROWTH = 20, 1.2
_SWEEPS, _MINIMA = 2, 6

Place = tuple[int, int]


def starting_points(
    model: ContinuousModel, between: Intersample, held: Mapping[Place, float], u: Array, y: Array
) -> Array:
    """Return starting points (points, k) for each cutoff and order of the rows, from one record.

    Cutoffs lie between the record's length and its step. Dead times are searched on a grid, one after the
    other, by the residuals of the regression of the row. A single one also takes its next best minima.

    Args:
        model: gives the structure.
        held: known dead times of entries.
        u, y: (N, r), (N, p).
    """
    samples, step = len(y), between.sample_time
    lines = slice(1, None, -(-samples // (2 * _MOST_FREQUENCIES)))
    w = np.asarray(2.0 * np.pi / step * np.fft.rfftfreq(samples), dtype=float)[lines]
    spectra = np.abs(np.fft.rfft(u, axis=0))[lines]
    summing = (False,) if model.common or model.inputs == 1 else (False, True)
    points = []
    for cutoff in np.geomspace(8.0 * np.pi / (samples * step), 0.5 * np.pi / step, _CUTOFFS):
        for summed in summing:
            behind = _Filtered(model, between, u, y, float(cutoff), summed)
            for delays in _delays(model, behind, held, _grid(samples) * step):
                responses: dict[Place, ComplexArray] = {}
                for output in sorted({i for i, _ in model.active}):
                    responses |= behind.responses(output, delays, w)
                points.append(_reduced(model, responses, delays, w, spectra))
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
            left = np.array([sum(filtered.left(i, delays) for i in outputs) for delays in tried])
            padded = np.concatenate([[np.inf], left, [np.inf]])
            minima = np.flatnonzero((left <= padded[:-2]) & (left <= padded[2:]))
            ranked = grid[minima[np.argsort(left[minima])]]
            best |= dict.fromkeys(places, float(ranked[0]))
    beside = ranked[1:_MINIMA].tolist() if alone else []
    return [best, *(best | dict.fromkeys(groups[0], delay) for delay in beside)]


def _grid(samples: int) -> Array:
    """Dead times in samples, one by one, then ever longer ones, up to a third of the record."""
    longest = max(samples // 3, 1)
    fine = np.arange(min(_FINE, longest))
    steps = 1 + int(np.log(max(longest / _FINE, 1.0)) / np.log(_GROWTH))
    far = np.rint(np.geomspace(_FINE, longest, steps)) if longest > _FINE else np.zeros(0)
    return np.concatenate([fine, far])


@dataclass
class _Filtered:
    """Derivatives of the signals of a record behind one state-variable filter, in units of its cutoff.

    With `summed` the order of the denominator of a row is the sum of its entries' orders, otherwise the
    largest.
    """

    model: ContinuousModel
    between: Intersample
    u: Array
    y: Array
    cutoff: float
    summed: bool
    _columns: dict[tuple[int, int, float], Array] = field(default_factory=dict)

    def responses(self, output: int, delays: Mapping[Place, float], w: Array) -> dict[Place, ComplexArray]:
        """Return the responses at `w` of the entries of a row without their dead times, by least squares."""
        matrix, target = self._regression(output, delays)
        solution, m = _regression(matrix, target), self._order(output)
        s = 1j * w / self.cutoff
        below = ascending.polyval(s, np.append(solution[:m], 1.0))
        places = self._places(output)
        tops = np.split(solution[m:], len(places))
        return {
            place: np.asarray(ascending.polyval(s, top) / below)
            for place, top in zip(places, tops, strict=True)
        }

    def left(self, output: int, delays: Mapping[Place, float]) -> float:
        """Return the share of the power of the target that the regression leaves."""
        matrix, target = self._regression(output, delays)
        squared = float(np.sum((target - matrix @ _regression(matrix, target)) ** 2))
        return squared / max(float(np.sum(target**2)), 1e-300)

    def _places(self, output: int) -> list[Place]:
        return [place for place in self.model.active if place[0] == output]

    def _orders(self, output: int) -> list[int]:
        return [self.model.denominator[i][j].size - 1 for i, j in self._places(output)]

    def _order(self, output: int) -> int:
        orders = self._orders(output)
        return min(sum(orders), _HIGHEST_ORDER) if self.summed else max(orders)

    def _regression(self, output: int, delays: Mapping[Place, float]) -> tuple[Array, Array]:
        """Regressors and target: the highest derivative of the output on the others and on the inputs'."""
        model, m = self.model, self._order(output)
        places, orders = self._places(output), self._orders(output)
        biproper = m == 0 or any(
            model.numerator[i][j].size > n for (i, j), n in zip(places, orders, strict=True)
        )
        y = self._derivatives(-1 - output, m, 0.0, hold=False)
        parts = [self._derivatives(j, m, delays[i, j], hold=self.between.hold) for i, j in places]
        kept = slice(None) if biproper else slice(0, m)
        return np.column_stack([-y[:, :m], *(part[:, kept] for part in parts)]), y[:, m]

    def _derivatives(self, signal: int, m: int, delay: float, *, hold: bool) -> Array:
        """(N, m + 1): of order 0 to m, of an input j >= 0 or of output -1 - j, behind 1 / (s + 1)^m."""
        key = (signal, m, delay)
        if key not in self._columns:
            step = self.between.sample_time
            x = self.u[:, signal] if signal >= 0 else self.y[:, -1 - signal]
            chain = HeldEntry.of(np.ones(1), _power(self.cutoff, m), step, delay or None)
            low = self.between.responses(chain, x, hold=hold)[:, :m]
            late = shifted(x, int(np.rint(delay / step)), (x.size,))
            self._columns[key] = np.column_stack([low, late - low @ _power(1.0, m)[:-1]])
        return self._columns[key]


def _reduced(
    model: ContinuousModel,
    responses: dict[Place, ComplexArray],
    delays: Mapping[Place, float],
    w: Array,
    spectra: Array,
) -> Array:
    """theta of the structure's own orders, fitted to the responses where the inputs (n, r) have power."""
    theta = np.zeros(len(model.parameters))
    for index, parameter in enumerate(model.parameters):
        if parameter.letter == DELAY:
            theta[index] = delays[parameter.places[0]]
    for places in [model.active] if model.common else [(place,) for place in model.active]:
        _fit_group(model, theta, places, responses, w, spectra)
    return theta


def _fit_group(
    model: ContinuousModel,
    theta: Array,
    places: tuple[Place, ...],
    responses: dict[Place, ComplexArray],
    w: Array,
    spectra: Array,
) -> None:
    """The parameters of entries with one denominator a, by least squares of (a G - b) / a(previous)."""
    parameters = [
        (index, parameter)
        for index, parameter in enumerate(model.parameters)
        if set(parameter.places) <= set(places) and parameter.letter != DELAY
    ]
    inside = [index for index, _ in parameters]
    n = model.denominator[places[0][0]][places[0][1]].size - 1
    unit = float(np.exp(np.mean(np.log(w))))
    s = 1j * w / unit
    monic = np.append(np.zeros(n), 1.0)
    previous = np.ones(w.size, dtype=complex)
    for _ in range(_ITERATIONS):
        rows, targets = [], []
        for place in places:
            weight = spectra[:, place[1]] / previous
            columns = np.zeros((w.size, len(inside)), dtype=complex)
            for column, (_, parameter) in enumerate(parameters):
                if place in parameter.places:
                    factor = 1.0 if parameter.letter == "b" else -responses[place]
                    columns[:, column] = weight * factor * s**parameter.power
            rows.append(columns)
            targets.append(weight * responses[place] * s**n)
        matrix, target = np.concatenate(rows), np.concatenate(targets)
        solution = _regression(
            np.concatenate([matrix.real, matrix.imag]), np.concatenate([target.real, target.imag])
        )
        for value, (_, parameter) in zip(solution, parameters, strict=True):
            if parameter.letter == "a":
                monic[parameter.power] = value
        previous = ascending.polyval(s, monic)
    theta[inside] = solution * unit ** np.array([n - float(parameter.power) for _, parameter in parameters])


def _power(cutoff: float, order: int) -> Array:
    """(s + cutoff)^order, ascending."""
    return np.asarray(ascending.polypow([cutoff, 1.0], order), dtype=float)


def _regression(matrix: Array, target: Array) -> Array:
    """Least squares with columns of any units."""
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(matrix / scale, target, rcond=1e-10)[0] / scale)
