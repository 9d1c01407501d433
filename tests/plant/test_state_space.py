"""State-space models: against transfer functions, plain recursions, and differences in every entry."""

import numpy as np
import pytest
import scipy.linalg
import scipy.signal

from inputdesign_cli.expressions import Expression
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.plant import (
    Matrices,
    Parametrisation,
    Reparametrised,
    SampledModel,
    StateSpaceModel,
    TransferMatrix,
    close_loop,
    input_gradients,
    noise_gradients,
)
from inputdesign_cli.spectrum import FirBasis
from tests.support.loop_checks import check_information, check_signals
from tests.support.plants import lag_of
from tests.support.records import check_estimate, check_record

H = 0.3
W = np.linspace(0.05, 3.1, 25)
A = np.array([[-0.8, 0.5], [-0.3, -1.1]])
B, C = np.array([[0.4, 0.0], [1.0, 0.7]]), np.array([[1.0, 0.2], [0.0, 0.8]])
D = np.array([[0.0, 0.3], [0.0, 0.0]])
K = np.array([[0.5, 0.1], [-0.2, 0.3]])
COVARIANCE = np.array([[1.0, 0.3], [0.3, 0.5]])
PLACES = [(letter, i, j) for letter in "ABCDK" for i in (0, 1) for j in (0, 1)]
CONTROLLER = TransferMatrix.build(
    [[[0, 0.9, -0.8], [0]], [[0], [0, 0.2, 0.1]]], [[[1, -1], [1]], [[1], [1, -0.5]]]
)


def model(*, delay=0.4, sample_time=H, gain=K, direct=D, places=(*PLACES, ("delay", 0, 0))):
    matrices = Matrices(A, B, C, direct, gain, delay)
    return StateSpaceModel(matrices, tuple(places), COVARIANCE, sample_time)


def through_states(A, B, C, z):
    """C (z I - A)^-1 B, as its real and its imaginary part, each analytic in A, B (a pair of parts) and C."""
    shifted, turn = z.real * np.eye(len(A)) - A, z.imag * np.eye(len(A))
    x = np.linalg.solve(np.block([[shifted, -turn], [turn, shifted]]), np.concatenate(B))
    return C @ x[: len(A)], C @ x[len(A) :]


def parts(matrix, factor):
    return matrix * factor.real, matrix * factor.imag


