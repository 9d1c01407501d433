"""Mean-squared-error design for reduced-order regression: closed form, Toeplitz search, proofs."""

from inputdesign_cli.design.regression.closed_form import (
    energy_bound as energy_bound,
    error_bound as error_bound,
    least_energy as least_energy,
    least_error as least_error,
)
from inputdesign_cli.design.regression.model import (
    ErrorSplit as ErrorSplit,
    Regression as Regression,
    Sensitivity as Sensitivity,
    energy_sensitivity as energy_sensitivity,
    error_sensitivity as error_sensitivity,
)
from inputdesign_cli.design.regression.structured import (
    OutOfReachError as OutOfReachError,
    ToeplitzDesign as ToeplitzDesign,
    design_toeplitz as design_toeplitz,
)
