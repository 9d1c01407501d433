"""Signals: from a spectrum to samples, and what those samples achieve."""

from inputdesign_cli.signal.achieved import input_and_output as input_and_output
from inputdesign_cli.signal.achieved import prediction_gradient as prediction_gradient
from inputdesign_cli.signal.achieved import record_information as record_information
from inputdesign_cli.signal.choose import Record as Record
from inputdesign_cli.signal.choose import realise as realise
from inputdesign_cli.signal.generate import filtered_noise as filtered_noise
from inputdesign_cli.signal.generate import line_powers as line_powers
from inputdesign_cli.signal.generate import multisine as multisine
from inputdesign_cli.signal.spectral_factor import SpectralFactor as SpectralFactor
from inputdesign_cli.signal.spectral_factor import autocorrelation as autocorrelation
from inputdesign_cli.signal.spectral_factor import spectral_factor as spectral_factor
