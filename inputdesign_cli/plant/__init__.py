"""Plants: G, H, their parameter gradients and the loop around them, at any frequencies."""

from inputdesign_cli.plant.coloured import Coloured as Coloured
from inputdesign_cli.plant.continuous_model import ContinuousModel as ContinuousModel
from inputdesign_cli.plant.discretised import (
    delayed as delayed,
    discretised as discretised,
    hold_entries as hold_entries,
    pid as pid,
    zero_order_hold as zero_order_hold,
)
from inputdesign_cli.plant.frequencies import (
    common_grid as common_grid,
    graded_grid as graded_grid,
    local_maxima as local_maxima,
    logarithmic_distance as logarithmic_distance,
)
from inputdesign_cli.plant.held import Intersample as Intersample
from inputdesign_cli.plant.loop import (
    Loop as Loop,
    close_loop as close_loop,
    disturbance_gradients as disturbance_gradients,
    excitation_gradients as excitation_gradients,
    excited as excited,
)
from inputdesign_cli.plant.model import (
    Listed as Listed,
    Model as Model,
    Parameter as Parameter,
    input_gradients as input_gradients,
    noise_gradients as noise_gradients,
)
from inputdesign_cli.plant.polynomial_model import PolynomialModel as PolynomialModel
from inputdesign_cli.plant.reparametrised import (
    Parametrisation as Parametrisation,
    Reparametrised as Reparametrised,
    Words as Words,
)
from inputdesign_cli.plant.sampled_model import SampledModel as SampledModel
from inputdesign_cli.plant.state_space_model import Matrices as Matrices, StateSpaceModel as StateSpaceModel
from inputdesign_cli.plant.transfer import (
    ContinuousRational as ContinuousRational,
    Rational as Rational,
    ScalarTransfer as ScalarTransfer,
    TransferMatrix as TransferMatrix,
)
