"""Spec -> the family of spectra to design in."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import graded_grid
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.spectrum import (
    FirSpectrum,
    FreeSpectrum,
    MultisineSpectrum,
    WhiteSpectrum,
)
from inputdesign_cli.spectrum import Basis, DirectedLines, FirBasis, LinesBasis

DEFAULT_ORDER = 20
_SAME = 1e-9


def build_basis(spec: Spec, experiment: Experiment) -> FirBasis | LinesBasis:
    """The basis of `spectrum`; FIR of order 20 when nothing is said.

    `multisine` with `lines: L` has its lines at l pi / L, l = 1 .. L, below or at the Nyquist frequency:
    the harmonics of a period of 2 L samples.

    Raises:
        SpecError: for a family that this plant does not have, or limits that the family cannot keep.
    """
    spectrum = spec.spectrum
    if spectrum is None or isinstance(spectrum, FirSpectrum):
        basis: FirBasis | LinesBasis = FirBasis(DEFAULT_ORDER if spectrum is None else spectrum.order)
    elif isinstance(spectrum, WhiteSpectrum):
        basis = FirBasis(0)
    elif isinstance(spectrum, FreeSpectrum):
        lo, hi = band_of_lines(spec)
        grid = graded_grid(experiment.singularities, lo, hi)
        basis = LinesBasis.anywhere(grid)
    elif isinstance(spectrum, MultisineSpectrum):
        basis = LinesBasis(_lines(spec, spectrum))
    else:
        raise spec.complain(
            "not-supported",
            f"spectra of type {spectrum.type} do not go with this plant and goal"
            if hasattr(spectrum, "type")
            else "the excitation is given: there is nothing to design",
            hint="use type: fir, white, multisine or free",
            key="spectrum",
        )
    _check_limits(spec, basis)
    return basis


def band_of_lines(spec: Spec) -> tuple[float, float]:
    """`limits.band` in rad/sample; all frequencies when there is none."""
    lo, hi = spec.clip_band(spec.limits.band)
    return lo * spec.sample_time, min(hi * spec.sample_time, float(np.pi))


def _lines(spec: Spec, spectrum: MultisineSpectrum) -> np.ndarray:
    lo, hi = band_of_lines(spec)
    if spectrum.frequencies is not None:
        return np.minimum(np.array(spectrum.frequencies) * spec.sample_time, np.pi)
    assert spectrum.lines is not None
    lines = np.pi * np.arange(1, spectrum.lines + 1) / spectrum.lines
    inside = lines[(lines >= lo * (1 - _SAME)) & (lines <= hi * (1 + _SAME))]
    if inside.size == 0:
        raise spec.complain(
            "too-few-lines",
            f"none of the {spectrum.lines} evenly spaced lines lies in limits.band",
            hint="ask for more lines, or widen the band",
            key="spectrum.lines",
        )
    return inside


def _check_limits(spec: Spec, basis: FirBasis | LinesBasis) -> None:
    if isinstance(basis, FirBasis) and spec.limits.band is not None:
        raise spec.complain(
            "bad-limit",
            "a FIR spectrum does not vanish outside a band: no trigonometric polynomial does",
            hint="use type: multisine or type: free, or bound the density outside by limits.spectrum",
            key="limits.band",
        )
    check_has_density(spec, basis)


def check_has_density(spec: Spec, basis: Basis) -> None:
    """Raise `SpecError` (`bad-limit`) for a bound on the density of sinusoids, which have none."""
    if isinstance(basis, LinesBasis | DirectedLines) and spec.limits.spectrum is not None:
        raise spec.complain(
            "bad-limit",
            "sinusoids have no density, so that limits.spectrum says nothing about them",
            hint="use type: fir, or limit the powers",
            key="limits.spectrum",
        )
