"""Formulations of the problem that share nothing with the package."""

import cvxpy as cp
import numpy as np
import scipy.linalg
import scipy.optimize


def mse(R, L1, L2, alpha, variance=1.0):
    """Worst mean-squared error of the moments R, from (6) of the paper with its sign mended."""
    m = len(L1)
    inverse = np.linalg.inv(R[:m, :m])
    bias = L1 @ inverse @ R[:m, m:] - L2
    return alpha**2 * bias @ bias + variance * L1 @ inverse @ L1


def autocorrelations(reflection):
    """rho of reflection coefficients in (-1, 1): every positive definite Toeplitz matrix has them."""
    rho, predictor, error = [1.0], np.zeros(0), 1.0
    for k in reflection:
        rho.append(float(predictor @ np.array(rho[::-1][: predictor.size]) + k * error))
        predictor = np.append(predictor - k * predictor[::-1], k)
        error *= 1.0 - k**2
    return np.array(rho)


def general_search(L1, L2, alpha, rng, *, energy=None, target=None, starts=20):
    """The least error for an energy, or the least energy for a target, by L-BFGS-B from random starts."""
    n = len(L1) + len(L2)

    def value(reflection):
        T = scipy.linalg.toeplitz(autocorrelations(reflection)) / n
        bias_only = mse(T, L1, L2, alpha, 0.0)
        spread = mse(T, L1, L2, 0.0)
        if energy is not None:
            return bias_only + spread / energy
        slack = target - bias_only
        return spread / slack if slack > 1e-9 else 1e6 * (1.0 - slack)

    bounds = [(-0.9999, 0.9999)] * (n - 1)
    found = [
        scipy.optimize.minimize(value, rng.uniform(-0.9, 0.9, n - 1), method="L-BFGS-B", bounds=bounds).fun
        for _ in range(starts)
    ]
    return min(found)


def one_estimated_by_cvxpy(L1, L2, alpha, *, energy):
    """m = 1: R11 is the scalar r0, so the least error for an energy is a convex program."""
    n = 1 + len(L2)
    rho = cp.Variable(n)
    T = sum(rho[k] * scipy.linalg.toeplitz(np.eye(n)[k]) for k in range(n))
    bias = rho[1:] * L1 - np.asarray(L2)
    problem = cp.Problem(cp.Minimize(alpha**2 * cp.sum_squares(bias)), [T >> 0, rho[0] == 1])
    problem.solve(solver=cp.CLARABEL)
    return problem.value + n * L1**2 / energy
