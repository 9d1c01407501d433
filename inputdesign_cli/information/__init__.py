"""The information matrix as an affine function of the input spectrum."""

from inputdesign_cli.information.experiment import (
    POWER_KINDS as POWER_KINDS,
    Experiment as Experiment,
    PowerKind as PowerKind,
    WeightedProducts as WeightedProducts,
)
from inputdesign_cli.information.finite_record import (
    FiniteRecord as FiniteRecord,
    FiniteRecords as FiniteRecords,
)
from inputdesign_cli.information.joint import (
    joint_information as joint_information,
    joint_noise as joint_noise,
    jointly_whitened as jointly_whitened,
    mean_cost as mean_cost,
)
from inputdesign_cli.information.quadrature import (
    Quadrature as Quadrature,
    Values as Values,
    graded_quadrature as graded_quadrature,
    integrand as integrand,
    integrate as integrate,
    integrate_band as integrate_band,
)
