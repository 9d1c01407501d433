"""Mean-squared-error design for reduced-order regression: closed form, Toeplitz search, proofs."""

from inputdesign_cli.design.regression.model import (
    ErrorSplit as ErrorSplit,
    MomentsDesign as MomentsDesign,
    Regression as Regression,
    Sensitivity as Sensitivity,
    energy_bound as energy_bound,
    error_bound as error_bound,
    least_error as least_error,
    sensitivity as sensitivity,
)
from inputdesign_cli.design.regression.structured import (
    OutOfReachError as OutOfReachError,
    design_toeplitz as design_toeplitz,
)
