"""Families of input spectra, one parametrisation a file."""

from inputdesign_cli.spectrum.basis import Basis as Basis
from inputdesign_cli.spectrum.basis import Face as Face
from inputdesign_cli.spectrum.basis import Functional as Functional
from inputdesign_cli.spectrum.basis import Pricing as Pricing
from inputdesign_cli.spectrum.basis import pointwise_scale as pointwise_scale
from inputdesign_cli.spectrum.fir import FirBasis as FirBasis
from inputdesign_cli.spectrum.lines import LinesBasis as LinesBasis
from inputdesign_cli.spectrum.svec import smat as smat
from inputdesign_cli.spectrum.svec import svec as svec
from inputdesign_cli.spectrum.svec import svec_length as svec_length
