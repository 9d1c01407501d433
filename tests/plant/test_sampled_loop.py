"""Plants in s behind a hold in closed loop: against polynomials, simulated impulses, plain algebra."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import ContinuousModel, Loop, PolynomialModel, SampledModel, TransferMatrix
from inputdesign_cli.spectrum import FirBasis
from tests.support.loop_checks import check_information, check_signals
from tests.support.plants import arrays, descending

T = 0.4
LONG = 420
STEP = 1e-6
COVARIANCE = np.array([[1.0, 0.3], [0.3, 0.5]])

# First-order entries b / (s + a): each is a polynomial in q^-1 of one b and one f.
GAIN = np.array([[2.0, -0.5], [0.4, 1.2]])
DECAY = np.array([[1.0, 1.5], [0.8, 0.3]])
PI = [[[0.5, -0.4], [0.1]], [[0.0], [0.6, -0.5]]]
BELOW = [[[1, -1], [1, -1]], [[1], [1, -1]]]


def held_first_order():
    rows = [[[b] for b in row] for row in GAIN], [[[1.0, a] for a in row] for row in DECAY]
    plant = ContinuousModel.monic(descending(rows[0]), descending(rows[1]), COVARIANCE)
    return SampledModel(plant, T)


def polynomial_first_order():
    forgotten = np.exp(-DECAY * T)
    B = [[[0, b] for b in row] for row in GAIN / DECAY * (1 - forgotten)]
    F = [[[1, -f] for f in row] for row in forgotten]
    one = (np.ones(1),)
    return PolynomialModel(arrays(B), one, arrays(F), one, one, COVARIANCE)


def derivative():
    """d (b1, f1) / d (b, a) of all four entries, by hand: b1 = b (1 - E) / a, f1 = -E, E = exp(-a T)."""
    b, a = GAIN.ravel(), DECAY.ravel()
    E = np.exp(-a * T)
    J = np.zeros((8, 8))
    J[:4, :4] = np.diag((1 - E) / a)
    J[:4, 4:] = np.diag(b * (T * E * a - (1 - E)) / a**2)
    J[4:, 4:] = np.diag(T * E)
    return J


@pytest.fixture(scope="module")
def pair():
    """The same loop, by states and by polynomials."""
    C = TransferMatrix.build(PI, BELOW)
    loops = Loop(held_first_order(), C), Loop(polynomial_first_order(), C)
    for loop in loops:
        loop.check_stability()
    return [Experiment(loop.model, 9, loop=loop) for loop in loops]


def test_information_is_that_of_polynomials_by_the_chain_rule(pair):
    held, polynomial = pair
    J, basis = derivative(), FirBasis(2, 3)
    assert held.model.names[:2] == ("b0[1,1]", "b0[1,2]")
    assert polynomial.model.names[:2] == ("b1[1,1]", "b1[1,2]")
    maps = [basis.integrals(e.information_density, e.singularities) for e in pair]
    expected = J.T @ maps[1] @ J
    np.testing.assert_allclose(maps[0], expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    noise = J.T @ polynomial.noise_information @ J
    assert np.abs(noise).max() > 0.1  # the noise tells something around the loop
    np.testing.assert_allclose(held.noise_information, noise, rtol=1e-9, atol=1e-9 * np.abs(noise).max())


def test_loop_is_that_of_polynomials(pair):
    held, polynomial = pair
    basis, w = FirBasis(2, 2), np.array([0.0, 0.02, 1.0, np.pi])
    for kind in ("input", "output", "excitation"):
        for channel in (None, 1):
            powers = [
                basis.integrals(
                    lambda w, e=e, kind=kind, channel=channel: e.power_density(kind, w, channel),
                    e.singularities,
                )
                for e in pair
            ]
            np.testing.assert_allclose(powers[0], powers[1], rtol=1e-9, atol=1e-9)
    for one, other in zip(held.loop.sensitivity(w), polynomial.loop.sensitivity(w), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)
    rng = np.random.default_rng(0)
    r, e = rng.standard_normal((2, 3, 120, 2))
    for one, other in zip(held.loop.signals(r, e), polynomial.loop.signals(r, e), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-10)
    moduli = [np.sort(np.abs(experiment.loop.closed_poles)) for experiment in pair]
    np.testing.assert_allclose(moduli[0], moduli[1][-moduli[0].size :], atol=1e-8)
    np.testing.assert_allclose(moduli[1][: -moduli[0].size], 0.0, atol=1e-8)


# Second order, resonances, an entry that acts at once and one that is zero; three inputs and two outputs.
NUMERATOR = [[[3.0], [0.5, 1.0], [0.0]], [[0.4], [0.2, 0.6, 1.0], [1.0]]]
DENOMINATOR = [[[1, 0.8, 4], [1, 1.2], [1, 1]], [[1, 0.9], [1, 1.5, 2], [1, 1.1, 0.3]]]
CONTROLLER = [[[0.4, -0.32], [0.05]], [[0.0], [0, 0.1, 0.05]], [[0.1], [0.0]]]
UNDER = [[[1, -1], [1, -1]], [[1], [1, -0.3]], [[1, 0.2], [1]]]


def held_second_order(theta=None):
    plant = ContinuousModel.monic(descending(NUMERATOR), descending(DENOMINATOR), COVARIANCE)
    return SampledModel(plant if theta is None else plant.at(theta), T)


def sampled(model):
    """Entries (A, B, C, D) by scipy, one by one."""
    plant = model.continuous_plant
    found = {}
    for i, j in plant.active:
        system = plant.numerator[i][j][::-1], plant.denominator[i][j][::-1]
        found[i, j] = scipy.signal.cont2discrete(scipy.signal.tf2ss(*system), T, "zoh")[:4]
    return found


def caused(model, u):
    """G u (t, p) for samples u (t, r)."""
    y, plant = np.zeros((len(u), model.outputs)), model.continuous_plant
    for i, j in plant.active:
        system = plant.numerator[i][j][::-1], plant.denominator[i][j][::-1]
        top, bottom, _ = scipy.signal.cont2discrete(system, T, "zoh")
        y[:, i] += scipy.signal.lfilter(top[0], bottom, u[:, j])
    return y


def simulated(model, r, e):
    """y (t, p) and u (t, r), equation by equation; the controller has a delay where the plant has none."""
    entries = sampled(model)
    states = {place: np.zeros(len(system[0])) for place, system in entries.items()}
    y, u = np.zeros_like(e), np.zeros_like(r)
    k = np.zeros((len(r), 3, 2))
    for t in range(len(r)):
        for j in (1, 0, 2):  # u2 does not depend on y(t), which depends on u2(t)
            for i in range(2):
                top, bottom = CONTROLLER[j][i], UNDER[j][i]
                if j != 1:
                    y[t, i] = e[t, i] + sum(
                        (C @ states[i, m]).item() + D.item() * u[t, m]
                        for (row, m), (_, _, C, D) in entries.items()
                        if row == i
                    )
                k[t, j, i] = sum(c * y[t - lag, i] for lag, c in enumerate(top) if t >= lag)
                k[t, j, i] -= sum(c * k[t - lag, j, i] for lag, c in enumerate(bottom) if 0 < lag <= t)
            u[t, j] = r[t, j] - k[t, j].sum()
        for (i, j), (A, B, _, _) in entries.items():
            states[i, j] = A @ states[i, j] + B[:, 0] * u[t, j]
    return y, u


def impulse_gradients(model, source):
    """psi (t, k, p, m): the derivative of G(theta) u, for a unit impulse in each r (or e)."""
    theta, parts = model.theta, []
    for m in range(3 if source == "r" else 2):
        r, e = np.zeros((LONG, 3)), np.zeros((LONG, 2))
        (r if source == "r" else e)[0, m] = 1.0
        y, u = simulated(model, r, e)
        assert np.abs(y[-5:]).max() < 1e-8
        columns = []
        for index in range(theta.size):
            up, down = theta.copy(), theta.copy()
            up[index] += STEP
            down[index] -= STEP
            columns.append(
                (caused(held_second_order(up), u) - caused(held_second_order(down), u)) / (2 * STEP)
            )
        parts.append(np.stack(columns, axis=1))
    return np.stack(parts, axis=-1)


@pytest.fixture(scope="module")
def experiment():
    model = held_second_order()
    loop = Loop(model, TransferMatrix.build(CONTROLLER, UNDER))
    loop.check_stability()
    return Experiment(model, 7, loop=loop)


def test_information_is_that_of_simulated_impulses(experiment):
    check_information(experiment, *(impulse_gradients(experiment.model, source) for source in "re"))


def test_signals_are_those_of_the_equations_sample_by_sample(experiment):
    check_signals(experiment.loop, simulated)


def test_responses_are_those_of_matrix_algebra(experiment):
    w = np.array([0.3, 1.0, 2.5])
    model = experiment.model
    y_r, u_r = experiment.loop.excited(w)
    y_e, u_e = experiment.loop.disturbed(w)
    G, K = np.zeros((3, 2, 3), dtype=complex), experiment.loop.controller.at(w)
    for (i, j), (A, B, C, D) in sampled(model).items():
        for at, z in enumerate(np.exp(1j * w)):
            G[at, i, j] = (C @ np.linalg.solve(z * np.eye(len(A)) - A, B) + D).item()
    inner, outer = np.linalg.inv(np.eye(3) + K @ G), np.linalg.inv(np.eye(2) + G @ K)
    for found, expected in ((y_r, G @ inner), (u_r, inner), (y_e, outer), (u_e, -K @ outer)):
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)


def one(numerator, denominator, C, below=(1.0,), *, step=T):
    plant = ContinuousModel.monic(descending([[numerator]]), descending([[denominator]]), np.eye(1))
    return Loop(SampledModel(plant, step), TransferMatrix.build([[C]], [[list(below)]]))


def test_closed_poles_are_the_roots_of_the_characteristic_polynomial():
    numerator, denominator = [0.5, 3.0], [1, 1.4, 4.0, 1.0]
    loop = one(numerator, denominator, [0.2, -0.15], [1, -1])
    top, bottom, _ = scipy.signal.cont2discrete((numerator, denominator), T, "zoh")
    expected = np.roots(np.polyadd(np.polymul(bottom, [1, -1]), np.polymul(top[0], [0.2, -0.15])))
    np.testing.assert_allclose(np.sort_complex(loop.closed_poles), np.sort_complex(expected), atol=1e-9)


def test_a_delay_in_the_controller_counts():
    """1 / s-like growth: the gain that a delay still bears is smaller."""
    gain = 1.9 / (1 - np.exp(-T))
    one([1.0], [1, 1.0], [gain - 1.0]).check_stability()
    with pytest.raises(SpecError):
        one([1.0], [1, 1.0], [0, gain - 1.0]).check_stability()


@pytest.mark.parametrize("gain", [0.98, 1.02])
def test_stability_ends_at_the_largest_gain(gain):
    """1 / (s + 1) under u = -K y: z = E - K (1 - E) leaves the circle at K = (1 + E) / (1 - E)."""
    E = np.exp(-T)
    loop = one([1.0], [1, 1.0], [gain * (1 + E) / (1 - E)])
    assert np.abs(loop.closed_poles).max() == pytest.approx(gain * (1 + E) - E)
    if gain < 1:
        loop.check_stability()
        return
    with pytest.raises(SpecError) as caught:
        loop.check_stability()
    assert caught.value.diagnostics[0].code == "unstable-loop"


def test_an_algebraic_loop_is_refused():
    """(s + 3) / (s + 1) acts at once with gain 1, the controller with -1."""
    with pytest.raises(SpecError) as caught:
        one([1.0, 3.0], [1.0, 1.0], [-1.0, 0.5]).check_stability()
    assert caught.value.diagnostics[0].code == "algebraic-loop"


def test_an_input_that_answers_the_noise_at_once_is_refused_where_the_plant_has_no_delay(experiment):
    experiment.loop.check_delay()  # the one entry that acts at once is driven through a delay
    one([3.0], [1.0, 1.0], [0.5]).check_delay()
    one([1.0, 3.0], [1.0, 1.0], [0, 0.5]).check_delay()
    with pytest.raises(SpecError) as caught:
        one([1.0, 3.0], [1.0, 1.0], [0.5]).check_delay()
    assert caught.value.diagnostics[0].code == "algebraic-loop"


def test_fast_sampling_keeps_the_slow_poles():
    """Static feedback so fast that the loop is that of continuous time, to first order in the step."""
    denominator, gain, step = np.poly([-1.0, -1.2, -1.4, -0.8]), 0.5, 1e-4
    loop = one([1.0], denominator, [gain], step=step)
    slow = np.roots(np.polyadd(denominator, [gain]))
    found = np.log(loop.closed_poles[np.abs(loop.closed_poles) > 0.5]) / step
    for pole in slow:
        assert np.abs(found - pole).min() < 1e-3
