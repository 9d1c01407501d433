"""Integrals against Lyapunov equations and closed forms, information against textbook formulas."""

import numpy as np
import pytest
import scipy.linalg
from plants import random_case

from inputdesign_cli.errors import InaccurateError, SpecError
from inputdesign_cli.information import Experiment, integrate
from inputdesign_cli.plant import Loop, PolynomialModel, Rational, logarithmic_distance
from inputdesign_cli.spectrum import FirBasis


def h2_squared(numerator, denominator):
    """Squared H2 norm of a strictly proper or proper rational in q^-1 by a Lyapunov equation."""
    n = max(len(numerator), len(denominator)) - 1
    b, a = np.zeros(n + 1), np.zeros(n + 1)
    b[: len(numerator)], a[: len(denominator)] = numerator, denominator
    A = np.zeros((n, n))
    A[0], A[1:, :-1] = -a[1:], np.eye(n - 1)
    B = np.eye(n, 1)
    C, D = b[1:] - b[0] * a[1:], b[0]
    X = scipy.linalg.solve_discrete_lyapunov(A, B @ B.T)
    return float(C @ X @ C + D * D)


@pytest.mark.parametrize("radius", [0.5, 0.9, 0.99, 0.999])
def test_integrals_equal_lyapunov_to_1e_10(radius):
    denominator = np.real(np.poly([radius * np.exp(0.7j), radius * np.exp(-0.7j), 0.3]))
    numerator = [0.0, 1.0, -0.4]
    g = Rational.build(numerator, list(denominator))

    def moments(rule):
        return np.array([rule.weights @ np.abs(g.at(rule.nodes)) ** 2])

    found = integrate(moments, logarithmic_distance(g.poles))[0]
    assert found == pytest.approx(h2_squared(numerator, denominator), rel=1e-10)


@pytest.mark.parametrize("lag", [0, 1, 17, 300])
def test_moments_of_a_first_order_spectrum(lag):
    """1 / |1 - a e^{jw}|^2 has the autocovariances a^lag / (1 - a^2)."""
    a = 0.999

    def density(w):
        return 1 / np.abs(1 - a * np.exp(-1j * w)) ** 2

    values = FirBasis(300).integrals(density, logarithmic_distance([a]))
    assert values[lag] == pytest.approx((1 if lag == 0 else 2) * a**lag / (1 - a * a), rel=1e-10)


def test_pole_on_the_circle_is_refused():
    def moments(rule):
        return np.array([rule.weights @ (1 / np.abs(1 - np.exp(-1j * rule.nodes)) ** 2)])

    with pytest.raises(InaccurateError) as error:
        integrate(moments, logarithmic_distance([1.0]))
    assert error.value.diagnostics[0].code == "integral-inaccurate"


def test_noise_only_information_of_an_autoregression():
    """AR(1) without input: M = N / (1 - a^2), whatever the variance."""
    model = PolynomialModel.single(A=np.array([1.0, -0.8]), B=np.array([0.0, 1.0]), variance=3.0)
    M0 = Experiment(Loop(model), 200).baseline_information
    np.testing.assert_allclose(M0, [[200 / (1 - 0.64), 0], [0, 0]], rtol=1e-11, atol=1e-8)


def test_information_of_an_arx_model_with_white_input():
    """y + a y(t-1) = b u(t-1) + e: E y^2 = (b^2 P + sigma^2) / (1 - a^2), E y u(t-.) at lag one of phi: 0."""
    a, b, variance, power, N = -0.7, 2.0, 0.5, 1.3, 100
    model = PolynomialModel.single(A=np.array([1.0, a]), B=np.array([0.0, b]), variance=variance)
    experiment = Experiment(Loop(model), N)
    basis = FirBasis(0)
    M = (
        experiment.baseline_information
        + power * basis.integrals(experiment.information_density, experiment.singularities)[0]
    )
    y_power = (b * b * power + variance) / (1 - a * a)
    np.testing.assert_allclose(M, N / variance * np.diag([y_power, power]), rtol=1e-10, atol=1e-8)


def test_loop_norms_of_the_flexible_transmission(flexible):
    """||S||^2 and ||G S||^2 (H2), recomputed independently in docs/errata.md."""
    basis = FirBasis(0)
    for kind, expected in (("input", 1.0606348409), ("output", 1.8022202466)):
        value = basis.integrals(lambda w, k=kind: flexible.power_density(k, w), flexible.singularities)[0]
        assert value == pytest.approx(expected, abs=6e-11)


@pytest.mark.parametrize("seed", [1, 8, 9, 15])
def test_whitened_coordinates(seed):
    """White excitation gives the identity, and the way back to raw parameters gives the raw matrix."""
    case = random_case(seed)
    raw = Experiment(case.loop, case.samples)
    white = raw.whitened(2.5)
    basis = FirBasis(0)

    def information(experiment):
        gain = basis.integrals(experiment.information_density, experiment.singularities)[0]
        return experiment.baseline_information + 2.5 * gain

    M = information(white)
    np.testing.assert_allclose(M, np.eye(white.size), atol=1e-9)
    direct = information(raw)
    np.testing.assert_allclose(white.to_raw(M), direct, atol=1e-10 * np.abs(direct).max())
    P = white.raw_covariance(M)
    np.testing.assert_allclose(P @ direct, np.eye(white.size), atol=1e-5)


def test_prior_information_adds():
    model = PolynomialModel.single(B=np.array([0.0, 1.0, 0.5]))
    prior = np.array([[4.0, 1.0], [1.0, 3.0]])
    with_prior = Experiment(Loop(model), 10, prior)
    np.testing.assert_allclose(with_prior.baseline_information, prior)
    white = with_prior.whitened(1.0)
    np.testing.assert_allclose(white.to_raw(white.baseline_information), prior, rtol=1e-12)


def test_parameters_that_cannot_be_told_apart_are_named():
    """A common factor of B and F."""
    model = PolynomialModel.single(B=np.convolve([0.0, 1.0], [1, -0.5]), F=np.convolve([1, -0.5], [1, 0.3]))
    with pytest.raises(SpecError) as error:
        Experiment(Loop(model), 100).whitened(1.0)
    diagnostic = error.value.diagnostics[0]
    assert diagnostic.code == "not-identifiable"
    assert "b2, f1, f2" in diagnostic.message  # moving the common root changes just these
