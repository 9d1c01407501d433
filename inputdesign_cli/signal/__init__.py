"""Signals: from a spectrum to samples, and the best of several by what those samples achieve."""

from inputdesign_cli.signal.bounds import (
    Bounds as Bounds,
    limited_responses as limited_responses,
    peak_share as peak_share,
)
from inputdesign_cli.signal.constraints import largest_move as largest_move
from inputdesign_cli.signal.crest import crest_factor as crest_factor, optimise_phases as optimise_phases
from inputdesign_cli.signal.designed import DesignedSpectrum as DesignedSpectrum
from inputdesign_cli.signal.evaluation import Target as Target
from inputdesign_cli.signal.generator import SignalGenerator as SignalGenerator
from inputdesign_cli.signal.lines import Lines as Lines, grid_lines as grid_lines, merged as merged
from inputdesign_cli.signal.moments import (
    delayed_regressors as delayed_regressors,
    free_regressors as free_regressors,
    periodic_input as periodic_input,
    rank as rank,
)
from inputdesign_cli.signal.multisine import (
    blocks_of as blocks_of,
    in_phase_record as in_phase_record,
    multisine_record as multisine_record,
)
from inputdesign_cli.signal.phases import (
    low_peak_phases as low_peak_phases,
    schroeder_phases as schroeder_phases,
)
from inputdesign_cli.signal.selection import LONG as LONG, Record as Record, best_record as best_record
from inputdesign_cli.signal.settings import (
    LineVectors as LineVectors,
    Quantiser as Quantiser,
    SignalSettings as SignalSettings,
)
from inputdesign_cli.signal.sinusoids import Sinusoids as Sinusoids, select as select
from inputdesign_cli.signal.spectral_factor import (
    SpectralFactor as SpectralFactor,
    autocorrelation as autocorrelation,
    spectral_factor as spectral_factor,
)
