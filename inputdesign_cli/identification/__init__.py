"""From samples to models: prediction-error estimates with their covariance, and tests of the residuals."""

from inputdesign_cli.identification.adequacy import ScoreTest as ScoreTest
from inputdesign_cli.identification.directed import (
    RISING as RISING,
    Directed as Directed,
    Moves as Moves,
    that_matter as that_matter,
)
from inputdesign_cli.identification.earlier import Earlier as Earlier
from inputdesign_cli.identification.estimators import (
    BatchEstimate as BatchEstimate,
    Estimate as Estimate,
    fit_batch as fit_batch,
    identify as identify,
    information_of_data as information_of_data,
    with_larger_noise as with_larger_noise,
)
from inputdesign_cli.identification.frequency_response import (
    FrequencyResponse as FrequencyResponse,
    frequency_response as frequency_response,
    response_delays as response_delays,
    silent_in as silent_in,
)
from inputdesign_cli.identification.level_shifts import (
    LevelShift as LevelShift,
    chance_of_shifts as chance_of_shifts,
)
from inputdesign_cli.identification.search import Rival as Rival
from inputdesign_cli.identification.tests import (
    ResidualTest as ResidualTest,
    cross_correlations as cross_correlations,
    whiteness as whiteness,
)
from inputdesign_cli.identification.white import Noise as Noise
