"""The mean error of a rounded level behind noise, against the exact expectation of the rounding."""

import numpy as np
import pytest
import scipy.stats

from inputdesign_cli.findings.faults import rounding_error


def largest_mean_error(step, noise):
    """The largest mean error over levels within a step, by the normal probabilities of the cells."""
    level, cell = np.linspace(0.0, step, 401), step * np.arange(-40, 42)
    edges = np.append(cell - 0.5 * step, cell[-1] + 0.5 * step)
    mass = np.diff(scipy.stats.norm.cdf((edges[None] - level[:, None]) / noise), axis=1)
    return float(np.abs(mass @ cell - level).max())


@pytest.mark.parametrize("noise", [0.01, 0.1, 0.2, 0.35, 0.5, 1.0])
def test_the_bound_of_rounding_errors_holds_and_is_at_most_60_percent_larger(noise):
    exact = largest_mean_error(2.0, 2.0 * noise)
    stated = rounding_error(2.0, 2.0 * noise)
    assert exact <= stated * (1 + 1e-9) + 1e-12
    assert stated <= 1.6 * exact + 1e-12
