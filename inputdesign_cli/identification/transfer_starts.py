"""Where to begin a search for a transfer matrix in s: estimates that need no start themselves.

Output by output, derivatives of inputs and output are had through a state-variable filter
1 / (s + cutoff)^m, and a model with one denominator for the whole row follows by least squares
([young-jakeman-1980]; [garnier-wang-2008], Chapter 1). Entries of the orders asked for are then fitted to its
frequency response by the iteration of [sanathanan-koerner-1963].
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import polynomial as ascending

from inputdesign_cli.identification.transfer_record import TransferRecord
from inputdesign_cli.plant import ContinuousModel
from inputdesign_cli.plant.held import HeldEntry
from inputdesign_cli.plant.polynomial import Array, ComplexArray

_CUTOFFS = 5
_HIGHEST_ORDER = 8
_ITERATIONS = 8
_MOST_FREQUENCIES = 1000

Place = tuple[int, int]


def starting_points(record: TransferRecord) -> Array:
    """(points, k): one for each cutoff and order of the rows, between the record's length and its step."""
    step = record.intersample.sample_time
    lines = slice(1, None, -(-record.samples // (2 * _MOST_FREQUENCIES)))
    w = np.asarray(2.0 * np.pi / step * np.fft.rfftfreq(record.samples), dtype=float)[lines]
    spectra = np.abs(np.fft.rfft(record.u, axis=0))[lines]
    summing = (False,) if record.structure.common or record.structure.inputs == 1 else (False, True)
    points = []
    for cutoff in np.geomspace(8.0 * np.pi / (record.samples * step), 0.5 * np.pi / step, _CUTOFFS):
        for summed in summing:
            responses: dict[Place, ComplexArray] = {}
            for output in sorted({i for i, _ in record.structure.active}):
                responses |= _row(record, output, float(cutoff), w, summed=summed)
            points.append(_reduced(record, responses, w, spectra))
    return np.array(points)


def _row(
    record: TransferRecord, output: int, cutoff: float, w: Array, *, summed: bool
) -> dict[Place, ComplexArray]:
    """The responses at `w` of the entries of a row, by least squares behind a state-variable filter.

    The order of their denominator is the largest of the entries', or the sum of all.
    """
    model = record.structure
    places = [place for place in model.active if place[0] == output]
    orders = [model.denominator[i][j].size - 1 for i, j in places]
    m = min(sum(orders), _HIGHEST_ORDER) if summed else max(orders)
    biproper = m == 0 or any(model.numerator[i][j].size > n for (i, j), n in zip(places, orders, strict=True))
    chain = HeldEntry.of(np.ones(1), _power(cutoff, m), record.intersample.sample_time)
    # s is in units of the cutoff from here on.
    monic = _power(1.0, m)

    def derivatives(signal: Array, *, hold: bool, highest: bool) -> Array:
        low = record.intersample.states(chain, signal, hold=hold)[:, :m]
        return np.column_stack([low, signal - low @ monic[:-1]]) if highest else low

    y = derivatives(record.y[:, output], hold=False, highest=True)
    parts = [derivatives(record.u[:, j], hold=record.intersample.hold, highest=biproper) for _, j in places]
    matrix = np.column_stack([-y[:, :m], *parts])
    solution = _regression(matrix, y[:, m])
    s = 1j * w / cutoff
    below = ascending.polyval(s, np.append(solution[:m], 1.0))
    tops = np.split(solution[m:], len(places))
    return {
        place: np.asarray(ascending.polyval(s, top) / below) for place, top in zip(places, tops, strict=True)
    }


def _reduced(record: TransferRecord, responses: dict[Place, ComplexArray], w: Array, spectra: Array) -> Array:
    """theta of the structure's own orders, fitted to the responses where the inputs (n, r) have power."""
    theta = np.zeros(record.size)
    active = record.structure.active
    for places in [active] if record.structure.common else [(place,) for place in active]:
        _fit_group(record.structure, theta, places, responses, w, spectra)
    return record.stabilised(theta)


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
        if set(parameter.places) <= set(places)
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
