"""The designed or given spectrum as result entry, table and curves, and where its power pays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.outcome import Spectrum
from inputdesign_cli.outcome.curves import OptimalityCurves, SpectrumCurves
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.spectrum import Basis, TabulatedSpectrum, best_directions, matrices

_POINTS = 800
# Logarithmic axes start where the band does, or three decades below its end if it starts at zero.
_DECADES = 1e-3
_ZERO = 1e-5
_PRICED = 1e-12
_SUPPORT = 1e-3
_ROUNDING = 1e-9


def axis(lo: float, hi: float, extra: Array) -> Array:
    """Return frequencies that look smooth on a logarithmic axis, with the `extra` ones among them."""
    start = lo if lo > _ZERO * hi else _DECADES * hi
    inside = extra[(extra >= start) & (extra <= hi)]
    smooth = [np.geomspace(start, hi, _POINTS), np.linspace(start, hi, _POINTS // 2)]
    w = _apart(np.concatenate([*smooth, inside]), _ROUNDING, 0.0)
    w[-1] = hi
    return w


def distinct(w: Array, highest: float) -> Array:
    """Return one frequency for each cluster within 0.3 %: the exchange visits an optimum repeatedly.

    Below a millionth of the `highest` of the band, the first stands for all.
    """
    return _apart(w, 3e-3, 1e-6 * highest)


def _apart(w: Array, relative: float, absolute: float) -> Array:
    """Return the frequencies in order, each some distance from the one before."""
    ordered = np.sort(w)
    return ordered[np.diff(ordered, prepend=-np.inf) > np.maximum(relative * ordered, absolute)]


def hermitian_columns(values: NDArray, symbol: str) -> dict[str, Array]:
    """Return columns phi_11, phi_12_re, phi_12_im, phi_22, .. of values (n, r, r); phi of one input."""
    if values.shape[1] == 1:
        return {symbol: values[:, 0, 0].real}
    columns = {}
    for i in range(values.shape[1]):
        columns[f"{symbol}_{i + 1}{i + 1}"] = values[:, i, i].real
        for j in range(i + 1, values.shape[2]):
            columns[f"{symbol}_{i + 1}{j + 1}_re"] = values[:, i, j].real
            columns[f"{symbol}_{i + 1}{j + 1}_im"] = values[:, i, j].imag
    return columns


def spectrum_curves(
    units: Units,
    basis: Basis | TabulatedSpectrum,
    x: Array,
    band: tuple[float, float],
    *,
    white: float | None = None,
) -> tuple[Table, SpectrumCurves]:
    """Return spectrum.csv and its plot: a density over the band, or sinusoids with their powers."""
    if basis.has_density:
        w = np.unique(np.concatenate([[band[0]], axis(*band, basis.knots)]))
        symbol, values = "phi", matrices(basis.density(x, w)).astype(complex)
    else:
        w, values = basis.lines(x)
        symbol = "power"
    frequency = w / units.frequency
    table = Table({units.frequency_header: frequency, **hermitian_columns(values, symbol)})
    curves = SpectrumCurves(
        frequency,
        values,
        white=white,
        lines=not basis.has_density,
        symbol=units.excitation,
        band=(band[0] / units.frequency, band[1] / units.frequency),
    )
    return table, curves


def with_periodogram(
    units: Units, table: Table, curves: SpectrumCurves, samples: Array
) -> tuple[Table, SpectrumCurves]:
    """Return the density with the smoothed periodogram of the record (n, r) over it; lines are unchanged."""
    if curves.lines:
        return table, curves
    shown, columns = [], {}
    for a, column in enumerate(samples.T):
        periodogram = np.abs(np.fft.rfft(column)) ** 2 / column.size
        reach = int(column.size**0.4 / 4)
        window = np.ones(2 * reach + 1) / (2 * reach + 1)
        smooth = np.convolve(np.pad(periodogram, reach, mode="reflect"), window, mode="valid")
        w = 2 * np.pi * np.arange(periodogram.size) / column.size / units.sample_time
        # Per rad/sample in discrete time, per rad per time unit in continuous time, as the design.
        density = smooth * (1.0 if units.sampled else units.sample_time)
        shown.append(np.interp(curves.frequency, w, density))
        columns[f"phi_record{f'_{a + 1}{a + 1}' if units.inputs > 1 else ''}"] = shown[-1]
    return Table({**table.columns, **columns}), replace(curves, record=np.stack(shown, axis=1))


def optimality_curves(units: Units, design: Design) -> tuple[Table, OptimalityCurves] | None:
    """Return optimality.csv and its plot, the worth of the best direction over its price, or None.

    By the bound over every spectrum it is at most one everywhere, and one where power pays. So it is by the
    bound over all records, whose price grows where signals within the amplitude have no such autocovariances.
    """
    anything = design.any_spectrum
    if anything is None:
        return None
    price, value = anything.certificate.price, anything.certificate.value
    if price is None or value is None:
        return None
    lines, powers = anything.basis.lines(anything.x)
    # By what is paid, not by power: power is almost free near DC in a loop with integral action.
    paid = np.einsum("nab,nba->n", matrices(price.density(lines)), powers).real
    support = lines[paid > _SUPPORT * paid.sum()]
    w = axis(*design.problem.experiment.band, support)
    costs = price.density(w)
    size = np.einsum("naa->n", matrices(costs)).real
    seen = size > _PRICED * size.max()
    ratio, _ = best_directions(costs[seen], value.density(w)[seen])
    marks = distinct(np.maximum(support, w[0]), w[-1])
    frequency = w[seen] / units.frequency
    columns, within = {units.frequency_header: frequency, "ratio": ratio}, None
    if design.any_record is not None:
        known = design.any_record.result.certificate
        if known.price is not None and known.value is not None:
            within, _ = best_directions(known.price.density(w[seen]), known.value.density(w[seen]))
            columns["ratio_records"] = within
    return Table(columns), OptimalityCurves(frequency, ratio, marks / units.frequency, within)


def described_spectrum(units: Units, basis: Basis, x: Array) -> Spectrum:
    """Return the entry of the outcome for a designed spectrum."""
    details = dict(basis.described(x, units.frequency))
    return Spectrum(str(details.pop("type")), details)
