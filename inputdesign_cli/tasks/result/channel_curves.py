"""Tables and curves of designs with several channels or in continuous time, in the units of the spec."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import EntryOfPlant, NormError, Requirement
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import (
    BoundCurves,
    BoundPanel,
    MatrixSpectrumCurves,
    OptimalityCurves,
    SpectrumCurves,
    Table,
)
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.spectrum import PolynomialSpectrum
from inputdesign_cli.spectrum import (
    DirectedLines,
    FlatBasis,
    LinesBasis,
    MatrixFirBasis,
    PolynomialBasis,
    best_directions,
    matrices,
)
from inputdesign_cli.tasks.build.channels import excitation_band, excitation_symbol, frequency_unit
from inputdesign_cli.tasks.result.curves import distinct, frequency_header
from inputdesign_cli.tasks.result.periodogram import smoothed_periodogram, with_periodogram

_POINTS = 1000
_CARRIES = 1e-9
_SUPPORT = 1e-3


def hermitian_columns(values: NDArray, symbol: str) -> dict[str, Array]:
    """Columns phi_11, phi_12_re, phi_12_im, phi_22, .. of values (n, r, r); phi of values (n,)."""
    if values.ndim == 1:
        return {symbol: values}
    columns = {}
    for i in range(values.shape[1]):
        columns[f"{symbol}_{i + 1}{i + 1}"] = values[:, i, i].real
        for j in range(i + 1, values.shape[2]):
            columns[f"{symbol}_{i + 1}{j + 1}_re"] = values[:, i, j].real
            columns[f"{symbol}_{i + 1}{j + 1}_im"] = values[:, i, j].imag
    return columns


def density_curves(
    spec: Spec, basis: object, x: Array
) -> tuple[Table, SpectrumCurves | MatrixSpectrumCurves]:
    """spectrum.csv and its plot of a basis with a density: over the band of the excitation."""
    w, symbol = np.linspace(*excitation_band(spec), _POINTS), excitation_symbol(spec)
    phi = basis.density(x, w)  # type: ignore[attr-defined]
    frequency = w / frequency_unit(spec)
    table = Table({frequency_header(spec): frequency, **hermitian_columns(phi, "phi")})
    if phi.ndim == 1:
        inside = frequency > 0
        return table, SpectrumCurves(frequency[inside], density=phi[inside], symbol=symbol)
    return table, MatrixSpectrumCurves(frequency, phi, symbol=symbol)


def line_curves(
    spec: Spec, basis: LinesBasis | DirectedLines, x: Array
) -> tuple[Table, SpectrumCurves | MatrixSpectrumCurves]:
    """spectrum.csv and its plot of sinusoids: powers, or Hermitian power matrices, ascending in frequency."""
    powers: Any
    if isinstance(basis, LinesBasis):
        order = np.argsort(basis.frequencies)
        order = order[x[order] > _CARRIES * x.sum()]
        frequencies, powers = basis.frequencies[order], x[order]
    else:
        frequencies, powers = basis.lines(x)
    frequency, symbol = frequencies / frequency_unit(spec), excitation_symbol(spec)
    table = Table({frequency_header(spec): frequency, **hermitian_columns(powers, "power")})
    if powers.ndim == 1:
        return table, SpectrumCurves(frequency, line_frequency=frequency, line_power=powers, symbol=symbol)
    return table, MatrixSpectrumCurves(frequency, powers, lines=True, symbol=symbol)


def bound_curves_of(
    spec: Spec,
    requirements: Sequence[Requirement],
    information: Array,
    white: Array | None,
    *,
    label: str = "design",
    record: Array | None = None,
) -> tuple[Table, BoundCurves] | None:
    """bound.csv and its plot of those requirements that bound a model error; None when none does.

    `label` says what gave r_u, and `record` is the information of the record to be applied.
    """
    entries = [r for r in requirements if isinstance(r, EntryOfPlant)]
    if entries:
        return entry_bound_curves(spec, entries, information, white, label=label, record=record)
    for requirement in requirements:
        if isinstance(requirement, NormError):
            return _norm_bound_curves(spec, requirement, information, white, label, record)
    return None


def _norm_bound_curves(
    spec: Spec,
    requirement: NormError,
    information: Array,
    white: Array | None,
    label: str,
    record: Array | None,
) -> tuple[Table, BoundCurves]:
    w = _bound_axis([requirement], information)
    r_u, r_adm = requirement.error_bound(information, w), requirement.admissible.at(w)
    G = np.linalg.norm(requirement.experiment.model.plant_at(w), axis=(1, 2))
    columns = {frequency_header(spec): w / frequency_unit(spec), "r_u": r_u, "r_adm": r_adm, "G_abs": G}
    compared = None if white is None else requirement.error_bound(white, w)
    if compared is not None:
        columns["r_u_white"] = compared
    applied = None if record is None else requirement.error_bound(record, w)
    if applied is not None:
        columns["r_u_record"] = applied
    w = w / frequency_unit(spec)
    panel = BoundPanel(w, r_u, G, r_adm, compared, label=label, r_u_record=applied)
    return Table(columns), BoundCurves((panel,))


def _bound_axis(requirements: Sequence[EntryOfPlant | NormError], information: Array) -> Array:
    band = requirements[0].band
    lo = max(band[0], 1e-3 * band[1])
    peaks = [v.frequency for r in requirements for v in r.violations(information, above=0.5)]
    inside = np.array([w for w in peaks if w is not None and lo <= w <= band[1]])
    return np.unique(np.concatenate([np.geomspace(lo, band[1], 600), np.linspace(lo, band[1], 300), inside]))


def entry_bound_curves(
    spec: Spec,
    requirements: Sequence[EntryOfPlant],
    information: Array,
    white: Array | None,
    *,
    stated: bool = True,
    label: str = "design",
    record: Array | None = None,
) -> tuple[Table, BoundCurves]:
    """bound.csv and its plot: r_u, r_adm and |G| of every entry over the band of the requirement.

    Without r_adm where no requirement is `stated`, so that the entries' own bounds mean nothing. `record` is
    the information of the record to be applied.
    """
    w = _bound_axis(requirements, information)
    frequency = w / frequency_unit(spec)
    columns: dict[str, Array] = {frequency_header(spec): frequency}
    panels = []
    for requirement in requirements:
        i, j = requirement.output, requirement.input
        r_u = requirement.error_bound(information, w)
        r_adm = requirement.admissible.at(w) if stated else None
        G = np.abs(requirement.experiment.model.plant_at(w)[:, i, j])
        for name, values in (("r_u", r_u), ("r_adm", r_adm), ("G_abs", G)):
            if values is not None:
                columns[f"{name}_{i + 1}{j + 1}"] = values
        compared = None if white is None else requirement.error_bound(white, w)
        if compared is not None:
            columns[f"r_u_white_{i + 1}{j + 1}"] = compared
        applied = None if record is None else requirement.error_bound(record, w)
        if applied is not None:
            columns[f"r_u_record_{i + 1}{j + 1}"] = applied
        panels.append(
            BoundPanel(frequency, r_u, G, r_adm, compared, label=label, r_u_record=applied, entry=(i, j))
        )
    return Table(columns), BoundCurves(tuple(panels))


def channel_optimality_curves(spec: Spec, design: Design) -> OptimalityCurves | None:
    """The worth of the best direction at each frequency over its price, by the bound over every spectrum."""
    anything = design.any_spectrum
    price, value = anything.certificate.price, anything.certificate.value
    if price is None or value is None:
        return None
    basis, x = anything.basis, anything.x
    assert isinstance(basis, LinesBasis | DirectedLines)
    directions = basis.directions if isinstance(basis, DirectedLines) else np.ones((x.size, 1))
    unit_price = matrices(price.density(basis.frequencies))
    # By what is paid, not by power: power is almost free near DC in a loop with integral action.
    paid = x * np.einsum("na,nab,nb->n", directions.conj(), unit_price, directions).real
    support = np.unique(basis.frequencies[paid > _SUPPORT * paid.sum()])
    lo, hi = design.problem.experiment.band
    start = max(lo, 1e-3 * hi)
    w = np.union1d(np.geomspace(start, hi, _POINTS), support[support >= start])
    ratio, _ = best_directions(price.density(w), value.density(w))
    unit = frequency_unit(spec)
    return OptimalityCurves(w / unit, ratio, distinct(np.maximum(support, w[0])) / unit)


def with_channel_periodograms(
    table: Table, curves: SpectrumCurves | MatrixSpectrumCurves, spec: Spec, samples: Array
) -> tuple[Table, SpectrumCurves | MatrixSpectrumCurves]:
    """The spectrum with the smoothed periodogram of each channel over it; lines are left as they are."""
    if isinstance(curves, SpectrumCurves):
        return with_periodogram(table, curves, spec, samples[:, 0])
    if curves.lines:
        return table, curves
    shown, columns = [], {}
    for a, column in enumerate(samples.T):
        w, smooth = smoothed_periodogram(column, spec.sample_time)
        # Per rad/sample in discrete time, per rad per time unit in continuous time, as the design.
        density = smooth * (1.0 if spec.plant.sampled else spec.sample_time)
        shown.append(np.interp(curves.frequency, w, density))
        columns[f"phi_record_{a + 1}{a + 1}"] = shown[-1]
    return Table({**table.columns, **columns}), replace(curves, record=np.stack(shown, axis=1))


def channel_spectrum_entry(spec: Spec, basis: object, x: Array) -> dict[str, Any]:
    """What `result.json` says of a spectrum of the families for channels and bands."""
    if isinstance(basis, FlatBasis):
        return {"type": "white", "power": float(x[0])}
    if isinstance(basis, MatrixFirBasis):
        return {"type": "fir", "order": basis.order, "coefficients": basis.autocovariances(x)}
    if isinstance(basis, DirectedLines):
        frequencies, powers = basis.lines(x)
        return {
            "type": "free" if basis.free else "multisine",
            "frequencies": frequencies / frequency_unit(spec),
            "powers": plain_complex(powers),
        }
    assert isinstance(basis, PolynomialBasis)
    stated = spec.spectrum
    kind = stated.basis if isinstance(stated, PolynomialSpectrum) else "legendre"
    return {
        "type": "polynomial",
        "basis": kind,
        "order": basis.order,
        "band": [edge / frequency_unit(spec) for edge in basis.band],
        "coefficients": plain_complex(basis.coefficients(x, kind)),
    }


def plain_complex(values: NDArray) -> Any:
    """Complex numbers as {re, im}; real ones as they are."""
    if not np.iscomplexobj(values):
        return values
    if values.ndim == 0:
        return {"re": float(values.real), "im": float(values.imag)}
    return [plain_complex(part) for part in values]
