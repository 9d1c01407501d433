"""Spec -> the family of spectra to design in."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.spectrum import (
    FirSpectrum,
    FreeSpectrum,
    GivenSpectrum,
    MultisineSpectrum,
    PolynomialSpectrum,
    WhiteSpectrum,
)
from inputdesign_cli.spectrum import Basis, FirBasis, FlatBasis, LinesBasis, MatrixFirBasis, PolynomialBasis

_DEFAULT_ORDER = 20
_SAME = 1e-9


def build_basis(spec: Spec, inputs: int, band: tuple[float, float]) -> Basis:
    """The family of `spectrum`; FIR of order 20 for a sampled plant when nothing is said.

    Args:
        band: of the excitation, see `excitation_band`.

    Raises:
        SpecError: `not-supported` for families of other kinds of design, `missing-key`; `bad-limit` for
            limits that the family cannot keep.
    """
    match spec.spectrum:
        case WhiteSpectrum():
            basis: Basis = FlatBasis(inputs, band)
        case PolynomialSpectrum() as stated:
            _check_inside(spec, stated)
            complex_valued = stated.coefficients == "complex"
            basis = PolynomialBasis(inputs, stated.order, band, complex_valued, stated.basis)
        case FreeSpectrum():
            basis = LinesBasis.anywhere(*band, inputs)
        case MultisineSpectrum() as stated:
            basis = LinesBasis.at(_line_frequencies(spec, stated, band), inputs)
        case None if not spec.plant.sampled:
            raise spec.complain(
                "missing-key",
                "a design in continuous time needs a family of spectra",
                hint="add sample: zoh to the plant, or spectrum: {type: polynomial, order: 10, band: "
                f"[0, {0.5 * np.pi / spec.sample_time:.3g}]}}",
                key="spectrum",
            )
        case None:
            basis = _fir(spec, inputs, _DEFAULT_ORDER)
        case FirSpectrum(order=order):
            basis = _fir(spec, inputs, order)
        case GivenSpectrum():
            raise _refused(spec, "the excitation is given: there is nothing to design")
        case other:
            raise _refused(spec, f"spectra of type {other.type} are not designed for this plant and accuracy")
    if spec.limits.spectrum is not None and not basis.has_density:
        raise spec.complain(
            "bad-limit",
            "sinusoids have no density, so that limits.spectrum says nothing about them",
            hint="use type: fir, or limit the powers",
            key="limits.spectrum",
        )
    return basis


def _refused(spec: Spec, message: str) -> SpecError:
    hint = "choose fir, multisine, free, polynomial or white"
    return spec.complain("not-supported", message, hint=hint, key="spectrum")


def _fir(spec: Spec, inputs: int, order: int) -> FirBasis | MatrixFirBasis:
    if spec.limits.band is not None:
        raise spec.complain(
            "bad-limit",
            "a FIR spectrum does not vanish outside a band: no trigonometric polynomial does",
            hint="use type: polynomial, multisine or free, or bound the density outside by limits.spectrum",
            key="limits.band",
        )
    return FirBasis(order) if inputs == 1 else MatrixFirBasis(inputs, order)


def _check_inside(spec: Spec, stated: PolynomialSpectrum) -> None:
    """A polynomial spectrum has a band of its own."""
    limit, (lo, hi) = spec.limits.band, stated.band
    if limit is not None and (lo < limit[0] * (1 - _SAME) or hi > limit[1] * (1 + _SAME)):
        raise spec.complain(
            "bad-limit",
            f"the band of the spectrum, [{lo:g}, {hi:g}], leaves limits.band, [{limit[0]:g}, {limit[1]:g}]",
            hint="narrow spectrum.band; limits.band is not needed, a polynomial spectrum has its own",
            key="spectrum.band",
        )


def _line_frequencies(spec: Spec, stated: MultisineSpectrum, band: tuple[float, float]) -> Array:
    """The given frequencies in the unit of the experiment, or even ones inside the band.

    `lines: L` in discrete time are l pi / L, l = 1 .. L, the harmonics of a period of 2 L samples up to the
    Nyquist frequency, where a spectrum is real. In continuous time they are L even ones inside the band.
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
        raise spec.complain(
            "too-few-lines",
            f"none of the {count} evenly spaced lines lies inside the band",
            hint="ask for more lines, or widen the band",
            key="spectrum.lines",
        )
    return inside
