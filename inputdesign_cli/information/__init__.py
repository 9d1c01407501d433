"""The information matrix as an affine function of the input spectrum."""

from inputdesign_cli.information.coordinates import Coordinates as Coordinates
from inputdesign_cli.information.experiment import POWER_KINDS as POWER_KINDS
from inputdesign_cli.information.experiment import Experiment as Experiment
from inputdesign_cli.information.experiment import PowerKind as PowerKind
from inputdesign_cli.information.finite_record import FiniteRecord as FiniteRecord
from inputdesign_cli.information.quadrature import Quadrature as Quadrature
from inputdesign_cli.information.quadrature import graded_quadrature as graded_quadrature
from inputdesign_cli.information.quadrature import integrate as integrate
from inputdesign_cli.information.quadrature import integrate_band as integrate_band
