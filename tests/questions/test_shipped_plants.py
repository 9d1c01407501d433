"""Golden values of plants in physical parameters, by closed forms, scipy and cvxpy.

The package computes no expected value: gradients are differences of responses that are written out here,
sampled by scipy or by the step response. The least cost is a semidefinite program over the powers.
"""

from pathlib import Path

import cvxpy as cp
import numpy as np
import pytest
import scipy.signal
import yaml

from inputdesign_cli import analyse, load_spec, solve

GOLDEN = Path(__file__).parents[2] / "golden"


def golden(name):
    """The expected values of a golden file by their paths in the result."""
    runs = yaml.safe_load((GOLDEN / f"{name}.yaml").read_text(encoding="utf-8"))["runs"]
    return {one["path"]: one["expected"] for run in runs for one in run["quantities"]}


def slopes(response, theta, share=1e-4):
    """dG / d theta (n, k, ..) by differences of fourth order, steps relative to the parameters."""
    columns = []
    for k, value in enumerate(theta):
        step = np.eye(len(theta))[k] * share * value

        def at(times, step=step):
            return response(np.asarray(theta) + times * step)

        columns.append((8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * share * value))
    return np.stack(columns, axis=1)


def least_cost(information, price, known, most):
    """min sum price_i p_i with M = known + sum p_i information_i and every variance below its limit.

    The scale of the powers is that of the answer, so that the solver sees numbers of order one.
    """
    scaled, unit = information * np.outer(most, most), 1.0
    for _ in range(2):
        powers = cp.Variable(len(scaled), nonneg=True)
        M = known * np.outer(most, most) + sum(
            p * unit * matrix for p, matrix in zip(powers, scaled, strict=True)
        )
        limits = [cp.matrix_frac(e, M) <= 1 for e in np.eye(len(most))]
        plain = cp.Problem(cp.Minimize(price @ powers), limits)
        plain.solve(solver="CLARABEL")
        value, unit = plain.value * unit, plain.value * unit / max(float(np.max(price)), 1e-300)
    return value


def held_lag(K, T, L, h, z):
    """K e^(-Ls) / (T s + 1) behind a hold."""
    d = int(np.floor(L / h))
    rest = h - (L - d * h)
    a, early = np.exp(-h / T), 1.0 - np.exp(-rest / T)
    return K * (early * z ** -(d + 1) + (1.0 - a - early) * z ** -(d + 2)) / (1.0 - a / z)


HEATERS = {"heater": 720, "heater_drift": int(3600 / 4.76)}


def heater_cost(name):
    """With drift, prediction errors are (1 - q^-1) / (1 - 0.8 q^-1) times the errors of the output."""
    h, samples = 4.76, HEATERS[name]
    z = np.exp(1j * np.arange(1, 121) * np.pi / 120)
    F = slopes(lambda x: held_lag(*x, h, z), [2.1, 180.0, 25.0], 1e-3)
    F = F * ((1 - 1 / z) / (1 - 0.8 / z))[:, None] if name == "heater_drift" else F
    information = samples / 0.04 * np.einsum("nk,nl->nkl", F, F.conj()).real
    return least_cost(information, np.ones(120), np.zeros((3, 3)), np.array([0.05, 6.0, 0.5]))


