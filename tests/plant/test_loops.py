"""The loop around polynomial plants and plants in s behind a hold: simulated impulses and plain algebra."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import ContinuousModel, Loop, PolynomialModel, SampledModel, TransferMatrix
from inputdesign_cli.spectrum import FirBasis
from tests.support.loop_checks import check_information, check_signals
from tests.support.plants import arrays, descending, known, lag_of
from tests.support.refusals import refused

T = 0.4
LONG = 360
STEP = 1e-6
COVARIANCE = np.array([[1.0, 0.3], [0.3, 0.5]])


def box_jenkins():
    """Every polynomial, the first A unstable, three inputs and two outputs, one entry zero."""
    return PolynomialModel(
        arrays([[[0, 1.0, 0.4], [0, -0.3], [0]], [[0, 0.2], [0, 0.8, -0.1], [0, 0, 0.5]]]),
        (np.array([1.0, -1.1]), np.array([1.0, 0.3])),
        arrays([[[1, -0.2], [1], [1]], [[1], [1, 0.4], [1, -0.5]]]),
        (np.array([1.0, 0.3]), np.array([1.0, -0.4])),
        (np.array([1.0, -0.5]),),
        COVARIANCE,
    )


def single():
    """Every polynomial but F, one input and one output."""
    return PolynomialModel.single([0, 0.3, 0.2], A=[1, -1.2, 0.5], C=[1, -0.4], D=[1, 0.3], variance=0.7)


def held():
    """Second order behind a hold: resonances, an entry with direct feedthrough and one that is zero."""
    numerator = [[[3.0], [0.5, 1.0], [0.0]], [[0.4], [0.2, 0.6, 1.0], [1.0]]]
    denominator = [[[1, 0.8, 4], [1, 1.2], [1, 1]], [[1, 0.9], [1, 1.5, 2], [1, 1.1, 0.3]]]
    plant = ContinuousModel.monic(descending(numerator), descending(denominator), COVARIANCE)
    return SampledModel(plant, T)


def tank():
    """An integrator whose pole is known, behind a hold."""
    return known(SampledModel(lag_of([0.4], [1, 0]), T), "a0")


def sampled_tank():
    """The tank as a polynomial model."""
    return known(PolynomialModel.single([0, 0.4 * T], F=[1, -1]), "f1")


# The controllers: entries (input, output); that of `held` has a delay where the plant has none.
BELOW = [[[1, -1], [1, -1]], [[1], [1, -0.3]], [[1, 0.2], [1]]]
CONTROLLERS = {
    box_jenkins: ([[[0.4, -0.32], [0.05]], [[0.0], [0.1, 0.05]], [[0.1], [0.0]]], BELOW),
    single: ([[[1.1, -0.7]]], [[[1, -1]]]),
    held: ([[[0.4, -0.32], [0.05]], [[0.0], [0, 0.1, 0.05]], [[0.1], [0.0]]], BELOW),
    tank: ([[[1.2, -1.0]]], [[[1, -1]]]),
    sampled_tank: ([[[0.9]]], [[[1]]]),
}


def textbook(model):
    """A, the fractions (b, a) of the entries, C and D in A y = (b / a) u + (C / D) e."""
    model = getattr(model, "coefficients", model)
    if isinstance(model, PolynomialModel):
        A, C, D = (model.per_output(rows) for rows in (model.A, model.C, model.D))
        entries = [list(zip(*rows, strict=True)) for rows in zip(model.B, model.F, strict=True)]
        return A, entries, C, D
    plant, one = model.continuous_plant, [[1.0]] * model.outputs
    entries = [[([0.0], [1.0])] * model.inputs for _ in range(model.outputs)]
    for i, j in plant.active:
        entry = plant.numerator[i][j][::-1], plant.denominator[i][j][::-1]
        top, bottom, _ = scipy.signal.cont2discrete(entry, T, "zoh")
        entries[i][j] = top[0], bottom
    return one, entries, one, one


def latest(b, a, u, x, t):
    """x(t) of a x = b u, from u and earlier x."""
    driven = sum(c * u[t - lag] for lag, c in enumerate(b) if t >= lag)
    return driven - sum(c * x[t - lag] for lag, c in enumerate(a) if 0 < lag <= t)


def simulation(controller):
    """The loop, equation by equation, sample by sample: y (t, p) and u (t, r) of a model, r and e."""
    above, below = controller

    def simulated(model, r, e):
        A, entries, C, D = textbook(model)
        y, u, shape = np.zeros_like(e), np.zeros_like(r), (model.outputs, model.inputs)
        v = np.stack([scipy.signal.lfilter(C[i], D[i], e[:, i]) for i in range(model.outputs)], axis=1)
        x, k = np.zeros((len(r), *shape)), np.zeros((len(r), *shape))
        for t in range(len(r)):
            for _ in range(2):  # twice, for direct feedthrough
                for i, j in np.ndindex(shape):
                    x[t, i, j] = latest(*entries[i][j], u[:, j], x[:, i, j], t)
                for i in range(model.outputs):
                    y[t, i] = v[t, i] + latest([1.0], A[i], x[:, i].sum(axis=1), y[:, i], t)
                for i, j in np.ndindex(shape):
                    k[t, i, j] = latest(above[j][i], below[j][i], y[:, i], k[:, i, j], t)
                u[t] = r[t] - k[t].sum(axis=0)
        return y, u

    return simulated


def errors(model, y, u):
    """epsilon (t, p) of the one-step predictor, polynomial by polynomial."""
    A, entries, C, D = textbook(model)
    out = np.zeros_like(y)
    for i in range(model.outputs):
        rest = scipy.signal.lfilter(A[i], [1.0], y[:, i])
        for j in range(model.inputs):
            rest = rest - scipy.signal.lfilter(*entries[i][j], u[:, j])
        out[:, i] = scipy.signal.lfilter(D[i], C[i], rest)
    return out


def impulse_gradients(model, simulated, source):
    """psi (t, k, p, m): minus the derivative of epsilon, for a unit impulse in each r (or e)."""
    theta, parts = model.theta, []
    for m in range(model.inputs if source == "r" else model.outputs):
        r, e = np.zeros((LONG, model.inputs)), np.zeros((LONG, model.outputs))
        (r if source == "r" else e)[0, m] = 1.0
        y, u = simulated(model, r, e)
        assert np.abs(y[-5:]).max() < 1e-9
        columns = [
            (errors(model.at(theta - step), y, u) - errors(model.at(theta + step), y, u)) / (2 * STEP)
            for step in STEP * np.eye(theta.size)
        ]
        parts.append(np.stack(columns, axis=1))
    return np.stack(parts, axis=-1)


@pytest.fixture(scope="module", params=CONTROLLERS)
def case(request):
    """An experiment in the loop, and the simulation of it."""
    model, controller = request.param(), CONTROLLERS[request.param]
    loop = Loop(model, TransferMatrix.build(*controller))
    loop.check_stability()
    return Experiment(model, 7, loop=loop), simulation(controller)


def test_information_agrees_with_simulated_impulse_responses(case):
    experiment, simulated = case
    check_information(experiment, *(impulse_gradients(experiment.model, simulated, s) for s in "re"))


def test_powers_agree_with_simulated_impulse_responses(case):
    experiment, simulated = case
    inputs, outputs = experiment.model.inputs, experiment.model.outputs
    c = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.2], [0.0, -0.2, 0.5]])[:inputs, :inputs]
    basis = FirBasis(inputs, 0)
    x = np.array([2.0, 0.3, 1.0, 0.0, -0.2, 0.5])[: basis.size]
    np.testing.assert_array_equal(basis.autocovariances(x)[0], c)
    first, silent = (np.arange(LONG) == 0)[:, None], np.zeros((LONG, outputs))
    runs = [simulated(experiment.model, unit * first, silent) for unit in np.eye(inputs)]
    y, u = (np.stack([run[part] for run in runs], axis=-1) for part in (0, 1))
    for kind, response in (("output", y), ("input", u)):
        for channel in (None, min(inputs, outputs) - 1):
            rows = response if channel is None else response[:, channel : channel + 1]
            expected = np.einsum("tpm,mn,tpn->", rows, c, rows)
            unit = basis.integrals(
                lambda w, kind=kind, channel=channel: experiment.power_density(kind, w, channel),
                experiment.singularities,
            )
            assert unit @ x == pytest.approx(expected, rel=1e-8)


def test_signals_agree_with_the_equations_sample_by_sample(case):
    check_signals(case[0].loop, case[1])


def test_the_deviation_of_noise_at_the_inputs_agrees_with_impulse_responses(case):
    experiment, simulated = case
    model, inputs = experiment.model, experiment.model.inputs
    first = (np.arange(LONG) == 0)[:, None]
    root = np.linalg.cholesky(model.covariance)
    runs = [simulated(model, np.zeros((LONG, inputs)), root[:, i] * first) for i in range(len(root))]
    expected = np.sqrt(sum(np.sum(u**2, axis=0) for _, u in runs))
    found = experiment.loop.input_deviation(experiment.noise_colouring, LONG)
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_closed_loop_responses_agree_with_matrix_algebra(case):
    w, (experiment, _) = np.array([0.3, 1.0, 2.5]), case
    y_r, u_r = experiment.loop.excited(w)
    y_e, u_e = experiment.loop.disturbed(w)
    A, entries, C, D = textbook(experiment.model)
    G = [[scipy.signal.freqz(b, np.convolve(a, A[i]), w)[1] for b, a in row] for i, row in enumerate(entries)]
    G, K = np.moveaxis(np.array(G), 2, 0), experiment.loop.controller.at(w)
    H = [scipy.signal.freqz(c, np.convolve(a, d), w)[1] for a, c, d in zip(A, C, D, strict=True)]
    H = np.array(H).T[:, :, None] * np.eye(len(H))
    inputs, outputs = np.eye(G.shape[2]), np.eye(G.shape[1])
    inner, outer = np.linalg.inv(inputs + K @ G), np.linalg.inv(outputs + G @ K)
    S, CS = experiment.loop.sensitivity(w)
    for found, expected in (
        *((y_r, G @ inner), (u_r, inner), (y_e, outer @ H), (u_e, -K @ outer @ H)),
        *((S, outer), (CS, K @ outer)),
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)


def looped(model, numerator, below=(1.0,)):
    return Loop(model, TransferMatrix.build([[numerator]], [[list(below)]]))


def one(numerator, denominator, C, below=(1.0,), *, step=T):
    return looped(SampledModel(lag_of(numerator, denominator), step), C, below)


def test_closed_poles_are_the_roots_of_the_characteristic_polynomial():
    numerator, denominator = [0.5, 3.0], [1, 1.4, 4.0, 1.0]
    top, bottom, _ = scipy.signal.cont2discrete((numerator, denominator), T, "zoh")
    for loop, above, below, C in (
        (looped(single(), [1.1, -0.7], [1, -1]), [0.3, 0.2], [1, -1.2, 0.5], [1.1, -0.7]),
        (one(numerator, denominator, [0.2, -0.15], [1, -1]), top[0], bottom, [0.2, -0.15]),
    ):
        expected = np.roots(np.polyadd(np.polymul(below, [1, -1]), np.polymul(above, C)))
        poles = np.sort_complex(loop.closed_poles[np.abs(loop.closed_poles) > 1e-6])
        np.testing.assert_allclose(poles, np.sort_complex(expected), atol=1e-9)


@pytest.mark.parametrize("plant", [PolynomialModel.single([0.0, 1.0], A=[1.0, -1.0]), tank(), sampled_tank()])
def test_integrating_plant_in_a_stable_loop_has_finite_gradients(plant):
    """S G and the gradients stay finite at DC."""
    loop = looped(plant, [0.5])
    loop.check_stability()
    y, u = loop.excited(np.array([0.0]))
    assert y.item() == pytest.approx(2.0, rel=1e-4)  # 1 / C at DC
    assert abs(u.item()) == pytest.approx(0.0, abs=1e-4)
    for found in loop.sensitivity(np.zeros(1)):  # S and C S, where G is infinite
        assert abs(found.item()) == pytest.approx(0.0, abs=1e-4)
    assert np.all(np.isfinite(loop.excitation_gradient(np.array([0.0]))))


ALONE = Loop(box_jenkins(), TransferMatrix.build([[[0.0]] * 2] * 3, [[[1.0]] * 2] * 3))
DIRECT = PolynomialModel.single([1.0, 0.5])
STABLE_GAIN = 1.9 / (1 - np.exp(-T)) - 1.0  # stable around 1 / (s + 1) without a delay in the controller


@pytest.mark.parametrize(
    ("check", "loop", "code"),
    [
        ("stability", ALONE, "unstable"),
        ("stability", looped(PolynomialModel.single([0.0, 1.0], A=[1.0, -0.9]), [-0.5]), "unstable"),
        ("stability", looped(DIRECT, [-1.0]), "algebraic"),
        ("stability", one([1.0], [1, 1.0], [STABLE_GAIN]), None),
        ("stability", one([1.0], [1, 1.0], [0, STABLE_GAIN]), "unstable"),
        # (s + 3) / (s + 1) acts at once with gain 1, the controller with -1.
        ("stability", one([1.0, 3.0], [1.0, 1.0], [-1.0, 0.5]), "algebraic"),
        ("delay", looped(DIRECT, [0.3]), "algebraic"),
        ("delay", looped(DIRECT, [0.0, 0.3]), None),
        ("delay", looped(PolynomialModel.single([0.0, 1.0]), [0.3]), None),
        ("delay", one([1.0, 3.0], [1.0, 1.0], [0.5]), "algebraic"),
        ("delay", one([1.0, 3.0], [1.0, 1.0], [0, 0.5]), None),
        ("delay", one([3.0], [1.0, 1.0], [0.5]), None),
        # The one entry that acts at once is driven through a delay.
        ("delay", Loop(held(), TransferMatrix.build(*CONTROLLERS[held])), None),
    ],
)
def test_unstable_and_algebraic_loops_are_refused(check, loop, code):
    checked = {"stability": loop.check_stability, "delay": loop.check_delay}[check]
    if code is None:
        checked()
        return
    assert refused(checked)[0].code == f"{code}-loop"


@pytest.mark.parametrize("gain", [0.98, 1.02])
def test_a_loop_is_stable_up_to_its_largest_gain(gain):
    """1 / (s + 1) under u = -K y: z = E - K (1 - E) leaves the circle at K = (1 + E) / (1 - E)."""
    E = np.exp(-T)
    loop = one([1.0], [1, 1.0], [gain * (1 + E) / (1 - E)])
    assert np.abs(loop.closed_poles).max() == pytest.approx(gain * (1 + E) - E)
    if gain < 1:
        loop.check_stability()
        return
    assert refused(loop.check_stability)[0].code == "unstable-loop"


def test_fast_sampling_keeps_the_slow_poles():
    """Static feedback so fast that the loop is that of continuous time, to first order in the step."""
    denominator, gain, step = np.poly([-1.0, -1.2, -1.4, -0.8]), 0.5, 1e-4
    loop = one([1.0], denominator, [gain], step=step)
    slow = np.roots(np.polyadd(denominator, [gain]))
    found = np.log(loop.closed_poles[np.abs(loop.closed_poles) > 0.5]) / step
    for pole in slow:
        assert np.abs(found - pole).min() < 1e-3
