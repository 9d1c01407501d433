"""Mean-squared-error design for reduced-order regression: closed form, Toeplitz search, proofs."""

from inputdesign_cli.design.mse.closed_form import energy_bound as energy_bound
from inputdesign_cli.design.mse.closed_form import error_bound as error_bound
from inputdesign_cli.design.mse.closed_form import least_energy as least_energy
from inputdesign_cli.design.mse.closed_form import least_error as least_error
from inputdesign_cli.design.mse.regression import ErrorSplit as ErrorSplit
from inputdesign_cli.design.mse.regression import Regression as Regression
from inputdesign_cli.design.mse.regression import Sensitivity as Sensitivity
from inputdesign_cli.design.mse.regression import energy_sensitivity as energy_sensitivity
from inputdesign_cli.design.mse.regression import error_sensitivity as error_sensitivity
from inputdesign_cli.design.mse.structured import OutOfReachError as OutOfReachError
from inputdesign_cli.design.mse.structured import ToeplitzDesign as ToeplitzDesign
from inputdesign_cli.design.mse.structured import design_toeplitz as design_toeplitz
