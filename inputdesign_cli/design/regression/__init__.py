"""Mean-squared-error design for reduced-order regression: closed form, Toeplitz search, proofs."""

from inputdesign_cli.design.regression.closed_form import energy_bound as energy_bound
from inputdesign_cli.design.regression.closed_form import error_bound as error_bound
from inputdesign_cli.design.regression.closed_form import least_energy as least_energy
from inputdesign_cli.design.regression.closed_form import least_error as least_error
from inputdesign_cli.design.regression.model import ErrorSplit as ErrorSplit
from inputdesign_cli.design.regression.model import Regression as Regression
from inputdesign_cli.design.regression.model import Sensitivity as Sensitivity
from inputdesign_cli.design.regression.model import energy_sensitivity as energy_sensitivity
from inputdesign_cli.design.regression.model import error_sensitivity as error_sensitivity
from inputdesign_cli.design.regression.structured import OutOfReachError as OutOfReachError
from inputdesign_cli.design.regression.structured import ToeplitzDesign as ToeplitzDesign
from inputdesign_cli.design.regression.structured import design_toeplitz as design_toeplitz
