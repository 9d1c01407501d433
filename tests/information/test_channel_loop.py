"""Several channels in closed loop: against simulated impulses and finite differences, and against SISO."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal
from channel_plants import arrays
from loop_checks import check_information, check_signals

from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import (
    Loop,
    PolynomialLoop,
    PolynomialModel,
    Rational,
    TransferMatrix,
)
from inputdesign_cli.spectrum import FirBasis, MatrixFirBasis

LONG = 160
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


NUMERATOR = [[[0.4, -0.32], [0.05]], [[0.0], [0.1, 0.05]], [[0.1], [0.0]]]
DENOMINATOR = [[[1, -1], [1, -1]], [[1], [1, -0.3]], [[1, 0.2], [1]]]


def controller():
    return TransferMatrix.build(NUMERATOR, DENOMINATOR)


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
                top, bottom = NUMERATOR[j][i], DENOMINATOR[j][i]
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


@pytest.fixture(scope="module")
def experiment():
    plant = box_jenkins()
    loop = PolynomialLoop(plant, controller())
    loop.check_stability()
    return Experiment(plant, 7, loop=loop)


def test_information_is_that_of_simulated_impulses(experiment):
    check_information(experiment, *(impulse_gradients(experiment.model, source) for source in "re"))


def test_powers_are_those_of_simulated_impulses(experiment):
    plant = experiment.model
    c = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.2], [0.0, -0.2, 0.5]])
    basis = MatrixFirBasis(3, 0)
    x = np.array([2.0, 0.3, 1.0, 0.0, -0.2, 0.5])
    np.testing.assert_array_equal(basis.autocovariances(x)[0], c)
    runs = [
        simulated(plant, np.eye(3)[m] * (np.arange(LONG) == 0)[:, None], np.zeros((LONG, 2)))
        for m in range(3)
    ]
    y, u = (np.stack([run[part] for run in runs], axis=-1) for part in (0, 1))
    for kind, response in (("output", y), ("input", u)):
        for channel in (None, 1):
            rows = response if channel is None else response[:, channel : channel + 1]
            expected = np.einsum("tpm,mn,tpn->", rows, c, rows)
            unit = basis.integrals(
                lambda w, kind=kind, channel=channel: experiment.power_density(kind, w, channel),
                experiment.singularities,
            )
            assert unit @ x == pytest.approx(expected, rel=1e-8)


def test_one_channel_is_the_siso_loop():
    A, B, F = [1, -1.2, 0.5], [0, 0.3, 0.2], [1]
    C, D = [1, -0.4], [1, 0.3]
    numerator, denominator = [1.1, -0.7], [1, -1]
    siso = PolynomialModel.single(*(np.array(p, dtype=float) for p in (B, A, C, D, F)), 0.7)
    one = Experiment(Loop(siso, Rational.build(numerator, denominator)), 50)
    one.loop.check_stability()
    plant = PolynomialModel(
        arrays([[B]]), (np.array(A),), arrays([[F]]), (np.array(C),), (np.array(D),), np.array([[0.7]])
    )
    loop = PolynomialLoop(plant, TransferMatrix.build([[numerator]], [[denominator]]))
    loop.check_stability()
    several = Experiment(plant, 50, loop=loop)
    assert several.model.names == one.model.names
    np.testing.assert_allclose(several.noise_information, one.noise_information, rtol=1e-9)
    basis = FirBasis(6)
    for density in ("information_density",):
        maps = [basis.integrals(getattr(e, density), e.singularities) for e in (one, several)]
        np.testing.assert_allclose(maps[1], maps[0], rtol=1e-9, atol=1e-9 * np.abs(maps[0]).max())
    for kind in ("input", "output", "excitation"):
        powers = [
            basis.integrals(lambda w, e=e, kind=kind: e.power_density(kind, w), e.singularities)
            for e in (one, several)
        ]
        np.testing.assert_allclose(powers[1], powers[0], rtol=1e-9, atol=1e-9 * np.abs(powers[0]).max())
    poles = np.sort_complex(loop.closed_poles[np.abs(loop.closed_poles) > 1e-6])
    np.testing.assert_allclose(poles, np.sort_complex(np.roots(one.loop.characteristic)), atol=1e-9)


def test_responses_are_those_of_matrix_algebra(experiment):
    w = np.array([0.3, 1.0, 2.5])
    t = experiment.loop.responses(w)
    G, H, K = experiment.model.plant_at(w), experiment.model.noise_at(w), experiment.loop.controller.at(w)
    inner, outer = np.linalg.inv(np.eye(3) + K @ G), np.linalg.inv(np.eye(2) + G @ K)
    for found, expected in ((t.y_x, G @ inner), (t.u_x, inner), (t.y_e, outer @ H), (t.u_e, -K @ outer @ H)):
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)


def test_signals_are_those_of_the_equations_sample_by_sample(experiment):
    check_signals(experiment.loop, simulated)


def test_unstable_and_algebraic_loops_are_refused():
    plant = box_jenkins()
    with pytest.raises(SpecError) as caught:
        PolynomialLoop(
            plant, TransferMatrix.build([[[0.0], [0.0]]] * 3, [[[1.0], [1.0]]] * 3)
        ).check_stability()
    assert caught.value.diagnostics[0].code == "unstable-loop"
    direct = PolynomialModel(
        arrays([[[1.0]]]), (np.ones(1),), arrays([[[1.0]]]), (np.ones(1),), (np.ones(1),), np.eye(1)
    )
    with pytest.raises(SpecError) as caught:
        PolynomialLoop(direct, TransferMatrix.build([[[-1.0, 0.5]]], [[[1.0]]])).check_stability()
    assert caught.value.diagnostics[0].code == "algebraic-loop"
