"""Spec -> the family of spectra to design in and its limits, or the spectrum of a file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, cast

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.convex.limits import DensityLimit, PowerLimit
from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import POWER_KINDS, Experiment, PowerKind
from inputdesign_cli.plant import graded_grid
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.signal_settings import stated_moves, stated_peaks
from inputdesign_cli.questions.building.tables import bad_table, check_rows, has_column, read_frequency_table
from inputdesign_cli.questions.building.weights import build_weight, check_finite, on_the_limit
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.limits import Curve
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.models.spectrum import (
    FirSpectrum,
    FreeSpectrum,
    MultisineSpectrum,
    PolynomialSpectrum,
    WhiteSpectrum,
)
from inputdesign_cli.specification.plugins import added
from inputdesign_cli.spectrum import (
    Basis,
    FirBasis,
    FlatBasis,
    LinesBasis,
    PolynomialBasis,
    TabulatedSpectrum,
)

_DEFAULT_ORDER = 20
_SAME = 1e-9


class AddedSpectrum(Protocol):
    """Describes a section of `spectrum` that another package adds (`specification.plugins`)."""

    def build(self, spec: Spec, inputs: int, band: tuple[float, float]) -> Basis:
        """Return the family of spectra of inputs in a band; see `build_basis`."""


def build_basis(spec: Spec, inputs: int, band: tuple[float, float]) -> Basis:
    """Return the family of `spectrum` in a band of the excitation; by default FIR of order 20 if sampled.

    Raises `SpecError`: `not-supported` for families of other kinds of design, `missing-key`, `bad-limit`.
    """
    match spec.spectrum:
        case WhiteSpectrum():
            basis: Basis = FlatBasis(inputs, band)
        case PolynomialSpectrum() as stated:
            limit, (lo, hi) = spec.limits.band, stated.band
            if limit is not None and (lo < limit[0] * (1 - _SAME) or hi > limit[1] * (1 + _SAME)):
                bounds = f"limits.band, [{limit[0]:g}, {limit[1]:g}]"
                message = f"the band of the spectrum, [{lo:g}, {hi:g}], leaves {bounds}"
                hint = "narrow spectrum.band; limits.band is not needed, a polynomial spectrum has its own"
                raise spec.complain("bad-limit", message, hint=hint, key="spectrum.band")
            complex_valued = stated.coefficients == "complex"
            basis = PolynomialBasis(inputs, stated.order, band, complex_valued, stated.basis)
        case FreeSpectrum():
            basis = LinesBasis.anywhere(*band, inputs)
        case MultisineSpectrum() as stated:
            basis = LinesBasis.at(_line_frequencies(spec, stated, band), inputs)
        case None if not spec.plant.sampled:
            message = "a design in continuous time needs a family of spectra"
            end = f"{0.5 * np.pi / spec.sample_time:.3g}"
            own = f"spectrum: {{type: polynomial, order: 10, band: [0, {end}]}}"
            hint = f"add sample: zoh to the plant, or {own}"
            raise spec.complain("missing-key", message, hint=hint, key="spectrum")
        case None:
            basis = _fir(spec, inputs, _DEFAULT_ORDER)
        case FirSpectrum(order=order):
            basis = _fir(spec, inputs, order)
        case other if other.type in added("spectra"):
            basis = cast(AddedSpectrum, other).build(spec, inputs, band)
        case other:
            raise _refused(spec, f"spectra of type {other.type} are not designed for this plant and accuracy")
    if spec.limits.spectrum is not None and not basis.has_density:
        message = "sinusoids have no density, so that limits.spectrum says nothing about them"
        hint = "use type: fir, or limit the powers"
        raise spec.complain("bad-limit", message, hint=hint, key="limits.spectrum")
    return basis


def _refused(spec: Spec, message: str) -> SpecError:
    hint = "choose fir, multisine, free, polynomial or white"
    return spec.complain("not-supported", message, hint=hint, key="spectrum")


def _fir(spec: Spec, inputs: int, order: int) -> FirBasis:
    if spec.limits.band is not None:
        message = "a FIR spectrum does not vanish outside a band: no trigonometric polynomial does"
        hint = "use type: polynomial, multisine or free, or bound the density outside by limits.spectrum"
        raise spec.complain("bad-limit", message, hint=hint, key="limits.band")
    return FirBasis(inputs, order)


def _line_frequencies(spec: Spec, stated: MultisineSpectrum, band: tuple[float, float]) -> Array:
    """Return the stated frequencies in the experiment's unit, or evenly spaced ones in the band.

    `lines: L` in discrete time are the harmonics l pi / L, l = 1 .. L, of a period of 2 L samples.
    """
    if stated.frequencies:
        given = np.array(stated.frequencies)
        return np.minimum(given * spec.sample_time, np.pi) if spec.plant.sampled else given
    count = stated.lines or 0
    if not spec.plant.sampled:
        return np.linspace(*band, count + 2)[1:-1]
    even = np.pi * np.arange(1, count + 1) / count
    inside = even[(even >= band[0] * (1 - _SAME)) & (even <= band[1] * (1 + _SAME))]
    if inside.size == 0:
        message = f"none of the {count} evenly spaced lines lies inside the band"
        hint = "ask for more lines, or widen the band"
        raise spec.complain("too-few-lines", message, hint=hint, key="spectrum.lines")
    return inside


_GIVEN = "spectrum.given.file"
_NEGATIVE = -1e-9
_DENSITY, _POWER = "phi", "power"
_HINTS = {
    _DENSITY: "give the spectral density, as spectrum.csv of a run has it",
    _POWER: "give the power of each sinusoid, as spectrum.csv of a run has it",
}


def read_given_spectrum(spec: Spec, name: str, r: int) -> tuple[TabulatedSpectrum | LinesBasis, Array]:
    """Return the spectrum of `r` inputs in a table, and its coefficients.

    Columns phi, or phi_11, phi_12_re, phi_12_im, phi_22, .. are a density, linear in between. Columns power,
    or power_11, .. are the mean squares of sinusoids. Raises `DataError` (`bad-table`, or it cannot be read),
    or `SpecError` (`too-large`) for too many sinusoids.
    """
    path = spec.resolve_path(name)
    lines = has_column(path, _POWER, key=_GIVEN) and not has_column(path, _DENSITY, key=_GIVEN)
    symbol = _POWER if lines else _DENSITY
    frequency, values = _read(spec, name, symbol, r, least=1 if lines else 2)
    eigenvalues, vectors = np.linalg.eigh(values)
    if eigenvalues.max() <= 0 or eigenvalues.min() < _NEGATIVE * eigenvalues.max():
        wanted = "nonnegative, and positive somewhere" if r == 1 else "positive semidefinite, and not zero"
        least = f"it is least in row {int(np.argmin(eigenvalues.min(axis=1))) + 2}"
        raise bad_table(spec, name, f"{symbol} must be {wanted}; {least}", _HINTS[symbol], _GIVEN)
    if spec.plant.sampled and frequency[-1] > np.pi * (1 + 1e-4):
        message = f"it reaches {build_units(spec).named(frequency[-1])}, beyond the Nyquist frequency"
        raise bad_table(spec, name, message, "frequencies end at pi/sample_time", _GIVEN)
    if spec.plant.sampled:  # the last one may lie beyond pi by rounding
        frequency = np.minimum(frequency, np.pi)
    if not lines:
        return TabulatedSpectrum(frequency, values), np.ones(1)
    most = SIZES["spectrum.given.frequencies"]
    if frequency.size > most.most:
        what = f"{name} holds {frequency.size} sinusoids"
        message = f"{what}, and at most {most.most} are taken: {most.why}"
        hint = "leave out the sinusoids of the least power"
        raise spec.complain("too-large", message, hint=hint, key=_GIVEN)
    directions = vectors.swapaxes(1, 2).reshape(-1, r)
    powers = np.maximum(eigenvalues, 0.0).ravel()
    there = powers > 0.0
    at = np.repeat(frequency, r)[there]
    return LinesBasis(at, directions[there].astype(complex), np.unique(at), np.ones(r)), powers[there]


def _read(spec: Spec, name: str, symbol: str, r: int, *, least: int) -> tuple[Array, ComplexArray]:
    """Read frequencies (n,) and Hermitian values (n, r, r) of a spectrum."""
    pairs = [(i, j) for i in range(r) for j in range(i + 1, r)]
    names: dict[str, tuple[int, int, complex]] = {symbol: (0, 0, 1.0)}
    if r > 1:
        names = {f"{symbol}_{i + 1}{i + 1}": (i, i, 1.0) for i in range(r)}
    for i, j in pairs:
        names |= {f"{symbol}_{i + 1}{j + 1}_re": (i, j, 1.0), f"{symbol}_{i + 1}{j + 1}_im": (i, j, 1j)}
    columns = read_frequency_table(spec, name, list(names), _GIVEN, least=least)
    values = np.zeros((columns["frequency"].size, r, r), dtype=complex)
    for column, (i, j, unit) in names.items():
        values[:, i, j] += unit * columns[column]
    for i, j in pairs:
        values[:, j, i] = values[:, i, j].conj()
    return columns["frequency"], values


_LIMIT = "limits.spectrum"


def build_power_limits(spec: Spec) -> list[PowerLimit]:
    """Return the upper and lower limits on the powers, without lower limits of zero."""
    limits = spec.limits
    stated = (limits.input_power, limits.output_power, limits.excitation_power)
    return [
        PowerLimit(kind, float(v), upper, None if np.size(value) == 1 else channel)
        for kind, bounds in zip(POWER_KINDS, stated, strict=True)
        if bounds is not None
        for value, upper in ((bounds.max, True), (bounds.min, False))
        if value is not None
        for channel, v in enumerate(np.ravel(value))
        if upper or v > 0
    ]


def implied_limits(spec: Spec) -> list[PowerLimit]:
    """Return the limits on powers that follow from limits on samples and moves: a^2 from |u| <= a."""
    kinds: list[PowerKind] = ["input", "output", "moves"]
    most = [*stated_peaks(spec), stated_moves(spec) if spec.plant.sampled else None]
    return [
        PowerLimit(kind, float(a) ** 2, channel=channel if peak.size > 1 else None, implied=True)
        for kind, peak in zip(kinds, most, strict=True)
        if peak is not None
        for channel, a in enumerate(peak)
        if np.isfinite(a)
    ]


def build_density_limits(spec: Spec, experiment: Experiment) -> list[DensityLimit]:
    """Return the bounds on the density of the excitation at every frequency of its band."""
    stated = spec.limits.spectrum
    if stated is None:
        return []
    units, limits = build_units(spec), []
    for curve, upper in ((stated.max, True), (stated.min, False)):
        if curve is None or curve == 0.0:
            continue
        key = f"{_LIMIT}.{'max' if upper else 'min'}" if stated.min is not None else _LIMIT
        level, knots, singular, zero = _level(spec, curve, key, experiment.band)
        grid = graded_grid(
            np.concatenate([experiment.singularities, singular]), *experiment.band, knots=knots
        )
        if upper and zero is None and level(grid).min() <= 0.0:
            zero = float(grid[int(np.argmin(level(grid)))])
        if zero is not None:
            message = f"the {'upper' if upper else 'lower'} bound vanishes at {units.named(zero)}"
            raise spec.complain("bad-limit", message, hint="give a small positive bound instead", key=key)
        limits.append(DensityLimit(level, grid, upper))
    if len(limits) == 2:
        grid = np.union1d(limits[0].grid, limits[1].grid)
        room = limits[0].level(grid) - limits[1].level(grid)
        if room.min() <= 0:
            at = units.named(grid[int(np.argmin(room))])
            message = f"min reaches max at {at}: no spectrum fits in between"
            raise spec.complain("bad-limit", message, hint="lower min or raise max there", key=_LIMIT)
    return limits


def _level(
    spec: Spec, curve: Curve, key: str, band: tuple[float, float]
) -> tuple[Callable[[Array], Array], Array, ComplexArray, float | None]:
    """Return the level over frequency, its kinks, points of fast change, and its zero; or raise."""
    nowhere, smooth = np.zeros(0), np.zeros(0, dtype=complex)
    if isinstance(curve, float | int):
        constant = float(curve)
        return lambda w: np.full(np.shape(w), constant), nowhere, smooth, None
    if curve.kind == "table":
        columns = read_frequency_table(spec, curve.table, ["phi"], key)
        frequency, value = columns["frequency"], columns["phi"]
        why, hint = "it must not be negative", "correct the values"
        check_rows(spec, curve.table, "phi", value, value < 0, why, hint, key)
        return lambda w: np.interp(w, frequency, value), frequency, smooth, None
    W = build_weight(spec, curve, key)
    check_finite(spec, W, band, "bad-limit", key)
    return lambda w: np.abs(W.at(w)) ** 2, nowhere, W.singularities, on_the_limit(W.zero_points, band)