def analytic(m, delay, z, sample_time):
    """G and C (z I - A)^-1 K by an exponential of the states and the input, analytic in every entry."""
    n, inputs = m["B"].shape
    lag, direct, Ad, held = 0, 0, m["A"], parts(m["B"], np.complex128(1))
    if sample_time is not None:
        lag = int(delay.real // sample_time)
        left = delay - lag * sample_time
        direct = lag + (left.real > 0)
        system = np.zeros((n + inputs, n + inputs), dtype=complex)
        system[:n] = np.concatenate([m["A"], m["B"]], axis=1)
        whole, early = (scipy.linalg.expm(system * t)[:n] for t in (sample_time, sample_time - left))
        Ad, early, late = whole[:, :n], early[:, n:], whole[:, n:] - early[:, n:]
        pairs = (parts(early, z**-lag), parts(late, z ** -(lag + 1)))
        held = tuple(a + b for a, b in zip(*pairs, strict=True))
    G = through_states(Ad, held, m["C"], z)
    G = [a + b for a, b in zip(G, parts(m["D"], z ** -float(direct)), strict=True)]
    return G, through_states(Ad, (m["K"], 0 * m["K"]), m["C"], z)


@pytest.mark.parametrize("sample_time", [H, None], ids=["held", "discrete"])
def test_responses_and_gradients_agree_with_complex_steps(sample_time):
    """Responses, and their slopes in every entry and the dead time by steps along the imaginary axis.

    The direct term is delayed by whole samples; its dependence on the dead time is not counted.
    """
    places = (*PLACES, *([("delay", 0, 0)] if sample_time else []))
    found = model(sample_time=sample_time, delay=0.4 if sample_time else 0.0, places=places)
    found = found if sample_time else found.at(0.3 * found.theta)
    w, step = W[::6], 1e-30
    exact, response = (found.plant_gradient(w), noise_gradients([found], w)[0]), found.plant_at(w)
    by_input = input_gradients([found], w)[0]
    for index, (letter, i, j) in enumerate(places):
        moved = {k: v.astype(complex) for k, v in zip("ABCDK", found.matrices[:5], strict=True)}
        delay = complex(found.matrices.delay)
        if letter == "delay":
            delay += 1j * step
        else:
            moved[letter][i, j] += 1j * step
        for n, z in enumerate(np.exp(1j * w)):
            ways = analytic(moved, delay, z, sample_time)
            expected, in_noise = (x[0].imag / step + 1j * x[1].imag / step for x in ways)
            G, noise = (x[0].real + 1j * x[1].real for x in ways)
            at_rest = np.eye(2) + noise
            np.testing.assert_allclose(response[n], G, rtol=1e-7, atol=1e-7)
            np.testing.assert_allclose(by_input[n, index], np.linalg.solve(at_rest, expected), atol=5e-7)
            np.testing.assert_allclose(exact[0][n, index], expected, rtol=1e-8, atol=1e-11)
            np.testing.assert_allclose(
                exact[1][n, index], np.linalg.solve(at_rest, in_noise), rtol=1e-8, atol=1e-11
            )


def past(signal, t, lag):
    return signal[t - lag] if t >= lag else np.zeros(2)


def simulated(found, r, e):
    """y and u, sample by sample, from the equations; C of the loop has a delay."""
    Ad, early, late = found.held
    m, x = found.matrices, np.zeros(2)
    y, u, c = np.zeros_like(e), np.zeros_like(r), np.zeros((len(r), 2))
    for t in range(len(r)):
        c[t, 0] = past(c, t, 1)[0] + 0.9 * past(y, t, 1)[0] - 0.8 * past(y, t, 2)[0]
        c[t, 1] = 0.5 * past(c, t, 1)[1] + 0.2 * past(y, t, 1)[1] + 0.1 * past(y, t, 2)[1]
        u[t] = r[t] - c[t]
        y[t] = m.C @ x + m.D @ past(u, t, found.direct_lag) + e[t]
        x = Ad @ x + early @ past(u, t, found.lag) + late @ past(u, t, found.lag + 1) + m.K @ e[t]
    return y, u


def predicted(models, y, u):
    """(t, m, p): the one-step predictions of models with the same lags, sample by sample."""
    Ad, early, late = (np.stack(parts) for parts in zip(*(one.held for one in models), strict=True))
    C, D, K = (np.stack([getattr(one.matrices, letter) for one in models]) for letter in "CDK")
    lag, direct_lag = models[0].lag, models[0].direct_lag
    x, out = np.zeros((len(models), 2)), np.zeros((len(y), len(models), 2))
    for t in range(len(y)):
        out[t] = np.einsum("mij,mj->mi", C, x) + D @ past(u, t, direct_lag)
        held = early @ past(u, t, lag) + late @ past(u, t, lag + 1)
        x = np.einsum("mij,mj->mi", Ad, x) + held + np.einsum("mij,mj->mi", K, y[t] - out[t])
    return out


@pytest.mark.parametrize("unstable", [False, True])
def test_the_loop_agrees_with_the_state_space_equations(unstable):
    """Information by impulses and differences of the predictor; with an unstable plant, too."""
    found = model()
    if unstable:
        matrices = found.matrices._replace(A=A + np.array([[0.96, 0], [0, 0]]))
        found = StateSpaceModel(matrices, found.entries, COVARIANCE, H)
        assert np.abs(found.poles).max() > 1.0
    loop = close_loop(found, CONTROLLER)
    loop.check_stability()
    check_signals(loop, simulated)
    parts, steps = [], 1e-6 * np.eye(found.theta.size)
    moved = [found.at(found.theta + sign * step) for sign in (1, -1) for step in steps]
    for source in "re":
        columns = []
        for k in (0, 1):
            r, e = np.zeros((2, 700, 2))
            (r if source == "r" else e)[0, k] = 1.0
            y, u = simulated(found, r, e)
            assert np.abs(y[-5:]).max() < 1e-7
            up, down = np.split(predicted(moved, y, u), 2, axis=1)
            columns.append((up - down) / 2e-6)
        parts.append(np.stack(columns, axis=-1))
    check_information(Experiment(found, 7, loop=loop), *parts)


def test_the_gradient_of_a_record_agrees_with_differences_of_prediction_errors():
    """At the true parameters the prediction errors are the noise; psi is also computed by frequency."""
    found, rng = model(), np.random.default_rng(0)
    check_record(found, 150)
    u, e = rng.standard_normal((2, 150, 2))
    kind = estimator(found, 1.0)
    calm = found.simulate(u, 0 * e, 1.0)[0]
    whitener = np.linalg.inv(np.linalg.cholesky(COVARIANCE))
    by_frequency = FiniteRecord(Experiment(found, 150), 150).gradient(u)
    in_time = np.moveaxis(kind.errors_and_gradient(found.theta, u, calm)[1], 0, 1) @ whitener.T
    np.testing.assert_allclose(by_frequency, in_time, atol=1e-8)


MOTOR = {"J": 0.02, "R": 1.5, "K": 0.3}


def motor(known=()):
    """Position and speed of a motor: theta' = w, w' = (K u - (b + K^2 / R) w R / R) / J."""
    terms = [("A", 1, 1, "-(0.01 + K**2/R)/J"), ("B", 1, 0, "K/(R*J)")]
    start = np.array([[0, 1], [0, -1.0]]), np.array([[0], [1.0]]), np.array([[1, 0]])
    matrices = Matrices(*start, np.zeros((1, 1)), np.zeros((2, 1)), 0.0)
    plain = StateSpaceModel(matrices, tuple(t[:3] for t in terms), 1e-4 * np.eye(1), 0.05)
    free = np.array([name not in known for name in MOTOR])
    names, values = tuple(MOTOR), np.array(list(MOTOR.values()))
    expressions = tuple(Expression(t[3]) for t in terms)
    return Reparametrised(plain, Parametrisation(names, names, values, free, expressions)).at(values[free])


def test_a_motor_in_states_has_the_information_of_its_transfer_function():
    """The position by states and by k / (s (s + a)) gives the same information on J and K in a loop."""
    states = motor(known=("R",))
    b, a = 0.3 / (1.5 * 0.02), (0.01 + 0.3**2 / 1.5) / 0.02
    plant = lag_of([b], [1, a, 0], variance=1e-4)
    terms = (Expression("K/(1.5*J)"), Expression("0*J"), Expression("(0.01 + K**2/1.5)/J"))
    transfer = Reparametrised(
        SampledModel(plant, 0.05),
        Parametrisation(("J", "K"), ("J", "K"), np.array([0.02, 0.3]), np.ones(2, bool), terms),
    )
    controller = TransferMatrix.build([[[8.0, -7.0]]], [[[1, -0.4]]])
    found = []
    for one in (states, transfer):
        loop = close_loop(one, controller)
        loop.check_stability()
        e = Experiment(one, 10, loop=loop)
        found.append((FirBasis(1, 3).integrals(e.information_density, e.singularities), e.noise_information))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-9 * np.abs(one).max())


