"""Families of input spectra, one parametrisation a file."""

from inputdesign_cli.spectrum.basis import Basis as Basis
from inputdesign_cli.spectrum.basis import Face as Face
from inputdesign_cli.spectrum.basis import Functional as Functional
from inputdesign_cli.spectrum.basis import Pricing as Pricing
from inputdesign_cli.spectrum.directions import best_directions as best_directions
from inputdesign_cli.spectrum.directions import directed_scale as directed_scale
from inputdesign_cli.spectrum.directions import first_directions as first_directions
from inputdesign_cli.spectrum.directions import matrices as matrices
from inputdesign_cli.spectrum.fir import FirBasis as FirBasis
from inputdesign_cli.spectrum.flat import FlatBasis as FlatBasis
from inputdesign_cli.spectrum.flat import flat_basis as flat_basis
from inputdesign_cli.spectrum.gram import GramBasis as GramBasis
from inputdesign_cli.spectrum.lines import LinesBasis as LinesBasis
from inputdesign_cli.spectrum.matrix_fir import MatrixFirBasis as MatrixFirBasis
from inputdesign_cli.spectrum.polynomial import PolynomialBasis as PolynomialBasis
from inputdesign_cli.spectrum.svec import hmat as hmat
from inputdesign_cli.spectrum.svec import hvec as hvec
from inputdesign_cli.spectrum.svec import smat as smat
from inputdesign_cli.spectrum.svec import svec as svec
from inputdesign_cli.spectrum.svec import svec_layout as svec_layout
from inputdesign_cli.spectrum.svec import svec_length as svec_length
from inputdesign_cli.spectrum.tabulated import TabulatedSpectrum as TabulatedSpectrum
