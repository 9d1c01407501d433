"""A spectrum from a file: the `spectrum.csv` of a design, a density or the powers of sinusoids."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.tables import bad_table, has_column, read_frequency_table
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.spectrum import LinesBasis, TabulatedSpectrum

_KEY = "spectrum.given.file"
_NEGATIVE = -1e-9
_DENSITY, _POWER = "phi", "power"
_HINTS = {
    _DENSITY: "give the spectral density, such as the spectrum.csv of a run",
    _POWER: "give the power of each sinusoid, such as the spectrum.csv of a run",
}


def read_given_spectrum(spec: Spec, name: str, r: int) -> tuple[TabulatedSpectrum | LinesBasis, Array]:
    """The spectrum of `r` inputs in a table, and its coefficients.

    Columns phi, or phi_11, phi_12_re, phi_12_im, phi_22, .. are a density, linear in between. Columns power,
    or power_11, .. are the powers of sinusoids at these frequencies, their mean squares.

    Raises:
        DataError: the file cannot be read, or holds no spectrum (`bad-table`).
        SpecError: `too-large` for more sinusoids than `spectrum.given.frequencies` takes.
    """
    path = spec.resolve_path(name)
    lines = has_column(path, _POWER, key=_KEY) and not has_column(path, _DENSITY, key=_KEY)
    symbol = _POWER if lines else _DENSITY
    frequency, values = _read(spec, name, symbol, r, least=1 if lines else 2)
    eigenvalues, vectors = np.linalg.eigh(values)
    if eigenvalues.max() <= 0 or eigenvalues.min() < _NEGATIVE * eigenvalues.max():
        wanted = "nonnegative, and positive somewhere" if r == 1 else "positive semidefinite, and not zero"
        raise bad_table(spec, name, f"{symbol} must be {wanted}", _HINTS[symbol], _KEY)
    frequency = _below_nyquist(spec, name, frequency)
    if not lines:
        return TabulatedSpectrum(frequency, values), np.ones(1)
    most = SIZES["spectrum.given.frequencies"]
    if frequency.size > most.most:
        raise spec.complain(
            "too-large",
            f"{name} holds {frequency.size} sinusoids, and at most {most.most} are taken: {most.why}",
            hint="leave out those of the least power",
            key=_KEY,
        )
    directions = vectors.swapaxes(1, 2).reshape(-1, r)
    powers = np.maximum(eigenvalues, 0.0).ravel()
    there = powers > 0.0
    at = np.repeat(frequency, r)[there]
    return LinesBasis(at, directions[there].astype(complex), np.unique(at), np.ones(r)), powers[there]


def _read(spec: Spec, name: str, symbol: str, r: int, *, least: int) -> tuple[Array, ComplexArray]:
    """Frequencies (n,) and Hermitian values (n, r, r)."""
    pairs = [(i, j) for i in range(r) for j in range(i + 1, r)]
    names: dict[str, tuple[int, int, complex]] = {symbol: (0, 0, 1.0)}
    if r > 1:
        names = {f"{symbol}_{i + 1}{i + 1}": (i, i, 1.0) for i in range(r)}
    for i, j in pairs:
        names |= {f"{symbol}_{i + 1}{j + 1}_re": (i, j, 1.0), f"{symbol}_{i + 1}{j + 1}_im": (i, j, 1j)}
    columns = read_frequency_table(spec, name, list(names), _KEY, least=least)
    values = np.zeros((columns["frequency"].size, r, r), dtype=complex)
    for column, (i, j, unit) in names.items():
        values[:, i, j] += unit * columns[column]
    for i, j in pairs:
        values[:, j, i] = values[:, i, j].conj()
    return columns["frequency"], values


def _below_nyquist(spec: Spec, name: str, frequency: Array) -> Array:
    """The frequencies, of which rounding may have put the last beyond pi.

    Raises:
        DataError: `bad-table`.
    """
    if not spec.plant.sampled:
        return frequency
    if frequency[-1] > np.pi * (1 + 1e-4):
        reached = f"{frequency[-1] / build_units(spec).frequency:g} rad/{spec.time_unit}"
        message = f"it reaches {reached}, beyond the Nyquist frequency"
        raise bad_table(spec, name, message, "frequencies end at pi/sample_time", _KEY)
    return np.minimum(frequency, np.pi)
