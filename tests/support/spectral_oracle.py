"""The spectral design by a plain cvxpy program, and an independent certificate: an oracle for the tests.

The certificate needs no program: phi* <= phi(M) + max over S of <grad, S> - <grad, M>. The maximum is the
minimum over mu in [0, 1] of the largest generalised eigenvalue of (Q, mu P_I / K_u + (1 - mu) P_O / K_y).
Here Q = sum of grad_lm A_lm (docs/errata.md).
"""

import warnings

import cvxpy as cp
import numpy as np
import scipy.linalg
import scipy.optimize

from inputdesign_cli.spectrum.svec import svec_layout


def textbook_value(M, criterion):
    """log det M, -tr M^-1, the smallest eigenvalue or tr M."""
    values = np.linalg.eigvalsh(M)
    return {
        "D": np.sum(np.log(np.maximum(values, 1e-300))),
        "A": -np.sum(1 / values),
        "E": values[0],
        "T": values.sum(),
    }[criterion]


class Spectral:
    """Half-band polynomial spectra of `experiment` under a total input and a total output power."""

    def __init__(self, experiment, basis, input_power=1000.0, output_power=1000.0):
        self.experiment, self.basis = experiment, basis
        near = experiment.singularities
        self.maps = basis.integrals(experiment.information_density, near)
        powers = [
            basis.integrals(lambda w, k=k: experiment.power_density(k, w), near) for k in ("input", "output")
        ]
        self.limits = [powers[0] / input_power, powers[1] / output_power]
        self.raw = np.array([experiment.to_raw(m) for m in self.maps])

    def information(self, x):
        """The information (k, k) in raw parameters."""
        return np.tensordot(x, self.raw, axes=1)

    def solve(self, criterion):
        """(x, weight): the optimum, and for E the multiplier of the smallest eigenvalue."""
        L = self.experiment.factor
        k = len(L)
        products = self.basis.products(self._generators())
        order = self._generators().shape[1]
        Y = cp.Variable((order, order), PSD=True)
        rows, columns, scale = svec_layout(order)
        picked = cp.multiply(scale, cp.vec(Y, order="C")[rows * order + columns])
        M = cp.Variable((k, k), symmetric=True)
        upper = np.triu_indices(k)
        flat = upper[0] * k + upper[1]
        gains = self.maps.reshape(len(self.maps), -1).T[flat] @ products
        link = cp.vec(M, order="C")[flat] == gains @ picked
        gauge = np.linalg.inv(L.T @ L)
        unit = gauge / np.linalg.norm(gauge, 2)
        constraints = [link, *((limit @ products) @ picked <= 1 for limit in self.limits)]
        if criterion == "D":
            objective = cp.log_det(M)
        elif criterion == "A":
            objective = -cp.matrix_frac(np.linalg.cholesky(unit), M)
        elif criterion == "E":
            objective = cp.Variable()
            constraints.append(M - objective * unit >> 0)
        else:
            objective = cp.trace((L.T @ L / np.linalg.norm(L, 2) ** 2) @ M)
        problem = cp.Problem(cp.Maximize(objective), constraints)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            problem.solve(solver=cp.CLARABEL)
        x = products @ picked.value
        x = x / max(limit @ x for limit in self.limits)
        weight = None
        if criterion == "E":
            inverse = np.linalg.inv(L)
            weight = inverse.T @ constraints[-1].dual_value @ inverse
            values, vectors = np.linalg.eigh(weight + weight.T)
            weight = (vectors * np.maximum(values, 0)) @ vectors.T
            weight /= np.trace(weight)
        return x, weight

    def _generators(self):
        """All generators of spectra (n, order), orthonormal in the metric of the limits."""
        whole = np.eye(self.basis.gram_order)
        if self.basis.hermitian:
            whole = np.concatenate([whole, 1j * whole], axis=1)
        metric = self.basis.gram(self.limits[0] + self.limits[1])
        values, vectors = np.linalg.eigh((whole.conj().T @ metric @ whole).real)
        return whole @ (vectors / np.sqrt(values))

    def value(self, x, criterion):
        return textbook_value(self.information(x), criterion)

    def bound(self, x, criterion, weight=None):
        """An upper bound of the criterion over the family."""
        M = self.information(x)
        inverse = np.linalg.inv(M)
        gradient = {"D": inverse, "A": inverse @ inverse, "E": weight, "T": np.eye(len(M))}[criterion]
        Q = self.basis.gram(np.tensordot(self.raw, gradient, axes=2))
        P = [self.basis.gram(limit) for limit in self.limits]

        def largest(mu):
            return scipy.linalg.eigh(Q, mu * P[0] + (1 - mu) * P[1], eigvals_only=True)[-1]

        best = min(
            [
                scipy.optimize.minimize_scalar(
                    largest, bounds=(0, 1), method="bounded", options={"xatol": 1e-12}
                ).fun,
                largest(1.0),
            ]
        )
        start = 0.0 if criterion == "E" else self.value(x, criterion)
        return start + best - (0.0 if criterion == "E" else np.sum(gradient * M))
