import numpy as np
import pytest
import scipy.stats

from inputdesign_cli.monte_carlo.statistics import binomial_limits, whitened_eigenvalues, wishart_range


@pytest.mark.parametrize(("successes", "runs"), [(0, 20), (17, 20), (20, 20), (415, 500)])
def test_binomial_limits(successes, runs):
    expected = scipy.stats.binomtest(successes, runs).proportion_ci(0.95, method="exact")
    assert binomial_limits(successes, runs) == pytest.approx((expected.low, expected.high))


def test_whitened_eigenvalues_do_not_depend_on_coordinates():
    rng = np.random.default_rng(1)
    M = np.array([[4.0, 1.0], [1.0, 1.0]])
    theta = rng.standard_normal((400, 2)) @ np.linalg.inv(np.linalg.cholesky(M))
    values = whitened_eigenvalues(theta, M)
    T = np.array([[1e3, 2.0], [0.0, 1e-2]])
    changed = whitened_eigenvalues(theta @ T.T, np.linalg.inv(T).T @ M @ np.linalg.inv(T))
    np.testing.assert_allclose(values, changed, rtol=1e-9)
    np.testing.assert_allclose(
        values, np.linalg.eigvals(np.cov(theta.T) @ M)[np.argsort(np.linalg.eigvals(np.cov(theta.T) @ M))]
    )
    low, high = wishart_range(2, 400, rng)
    assert low < values[0] <= values[1] < high
