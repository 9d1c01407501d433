"""Tables and curves of a spectrum, and of an information matrix over frequency and of parameters.

bound.csv has r_u against r_adm, entry by entry. nyquist.csv has the loop of one input and one output.
spectrum.csv has the density or the lines, optimality.csv where power pays.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome import curves as plots
from inputdesign_cli.outcome.curves import OptimalityCurves, SpectrumCurves
from inputdesign_cli.outcome.design import WHITE
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.spectrum import Basis, TabulatedSpectrum, best_directions, matrices

_GRID_POINTS = 400
_NEARLY = 0.5  # peaks of the ratio above this are points of the axis
_NOTHING, _ROUNDING = 1e-9, 1e-9
_PAIRS = 6

Pairs = Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Informed:
    """Evaluates errors over frequency by an information matrix M (k, k) in their coordinates.

    Unless r_adm is `stated`, the errors are r_u of the entries of G. Each binds at its `active` frequencies.
    M of the baseline `white`, of white excitation at `equal` cost or length, and of the `record` are for
    comparison. `of_several`: the design serves other plants, too, which the curves do not show.
    """

    units: Units
    errors: Sequence[OnModelError]
    information: Array
    stated: bool = True
    active: Sequence[Array] = ()
    white: Array | None = None
    equal: Array | None = None
    record: Array | None = None
    white_labels: tuple[str, str] = WHITE
    of_several: bool = False
    label: str = "design"

    def curves(
        self, experiment: Experiment, pairs: Pairs | None, *, flat: bool = True
    ) -> tuple[dict[str, Table], dict[str, plots.Curves]]:
        """Return the tables and figures of the bound, the loop and the parameters, as far as they exist."""
        tables, curves = dict[str, Table](), dict[str, plots.Curves]()
        with suppress(np.linalg.LinAlgError):  # a parameter that the design does not excite
            tables["bound"], curves["bound"] = self.bound()
            loop = self._nyquist()
            if loop is not None:
                tables["nyquist"], curves["nyquist"] = loop
        drawn = experiment_ellipses(experiment, self.information, self.white if flat else None, pairs)
        return tables, curves if drawn is None else curves | {"ellipses": drawn}

    def of_length(
        self, experiment: Experiment, pairs: Pairs | None, samples: int, *, flat: bool = True
    ) -> dict[str, plots.Curves]:
        """Return the curves of records of this many samples with the same spectrum."""
        white = experiment.of_length(self.white, samples) if flat and self.white is not None else None
        information = experiment.of_length(self.information, samples)
        longer = Informed(self.units, self.errors, information, self.stated, white=white)
        return longer.curves(experiment, pairs, flat=flat)[1]

    def bound(self) -> tuple[Table, plots.BoundCurves]:
        """Return r_u, r_adm and |G| of every entry (or of the norm of G) over the band of the requirement."""
        binding = self.active or [np.zeros(0)] * len(self.errors)
        near = [
            violation.frequency
            for error in (self.errors if self.stated else ())
            for violation in error.violations(self.information, above=_NEARLY)
        ]
        peaks = np.array([at for at in near if at is not None])
        # A coarser grid still shows the shape of resonances.
        grid = np.unique(np.concatenate([error.grid for error in self.errors]))
        shape = grid[:: max(len(grid) // _GRID_POINTS, 1)]
        w = axis(*self.errors[0].band, np.concatenate([*binding, peaks, shape]))
        frequency = w / self.units.frequency
        columns: dict[str, Array] = {self.units.frequency_header: frequency}
        others = {"r_u_white": self.white, "r_u_record": self.record, "r_u_equal": self.equal}
        compared = {"r_u": self.information, **{name: M for name, M in others.items() if M is not None}}
        panels = []
        for error, binds in zip(self.errors, binding, strict=True):
            bounds = dict(zip(compared, error.error_bounds(compared.values(), w), strict=True))
            suffix = "" if error.entry is None else self.units.suffix(*error.entry)
            listed = {"r_u": bounds.pop("r_u")}
            if self.stated:
                listed["r_adm"] = error.admissible.at(w)
            listed |= {"G_abs": error.nominal_size(w), **bounds}
            columns |= {f"{name}{suffix}": found for name, found in listed.items()}
            panels.append(
                plots.BoundPanel(
                    frequency=frequency,
                    active=distinct(np.maximum(binds, w[0]), w[-1]) / self.units.frequency,
                    label=self.label,
                    white_labels=self.white_labels,
                    entry=None if self.units.single else error.entry,
                    names=self.units.passage(error.entry),
                    r_u=listed["r_u"],
                    G_abs=listed["G_abs"],
                    r_adm=listed.get("r_adm"),
                    r_u_white=listed.get("r_u_white"),
                    r_u_record=listed.get("r_u_record"),
                    r_u_equal=listed.get("r_u_equal"),
                )
            )
        return Table(columns), plots.BoundCurves(tuple(panels), self.of_several)

    def _nyquist(self) -> tuple[Table, plots.NyquistCurves] | None:
        """Return the loop gain C G with discs of radius |C| r_u; None without a scalar loop.

        The loop is that whose sensitivity is bounded, else that of the experiment.
        """
        if not self.errors or not self.units.single:
            return None
        error, limiting = self.errors[0], self.active[0] if self.active else np.zeros(0)
        kept = error.admissible.kept
        loop = error.experiment.loop if kept is None else kept.loop
        if loop is None:
            return None
        limiting = distinct(limiting, error.band[1])
        w = axis(*error.band, np.concatenate([error.grid, limiting]))
        S, applied = (part[:, 0, 0] for part in loop.sensitivity(w))
        # With integral action S vanishes at frequency zero, where the loop gain is infinite.
        inside = np.abs(S) > _NOTHING
        w, S, applied = w[inside], S[inside], applied[inside]
        L, radius = 1.0 / S - 1.0, np.abs(applied / S) * error.error_bound(self.information, w)
        frequency = w / self.units.frequency
        columns = {self.units.frequency_header: frequency, "CG_re": L.real, "CG_im": L.imag, "radius": radius}
        circle = None
        if kept is not None:
            columns["distance_kept"] = np.abs(kept.weight.at(w))
            lowest, highest = columns["distance_kept"].min(), columns["distance_kept"].max()
            circle = float(lowest) if highest - lowest <= _ROUNDING * highest else None
        curves = plots.NyquistCurves(frequency, L, radius, circle, limiting / self.units.frequency)
        return Table(columns), curves


def equal_white(design: Design, samples: int, ratio: float) -> Array | None:
    """Return the information (k, k) of white noise at the design's cost or length; None if limits bind both.

    M less its part without excitation is proportional to both. The `ratio` is that of the costs.
    """
    problem, white = design.problem, design.white
    if problem.goal == "factor" or ratio <= 0.0:
        return None
    share = samples / white.s if problem.goal == "samples" else 1.0 / ratio
    known = problem.fixed_information[0]
    return np.asarray(known + share * (white.informations[0] - known))


def experiment_ellipses(
    experiment: Experiment, information: Array, white: Array | None, pairs: Pairs | None
) -> plots.EllipseCurves | None:
    """Return the `pairs`, or those most correlated of several channels; None if no variances are finite."""
    single = experiment.model.outputs == experiment.model.inputs == 1
    if experiment.size < 2 or (pairs is None and single):
        return None
    try:
        covariance = experiment.raw_covariance(information)
        flat = None if white is None else experiment.raw_covariance(white)
    except np.linalg.LinAlgError:  # a parameter that this excitation does not show
        return None
    names, theta = experiment.model.names, experiment.model.theta
    if pairs is None:
        scale = np.sqrt(np.diag(covariance))
        correlation = np.triu(np.abs(covariance / np.outer(scale, scale)), 1)
        order = np.argsort(-correlation, axis=None)[: min(_PAIRS, len(names) * (len(names) - 1) // 2)]
        index = [tuple(int(i) for i in np.unravel_index(at, correlation.shape)) for at in order]
    else:
        index = [(names.index(a), names.index(b)) for a, b in pairs]
    found = []
    for i, j in index:
        chosen = np.ix_([i, j], [i, j])
        white_too = None if flat is None else flat[chosen]
        found.append(plots.Ellipse((names[i], names[j]), theta[[i, j]], covariance[chosen], white_too))
    return plots.EllipseCurves(tuple(found))


_POINTS = 800
# Logarithmic axes start where the band does, or three decades below its end if it starts at zero.
_DECADES = 1e-3
_ZERO = 1e-5
_PRICED = 1e-12
_SUPPORT = 1e-3


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

    For the bound over every spectrum it is at most one, and one where power pays. The same holds for the
    bound over all records, whose price also counts autocovariances that no signal within the amplitude has.
    """
    anything = design.any_spectrum
    if anything is None:
        return None
    price, value = anything.certificate.price, anything.certificate.value
    if price is None or value is None:
        return None
    lines, powers = anything.basis.lines(anything.x)
    # Lines count by their cost, not their power, which is almost free near DC in a loop with integral action.
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
