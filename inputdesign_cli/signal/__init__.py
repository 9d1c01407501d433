"""Signals: from a spectrum to samples, and what those samples achieve."""

from inputdesign_cli.signal.achieved import input_and_output as input_and_output
from inputdesign_cli.signal.achieved import prediction_gradient as prediction_gradient
from inputdesign_cli.signal.achieved import record_information as record_information
from inputdesign_cli.signal.bounds import Bounds as Bounds
from inputdesign_cli.signal.channel_bounds import ChannelBounds as ChannelBounds
from inputdesign_cli.signal.channel_bounds import limited_responses as limited_responses
from inputdesign_cli.signal.channel_crest import low_peak_angles as low_peak_angles
from inputdesign_cli.signal.channel_crest import schroeder_angles as schroeder_angles
from inputdesign_cli.signal.channel_draw import ChannelSignalGenerator as ChannelSignalGenerator
from inputdesign_cli.signal.channel_information import RecordFilter as RecordFilter
from inputdesign_cli.signal.channel_information import channel_inputs as channel_inputs
from inputdesign_cli.signal.channel_information import channel_outputs as channel_outputs
from inputdesign_cli.signal.channel_information import (
    channel_record_information as channel_record_information,
)
from inputdesign_cli.signal.channel_record import realise_channels as realise_channels
from inputdesign_cli.signal.channels import ChannelPhases as ChannelPhases
from inputdesign_cli.signal.channels import Lines as Lines
from inputdesign_cli.signal.channels import blocks_of as blocks_of
from inputdesign_cli.signal.channels import grid_lines as grid_lines
from inputdesign_cli.signal.channels import in_phase_record as in_phase_record
from inputdesign_cli.signal.channels import merged as merged
from inputdesign_cli.signal.channels import multisine_record as multisine_record
from inputdesign_cli.signal.constraints import largest_move as largest_move
from inputdesign_cli.signal.crest import crest_factor as crest_factor
from inputdesign_cli.signal.crest import optimise_phases as optimise_phases
from inputdesign_cli.signal.generate import filtered_noise as filtered_noise
from inputdesign_cli.signal.generate import line_powers as line_powers
from inputdesign_cli.signal.moments import delayed_regressors as delayed_regressors
from inputdesign_cli.signal.moments import free_regressors as free_regressors
from inputdesign_cli.signal.moments import periodic_input as periodic_input
from inputdesign_cli.signal.moments import rank as rank
from inputdesign_cli.signal.realise import realise as realise
from inputdesign_cli.signal.selection import Record as Record
from inputdesign_cli.signal.selection import Target as Target
from inputdesign_cli.signal.settings import Quantiser as Quantiser
from inputdesign_cli.signal.settings import SignalSettings as SignalSettings
from inputdesign_cli.signal.sinusoids import Sinusoids as Sinusoids
from inputdesign_cli.signal.sinusoids import select as select
from inputdesign_cli.signal.spectral_factor import SpectralFactor as SpectralFactor
from inputdesign_cli.signal.spectral_factor import autocorrelation as autocorrelation
from inputdesign_cli.signal.spectral_factor import spectral_factor as spectral_factor