def test_estimates_of_physical_parameters_agree_with_their_covariance():
    truth, rng = motor(known=("J",)), np.random.default_rng(4)
    u = np.repeat(rng.choice([-1.0, 1.0], (150, 1)), 4, axis=0)
    y = sum(truth.simulate(u, 0.01 * rng.standard_normal((600, 1)), 1.0))
    assert check_estimate(truth, u, y, 1.4 * truth.theta).names == ("R", "K")


@pytest.mark.slow
def test_estimates_of_an_innovation_gain_agree_with_their_covariance():
    """Innovations form: K is estimated too, from another start and with a level of 3 at the outputs."""
    places = [("A", 0, 0), ("A", 1, 1), ("B", 1, 0), ("K", 0, 0), ("K", 1, 1)]
    plain, rng = model(delay=0.0, direct=0 * D, places=places), np.random.default_rng(6)
    names = tuple("abcde")
    truth = Reparametrised(
        plain, Parametrisation(names, names, plain.theta, np.ones(5, bool), tuple(map(Expression, names)))
    )
    u = np.repeat(rng.choice([-1.0, 1.0], (300, 2)), 3, axis=0)
    e = rng.standard_normal((900, 2)) @ np.linalg.cholesky(0.01 * COVARIANCE).T
    y = sum(truth.simulate(u, e, 1.0))
    assert check_estimate(truth, u, y + 3.0, 0.7 * truth.theta).tests.failed == ()
