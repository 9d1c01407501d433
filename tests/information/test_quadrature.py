"""Integrals against Lyapunov equations and closed forms."""

import numpy as np
import pytest
import scipy.linalg

from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.information import integrate
from inputdesign_cli.plant import Rational, logarithmic_distance
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


def plain_sum(rule, values):
    return np.array([rule.weights @ values])


@pytest.mark.parametrize("radius", [0.5, 0.9, 0.99, 0.999])
def test_integrals_equal_lyapunov_to_1e_10(radius):
    denominator = np.real(np.poly([radius * np.exp(0.7j), radius * np.exp(-0.7j), 0.3]))
    numerator = [0.0, 1.0, -0.4]
    g = Rational.build(numerator, list(denominator))

    found = integrate(lambda w: np.abs(g.at(w)) ** 2, plain_sum, logarithmic_distance(g.poles))[0]
    assert found == pytest.approx(h2_squared(numerator, denominator), rel=1e-10)


@pytest.mark.parametrize("lag", [0, 1, 17, 300])
def test_moments_of_a_first_order_spectrum(lag):
    """1 / |1 - a e^{jw}|^2 has the autocovariances a^lag / (1 - a^2)."""
    a = 0.999

    def density(w):
        return 1 / np.abs(1 - a * np.exp(-1j * w)) ** 2

    values = FirBasis(1, 300).integrals(density, logarithmic_distance([a]))
    assert values[lag] == pytest.approx((1 if lag == 0 else 2) * a**lag / (1 - a * a), rel=1e-10)


@pytest.mark.parametrize("several", [False, True])
def test_however_many_nodes_are_taken_at_once_the_integral_is_the_same(several):
    """1 / |1 - a e^{jw}|^2 has the mean 1 / (1 - a^2)."""
    a = 0.95

    def density(w):
        assert 1 <= w.size <= (256 if several else 2048)
        return 1 / np.abs(1 - a * np.exp(-1j * w)) ** 2

    found = integrate(density, plain_sum, logarithmic_distance([a]), several=several)
    assert found[0] == pytest.approx(1 / (1 - a * a), rel=1e-12)


def test_pole_on_the_circle_is_refused():
    def density(w):
        return 1 / np.abs(1 - np.exp(-1j * w)) ** 2

    with pytest.raises(InaccurateError) as error:
        integrate(density, plain_sum, logarithmic_distance([1.0]))
    assert error.value.diagnostics[0].code == "integral-inaccurate"
