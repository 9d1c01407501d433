"""From samples to models: prediction-error estimates with their covariance, and tests of the residuals."""

from inputdesign_cli.identification.batch import BatchEstimate as BatchEstimate
from inputdesign_cli.identification.batch import fit_batch as fit_batch
from inputdesign_cli.identification.channel_estimate import ChannelEstimate as ChannelEstimate
from inputdesign_cli.identification.channels import ChannelBatch as ChannelBatch
from inputdesign_cli.identification.channels import fit_channel_batch as fit_channel_batch
from inputdesign_cli.identification.channels import identify_channels as identify_channels
from inputdesign_cli.identification.estimate import Estimate as Estimate
from inputdesign_cli.identification.estimate import identify as identify
from inputdesign_cli.identification.predictor import prediction_errors as prediction_errors
from inputdesign_cli.identification.residual_tests import ResidualTest as ResidualTest
from inputdesign_cli.identification.residual_tests import cross_correlation as cross_correlation
from inputdesign_cli.identification.residual_tests import whiteness as whiteness
from inputdesign_cli.identification.structure import Polynomials as Polynomials
from inputdesign_cli.identification.structure import Structure as Structure
from inputdesign_cli.identification.transfer_matrix import fit_transfer_matrices as fit_transfer_matrices
from inputdesign_cli.identification.transfer_matrix import (
    identify_transfer_matrix as identify_transfer_matrix,
)
from inputdesign_cli.identification.transfer_matrix import (
    simulate_transfer_matrix as simulate_transfer_matrix,
)
