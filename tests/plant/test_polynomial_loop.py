"""The loop around polynomial plants: against simulated impulses, finite differences and plain algebra."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import Loop, PolynomialModel, TransferMatrix, close_loop
from inputdesign_cli.spectrum import FirBasis
from tests.support.loop_checks import check_information, check_signals
from tests.support.plants import arrays

LONG = 400
STEP = 1e-6


def box_jenkins(theta=None):
    """Every polynomial, the first A unstable, three inputs and two outputs, one entry zero."""
    covariance = np.array([[1.0, 0.3], [0.3, 0.5]])
    plant = PolynomialModel(
        arrays([[[0, 1.0, 0.4], [0, -0.3], [0]], [[0, 0.2], [0, 0.8, -0.1], [0, 0, 0.5]]]),
        (np.array([1.0, -1.1]), np.array([1.0, 0.3])),
        arrays([[[1, -0.2], [1], [1]], [[1], [1, 0.4], [1, -0.5]]]),
        (np.array([1.0, 0.3]), np.array([1.0, -0.4])),
        (np.array([1.0, -0.5]),),
        covariance,
    )
    return plant if theta is None else moved(plant, theta)


def moved(plant, theta):
    """The plant with other values of its parameters."""
    rows = {letter: [p.copy() for p in getattr(plant, letter)] for letter in "ACD"}
    entries = {letter: [[p.copy() for p in row] for row in getattr(plant, letter)] for letter in "BF"}
    for parameter, value in zip(plant.parameters, theta, strict=True):
        (i, j), letter = parameter.places[0], parameter.letter.upper()
        polynomial = (
            entries[letter][i][j] if letter in "BF" else rows[letter][i if len(rows[letter]) > 1 else 0]
        )
        polynomial[parameter.power] = value
    return replace(
        plant,
        **{letter: tuple(value) for letter, value in rows.items()},
        **{letter: arrays(value) for letter, value in entries.items()},
    )


def single():
    """Every polynomial but F, one input and one output."""
    return PolynomialModel.single([0, 0.3, 0.2], A=[1, -1.2, 0.5], C=[1, -0.4], D=[1, 0.3], variance=0.7)


# The controllers by the number of inputs: entries (input, output).
NUMERATOR = {1: [[[1.1, -0.7]]], 3: [[[0.4, -0.32], [0.05]], [[0.0], [0.1, 0.05]], [[0.1], [0.0]]]}
DENOMINATOR = {1: [[[1, -1]]], 3: [[[1, -1], [1, -1]], [[1], [1, -0.3]], [[1, 0.2], [1]]]}


def simulated(plant, r, e):
    """y (t, p) and u (t, r) of the loop, equation by equation, sample by sample."""
    samples, p, inputs = len(r), plant.outputs, plant.inputs
    A, C, D = (plant.per_output(rows) for rows in (plant.A, plant.C, plant.D))
    v = np.stack([scipy.signal.lfilter(C[i], D[i], e[:, i]) for i in range(p)], axis=1)
    y, u = np.zeros((samples, p)), np.zeros((samples, inputs))
    x = np.zeros((samples, p, inputs))  # (B / F) u
    k = np.zeros((samples, inputs, p))  # C y, entry by entry
    for t in range(samples):
        for i in range(p):
            for j in range(inputs):
                B, F = plant.B[i][j], plant.F[i][j]
                x[t, i, j] = sum(B[lag] * u[t - lag, j] for lag in range(1, len(B)) if t >= lag)
                x[t, i, j] -= sum(F[lag] * x[t - lag, i, j] for lag in range(1, len(F)) if t >= lag)
            past = sum(A[i][lag] * y[t - lag, i] for lag in range(1, len(A[i])) if t >= lag)
            y[t, i] = v[t, i] + x[t, i].sum() - past
        for j in range(inputs):
            for i in range(p):
                top, bottom = NUMERATOR[inputs][j][i], DENOMINATOR[inputs][j][i]
                k[t, j, i] = sum(c * y[t - lag, i] for lag, c in enumerate(top) if t >= lag)
                k[t, j, i] -= sum(c * k[t - lag, j, i] for lag, c in enumerate(bottom) if 0 < lag <= t)
            u[t, j] = r[t, j] - k[t, j].sum()
    return y, u


def errors(plant, y, u):
    """epsilon (t, p) of the one-step predictor, polynomial by polynomial."""
    A, C, D = (plant.per_output(rows) for rows in (plant.A, plant.C, plant.D))
    out = np.zeros_like(y)
    for i in range(plant.outputs):
        rest = scipy.signal.lfilter(A[i], [1.0], y[:, i])
        for j in range(plant.inputs):
            rest = rest - scipy.signal.lfilter(plant.B[i][j], plant.F[i][j], u[:, j])
        out[:, i] = scipy.signal.lfilter(D[i], C[i], rest)
    return out


def impulse_gradients(plant, source):
    """psi (t, k, p, m): minus the derivative of epsilon, for a unit impulse in each r (or e)."""
    inputs, p = plant.inputs, plant.outputs
    theta, parts = plant.theta, []
    for m in range(inputs if source == "r" else p):
        r, e = np.zeros((LONG, inputs)), np.zeros((LONG, p))
        (r if source == "r" else e)[0, m] = 1.0
        y, u = simulated(plant, r, e)
        assert np.abs(y[-5:]).max() < 1e-9
        columns = []
        for index in range(theta.size):
            up, down = theta.copy(), theta.copy()
            up[index] += STEP
            down[index] -= STEP
            columns.append((errors(moved(plant, down), y, u) - errors(moved(plant, up), y, u)) / (2 * STEP))
        parts.append(np.stack(columns, axis=1))
    return np.stack(parts, axis=-1)


@pytest.fixture(scope="module", params=[box_jenkins, single])
def experiment(request):
    plant = request.param()
    controller = TransferMatrix.build(NUMERATOR[plant.inputs], DENOMINATOR[plant.inputs])
    loop = Loop(plant, controller)
    loop.check_stability()
    return Experiment(plant, 7, loop=loop)


def test_information_is_that_of_simulated_impulses(experiment):
    check_information(experiment, *(impulse_gradients(experiment.model, source) for source in "re"))


def test_powers_are_those_of_simulated_impulses(experiment):
    plant = experiment.model
    inputs, outputs = plant.inputs, plant.outputs
    c = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.2], [0.0, -0.2, 0.5]])[:inputs, :inputs]
    basis = FirBasis(inputs, 0)
    x = np.array([2.0, 0.3, 1.0, 0.0, -0.2, 0.5])[: basis.size]
    np.testing.assert_array_equal(basis.autocovariances(x)[0], c)
    runs = [
        simulated(plant, np.eye(inputs)[m] * (np.arange(LONG) == 0)[:, None], np.zeros((LONG, outputs)))
        for m in range(inputs)
    ]
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


def test_closed_poles_are_the_roots_of_the_characteristic_polynomial():
    loop = close_loop(single(), TransferMatrix.build(NUMERATOR[1], DENOMINATOR[1]))
    expected = np.roots(np.polyadd(np.polymul([1, -1.2, 0.5], [1, -1]), np.polymul([0.3, 0.2], [1.1, -0.7])))
    poles = np.sort_complex(loop.closed_poles[np.abs(loop.closed_poles) > 1e-6])
    np.testing.assert_allclose(poles, np.sort_complex(expected), atol=1e-9)


def test_responses_are_those_of_matrix_algebra(experiment):
    w = np.array([0.3, 1.0, 2.5])
    y_r, u_r = experiment.loop.excited(w)
    y_e, u_e = experiment.loop.disturbed(w)
    G, H, K = experiment.model.plant_at(w), experiment.model.noise_at(w), experiment.loop.controller.at(w)
    inputs, outputs = np.eye(experiment.model.inputs), np.eye(experiment.model.outputs)
    inner, outer = np.linalg.inv(inputs + K @ G), np.linalg.inv(outputs + G @ K)
    for found, expected in ((y_r, G @ inner), (u_r, inner), (y_e, outer @ H), (u_e, -K @ outer @ H)):
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)


def test_signals_are_those_of_the_equations_sample_by_sample(experiment):
    check_signals(experiment.loop, simulated)


def test_an_unstable_plant_that_is_left_alone_is_refused():
    plant = box_jenkins()
    with pytest.raises(SpecError) as caught:
        Loop(plant, TransferMatrix.build([[[0.0], [0.0]]] * 3, [[[1.0], [1.0]]] * 3)).check_stability()
    assert caught.value.diagnostics[0].code == "unstable-loop"


def looped(model, numerator):
    return close_loop(model, TransferMatrix.build([[numerator]], [[[1.0]]]))


def test_unstable_plant_in_a_stable_loop_has_finite_gradients():
    """An ARX plant with an integrator: S G and the gradients stay finite at DC."""
    loop = looped(PolynomialModel.single([0.0, 1.0], A=[1.0, -1.0]), [0.5])
    loop.check_stability()
    y, u = loop.excited(np.array([0.0]))
    assert y.item() == pytest.approx(2.0)  # 1 / C at DC
    assert abs(u.item()) == pytest.approx(0.0)
    assert np.all(np.isfinite(loop.excitation_gradient(np.array([0.0]))))


def test_unstable_and_algebraic_loops_are_refused():
    with pytest.raises(SpecError) as unstable:
        looped(PolynomialModel.single([0.0, 1.0], A=[1.0, -0.9]), [-0.5]).check_stability()
    assert unstable.value.diagnostics[0].code == "unstable-loop"
    with pytest.raises(SpecError) as algebraic:
        looped(PolynomialModel.single([1.0, 0.5]), [-1.0]).check_stability()
    assert algebraic.value.diagnostics[0].code == "algebraic-loop"


def test_an_input_that_answers_the_noise_at_once_is_refused_where_the_plant_has_no_delay():
    direct, delayed = PolynomialModel.single([1.0, 0.5]), PolynomialModel.single([0.0, 1.0])
    with pytest.raises(SpecError) as caught:
        looped(direct, [0.3]).check_delay()
    assert caught.value.diagnostics[0].code == "algebraic-loop"
    looped(direct, [0.0, 0.3]).check_delay()
    looped(delayed, [0.3]).check_delay()
