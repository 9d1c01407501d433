"""Families of input spectra, one parametrisation a file."""

from inputdesign_cli.spectrum.basis import (
    Basis as Basis,
    Density as Density,
    Face as Face,
    Functional as Functional,
    Pricing as Pricing,
    constant as constant,
    kept_on_grid as kept_on_grid,
    weighted_mean as weighted_mean,
)
from inputdesign_cli.spectrum.directions import (
    best_directions as best_directions,
    directed_scale as directed_scale,
    first_directions as first_directions,
    matrices as matrices,
)
from inputdesign_cli.spectrum.fir import FirBasis as FirBasis
from inputdesign_cli.spectrum.flat import FlatBasis as FlatBasis, flat_basis as flat_basis
from inputdesign_cli.spectrum.gram import GramBasis as GramBasis
from inputdesign_cli.spectrum.lines import LinesBasis as LinesBasis
from inputdesign_cli.spectrum.polynomial import PolynomialBasis as PolynomialBasis
from inputdesign_cli.spectrum.svec import (
    hmat as hmat,
    hvec as hvec,
    smat as smat,
    svec as svec,
    svec_layout as svec_layout,
    svec_length as svec_length,
)
from inputdesign_cli.spectrum.tabulated import TabulatedSpectrum as TabulatedSpectrum
