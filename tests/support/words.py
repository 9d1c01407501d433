"""A property of a plant that does not depend on how a spec states the plant."""

import numpy as np


def largest_errors(experiment):
    """(3,): (r_u / alpha)^2 at three frequencies in white excitation, an eigenvalue of T M^-1 T^T."""
    at = experiment.whitened(1.0)
    rows = at.whiten_rows(at.model.plant_gradient(np.array([0.03, 0.3, 0.9]))[:, :, 0, 0])
    stacked = np.stack([rows.real, rows.imag], axis=1)
    return np.linalg.eigvalsh(stacked @ stacked.swapaxes(1, 2))[:, -1]