@pytest.mark.parametrize("name", HEATERS)
def test_the_golden_cost_of_the_heater_is_that_of_a_semidefinite_program(name):
    assert golden(name)["cost"] == pytest.approx(heater_cost(name), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", HEATERS)
def test_the_designed_cost_of_the_heater_is_that_of_a_semidefinite_program(name):
    found = solve(load_spec(f"specs/{name}.yaml")).result
    assert found["cost"] == pytest.approx(heater_cost(name), rel=1e-5)


def loop_design(response, theta, most, controller, h, samples, variance):
    """The least cost of lines of r in a loop, with the information of e and the powers of u and y."""

    def parts(w):
        z = np.exp(1j * w)
        G, C = response(np.asarray(theta))(z), controller(z)
        S = 1 / (1 + C * G)
        return slopes(lambda x: response(x)(z), theta), G, C, S

    dG, G, _, S = parts(np.arange(1, 61) * np.pi / 60)
    F = dG * S[:, None]
    information = samples / variance * np.einsum("nk,nl->nkl", F, F.conj()).real
    price = np.abs(S) ** 2 * (1 + np.abs(G) ** 2)
    # The noise: e enters u by -C S. The mean over a fine grid is the integral, for the loop is well damped.
    grid = (np.arange(2**13) + 0.5) * np.pi / 2**13
    dG, _, C, S = parts(grid)
    E = dG * (C * S)[:, None]
    known = samples * np.einsum("nk,nl->kl", E, E.conj()).real / len(grid)
    return least_cost(information, price, known, np.array(most))


def test_the_golden_cost_of_the_integrating_tank_is_that_of_a_semidefinite_program():
    """k e^(-Ls) / s behind a hold: a ramp from L on, differenced."""
    h = 2.0

    def response(theta):
        k, L = theta
        d = int(np.floor(L / h))
        left = L - d * h
        return lambda z: k * z**-d * ((h - left) + left / z) / (z - 1)

    def controller(z):
        return 0.8 * (1 + h / (2 * 60) * (z + 1) / (z - 1))

    value = loop_design(response, [0.05, 5.0], [0.001, 0.3], controller, h, 600, 0.04)
    assert golden("integrating_tank")["cost"] == pytest.approx(value, rel=1e-6)


def test_the_golden_cost_of_the_motor_is_that_of_a_semidefinite_program():
    """b / (s (s + a)) behind a hold, with b and a of the motor at its known inertia."""
    h, J = 0.02, 0.02

    def response(theta):
        R, k = theta
        b, a = k / (R * J), (0.01 + k**2 / R) / J
        E = np.exp(-a * h)
        return lambda z: b / a * (h / (z - 1) - (1 - E) / a / (z - E))

    def controller(z):
        s = 2 / h * (z - 1) / (z + 1)
        return 4 * (1 + 0.05 * s / (0.02 * s + 1))

    value = loop_design(response, [1.5, 0.3], [0.01, 0.002], controller, h, 600, 1e-4)
    assert golden("motor_states")["cost"] == pytest.approx(value, rel=1e-6)


TANKS = {"g1": 0.70, "g2": 0.60, "k1": 3.33, "k2": 3.35, "a1": 0.071, "a2": 0.057, "a3": 0.071, "a4": 0.057}
LEVELS, AREAS = (12.4, 12.7, 1.8, 1.4), (28.0, 32.0, 28.0, 32.0)


def tanks(theta):
    """Gains (2, 2) and time constants of the entries by (7) of the paper."""
    g1, g2, k1, k2, *outlets = theta
    T = [A / a * np.sqrt(2 * h / 981) for A, a, h in zip(AREAS, outlets, LEVELS, strict=True)]
    c1, c2 = T[0] * 0.5 / AREAS[0], T[1] * 0.5 / AREAS[1]
    gains = [[g1 * k1 * c1, (1 - g2) * k2 * c1], [(1 - g1) * k1 * c2, g2 * k2 * c2]]
    return gains, [[(T[0],), (T[0], T[2])], [(T[1], T[3]), (T[1],)]]


def test_gains_and_time_constants_of_the_tanks_are_those_of_the_paper():
    """Table and (8) of the paper print c1 = 2.6, c2 = 2.8, T = 62, 90, 23, 30."""
    gains, times = tanks(list(TANKS.values()))
    np.testing.assert_allclose(gains, [[2.6, 1.5], [1.4, 2.8]], atol=0.06)
    alone = [times[0][0][0], times[1][1][0], times[0][1][1], times[1][0][1]]
    np.testing.assert_allclose(alone, [62, 90, 23, 30], atol=1)


def test_the_golden_cost_of_the_quadruple_tank_is_that_of_a_conic_program():
    """Hermitian powers of two inputs at every line; entries sampled by scipy."""
    w = np.arange(1, 61) * np.pi / 60

    def response(theta):
        gains, times = tanks(theta)
        G = np.zeros((60, 2, 2), dtype=complex)
        for i in (0, 1):
            for j in (0, 1):
                below = np.poly([-1 / t for t in times[i][j]])
                above = [gains[i][j] * below[-1]]
                top, bottom, _ = scipy.signal.cont2discrete((above, below), 5.0, "zoh")
                G[:, i, j] = np.polyval(top[0], np.exp(1j * w)) / np.polyval(bottom, np.exp(1j * w))
        return G

    theta = list(TANKS.values())
    most = np.array([0.01, 0.01, 0.05, 0.05, 0.002, 0.002, 0.002, 0.002])
    F = slopes(response, theta) * most[:, None, None]
    # tr(F_l Phi F_m^*) with Phi = [[a, c - jd], [c + jd, b]] is linear in a, b, c, d.
    basis = np.array([[[1, 0], [0, 0]], [[0, 0], [0, 1]], [[0, 1], [1, 0]], [[0, -1j], [1j, 0]]])
    maps = 720 / 0.01 * np.einsum("nlpa,xab,nmpb->xnlm", F, basis, F.conj()).real
    x, scale = cp.Variable((4, 60)), 0.3
    flat = scale * maps.transpose(2, 3, 0, 1).reshape(64, 240)
    M = cp.reshape(flat @ cp.vec(x, order="C"), (8, 8), order="C")
    a, b, c, d = x
    cones = [cp.SOC(a[n] + b[n], cp.hstack([a[n] - b[n], 2 * c[n], 2 * d[n]])) for n in range(60)]
    plain = cp.Problem(cp.Minimize(cp.sum(x[:2])), [*cones, *(cp.matrix_frac(e, M) <= 1 for e in np.eye(8))])
    plain.solve(solver="CLARABEL")
    assert golden("quadruple_tank")["cost"] == pytest.approx(scale * plain.value, rel=1e-6)


COLUMN = {
    (0, 0): (12.8, 16.7, 1.0),
    (0, 1): (-18.9, 21.0, 3.0),
    (1, 0): (6.6, 10.9, 7.0),
    (1, 1): (-19.4, 14.4, 3.0),
}


def held(theta, w, h):
    """Real and imaginary part of K e^(-Ls)/(T s + 1) behind a hold, analytic in K, T and L."""
    K, T, L = theta
    d = int(np.floor(np.real(L) / h))
    rest = h - (L - d * h)
    a, early = np.exp(-h / T), 1.0 - np.exp(-rest / T)
    b = {d + 1: K * early, d + 2: K * (1.0 - a - early)}
    above = [sum(c * f(lag * w) for lag, c in b.items()) for f in (np.cos, lambda x: -np.sin(x))]
    below = 1.0 - a * np.cos(w), a * np.sin(w)
    size = below[0] ** 2 + below[1] ** 2
    real = (above[0] * below[0] + above[1] * below[1]) / size
    return real, (above[1] * below[0] - above[0] * below[1]) / size


def gradient(theta, w, h):
    """dG / d(K, T, L) (n, 3), by complex steps."""
    columns = []
    for k in range(3):
        moved = np.array(theta, dtype=complex)
        moved[k] += 1e-30j
        real, imaginary = held(moved, w, h)
        columns.append((real.imag + 1j * imaginary.imag) / 1e-30)
    return np.stack(columns, axis=1)


@pytest.mark.slow
def test_deviations_of_the_column_under_white_noise_follow_sums_over_frequencies():
    """M over a fine grid of the circle; each entry has its own parameters, each output its own noise."""
    w = 2.0 * np.pi * (np.arange(2**14) + 0.5) / 2**14
    overrides = ["spectrum={given: {type: white, power: 1.0}}"]
    found = analyse(load_spec("specs/wood_berry.yaml", overrides)).result["information"]["standard_deviation"]
    for (i, j), theta in COLUMN.items():
        F = gradient(theta, w, 1.0)
        M = 500 / 0.01 * 0.5 * np.einsum("nk,nl->kl", F, F.conj()).real / w.size
        expected = np.sqrt(np.diag(np.linalg.inv(M)))
        names = [f"{name}[{i + 1},{j + 1}]" for name in ("gain", "time_constant", "dead_time")]
        np.testing.assert_allclose([found[name] for name in names], expected, rtol=1e-8)
