"""The information of a finite record against simulations of the same samples."""

import dataclasses
from functools import partial

import numpy as np
import pytest
import scipy.linalg
import scipy.signal

from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.information import Experiment, FiniteRecord, FiniteRecords, integrate
from inputdesign_cli.information.finite_record import RecordTransforms
from inputdesign_cli.plant import Loop, PolynomialModel, Rational, TransferMatrix, logarithmic_distance
from inputdesign_cli.signal.lines import grid_lines
from inputdesign_cli.signal.multisine import multisine_record
from inputdesign_cli.spectrum import FirBasis
from tests.support.plants import arrays, arx, paper_experiment, polynomials
from tests.support.random_plants import random_case
from tests.support.refusals import refused


@pytest.mark.parametrize("seed", [1, 5, 7, 9, 15])
def test_prediction_gradient_is_the_derivative_of_the_prediction_error(seed):
    """Finite differences of epsilon = (D/C)(A y - (B/F) u) on noise-free data, open and closed loop."""
    case = random_case(seed)
    model, loop, r = case.model, case.loop, np.random.default_rng(seed).normal(size=(1, 50, 1))
    y, u = loop.signals(r, 0 * r) if loop else (model.simulate(r[0], 0 * r[0], 1.0)[0][None], r)

    def residual(theta):
        A, B, C, D, F = polynomials(model, theta).values()
        clean = scipy.signal.lfilter(A, [1.0], y[0, :, 0]) - scipy.signal.lfilter(B, F, u[0, :, 0])
        return scipy.signal.lfilter(D, C, clean)

    experiment = case.experiment(50)
    found = FiniteRecord(experiment, 50).gradient(r[0])[:, :, 0] * np.sqrt(model.covariance[0, 0])
    h = 1e-6
    for k in range(len(model.names)):
        if model.names[k][0] in "cd":
            continue  # the noise parameters act on epsilon, which is zero here
        step = h * np.eye(len(model.names))[k]
        difference = -(residual(model.theta + step) - residual(model.theta - step)) / (2 * h)
        np.testing.assert_allclose(found[:, k], difference, rtol=1e-4, atol=1e-6 * np.abs(found).max())


def test_record_information_tends_to_that_of_the_spectrum(first_order):
    """A long white record of power two has the information of the spectrum to a few per cent."""
    N = 100_000
    experiment = dataclasses.replace(first_order, samples=N).whitened(2.0)
    record = np.sqrt(2.0) * np.random.default_rng(0).standard_normal(N)
    np.testing.assert_allclose(FiniteRecord(experiment, N).information(record[:, None]), np.eye(3), atol=0.03)


def test_information_of_a_record_is_that_of_simulated_regressors():
    """For ARX the gradient of the prediction is the regressor itself, filtered by nothing."""
    model = arx()
    experiment = Experiment(model, 100).whitened(1.0)
    rng = np.random.default_rng(3)
    u = rng.normal(size=(300, 2))
    y = np.stack(
        [sum(scipy.signal.lfilter(model.B[i][j], model.A[i], u[:, j]) for j in range(2)) for i in range(2)],
        axis=1,
    )
    np.testing.assert_allclose(FiniteRecord(experiment, 300).signals("output", u), y, atol=1e-9)

    def late(x, lag):
        return np.concatenate([np.zeros(lag), x[: x.size - lag]])

    psi = np.zeros((300, experiment.size, 2))
    for index, parameter in enumerate(model.parameters):
        for i, j in set(parameter.places):
            source = late(u[:, j], parameter.power) if parameter.letter == "b" else -late(y[:, i], 1)
            psi[:, index, i] = source
    precision = np.linalg.inv(model.covariance)
    expected = np.einsum("tki,ij,tlj->kl", psi, precision, psi)
    noise = Experiment(model, 300).baseline_information
    ours = experiment.to_raw(FiniteRecord(experiment, 300).information(u))
    np.testing.assert_allclose(ours, expected + noise, atol=1e-8 * np.abs(expected).max())


def test_a_long_record_in_continuous_time_has_the_information_of_its_spectrum():
    experiment = paper_experiment()
    period, step = 2048, 1.0
    w = 2 * np.pi * np.arange(period // 2 + 1) / (period * step)
    phi = np.where((w > 0.1) & (w < 1.8), 1.0, 0.0)[:, None, None] * np.array([[2.0, 0.5], [0.5, 1.0]])
    lines = grid_lines(phi, period, step)
    record = multisine_record(lines, 2 * period, np.random.default_rng(4), "orthogonal")
    densities = experiment.information_density(lines.frequencies / step)
    expected = np.einsum("nklab,nba->kl", densities, lines.powers).real
    ours = FiniteRecord(experiment, len(record), step).information(record) / len(record)
    np.testing.assert_allclose(ours, expected, atol=0.02 * np.abs(expected).max())


SLOW = PolynomialModel(
    arrays([[[0, 1.0, 0.4], [0, 0.3]], [[0, 0.5], [0, 1.2]]]),
    (np.array([1.0, -0.99999]), np.array([1.0, -0.5])),
    arrays([[[1.0], [1.0]], [[1.0], [1.0, -1.9, 0.9995]]]),
    (np.ones(1),),
    (np.ones(1),),
    np.eye(2),
)


@pytest.mark.parametrize("model", [SLOW, arx()], ids=["slow", "arx"])
def test_records_are_filtered_exactly(model):
    """Signals and their adjoint against the difference equations, also where a plant remembers longer than
    the record: an almost integrating and a lightly damped entry.
    """
    u, v = (np.random.default_rng(seed).standard_normal((300, 2)) for seed in (0, 1))
    plant = FiniteRecord(Experiment(model, 300), 300, 1.0)
    wanted = np.zeros((300, 2))
    for i in range(2):
        right = sum(scipy.signal.lfilter(model.B[i][j], model.F[i][j], u[:, j]) for j in range(2))
        wanted[:, i] = scipy.signal.lfilter([1.0], model.A[i], right)
    np.testing.assert_allclose(plant.signals("output", u), wanted, atol=1e-11 * np.abs(wanted).max())
    assert np.sum(plant.adjoint("output", v) * u) == pytest.approx(np.sum(wanted * v), rel=1e-10)


def test_a_slow_loop_is_filtered_exactly_without_waiting_for_it_to_settle():
    """Integrators of gain 1e-5 settle in a million samples; the record has 200."""
    model = arx()
    gains = 1e-5 * np.linalg.inv(model.plant_at(np.zeros(1))[0].real)
    controller = TransferMatrix.build([[[g] for g in row] for row in gains], [[[1, -1]] * 2] * 2)
    loop = Loop(model, controller)
    loop.check_stability()
    r = np.random.default_rng(1).standard_normal((200, 2))
    plant = FiniteRecord(Experiment(model, 200, loop=loop), 200, 1.0)
    y, u = loop.signals(r, np.zeros((200, 2)))
    np.testing.assert_allclose(plant.signals("output", r), y, atol=1e-10)
    np.testing.assert_allclose(plant.signals("input", r), u, atol=1e-10)


@pytest.mark.parametrize("of", ["input", "output", "excitation"])
@pytest.mark.parametrize("models", [(arx(), SLOW), (random_case(1).model, random_case(5).model)])
def test_joint_responses_of_several_plants_equal_the_responses_of_each_alone(models, of):
    """The plants share transforms, or each has its own difference equation."""
    experiments = [Experiment(model, 120) for model in models]
    together = FiniteRecords(experiments[0], 120, others=(experiments[1],))
    record = np.random.default_rng(2).normal(size=(120, models[0].inputs))
    each = [FiniteRecord(one, 120).signals(of, record) for one in experiments[: together.plants_with_own(of)]]
    wanted = np.concatenate(each, axis=1)
    np.testing.assert_allclose(
        together.signals_of_each(of, record), wanted, atol=1e-10 * np.abs(wanted).max()
    )
    weights = np.random.default_rng(3).normal(size=wanted.shape)
    assert np.sum(together.adjoint_of_each(of, weights) * record) == pytest.approx(np.sum(weights * wanted))


@pytest.mark.parametrize("model", [arx(), SLOW, random_case(1).model, random_case(5).model])
def test_results_for_several_records_equal_the_results_of_each_alone(model):
    plant = FiniteRecord(Experiment(model, 120).whitened(1.0), 120)
    records = np.random.default_rng(4).normal(size=(3, 120, model.inputs))
    outputs = (partial(one, "output") for one in (plant.signals, plant.mean_squares))
    for answer in (plant.information, *outputs):
        alone = np.stack([answer(record) for record in records])
        np.testing.assert_allclose(answer(records), alone, atol=1e-12 * np.abs(alone).max())


def test_an_experiment_remembers_no_record_for_another():
    """A new experiment gives the same results, after other records and after changes in place."""
    experiment, draw = Experiment(arx(), 120).whitened(1.0), np.random.default_rng(6)
    records = [draw.normal(size=(120, 1)) for _ in range(7)]
    for record in [*records, records[0], records[5]]:
        for plant in (experiment, experiment.with_samples(60)):
            for change in (1.0, -2.0):
                record *= change
                known = FiniteRecord(plant, 120).information(record)
                fresh = FiniteRecord(dataclasses.replace(plant), 120).information(record)
                np.testing.assert_array_equal(known, fresh)


@pytest.mark.parametrize("seed", range(8))
def test_difference_equations_and_transforms_agree(seed):
    """Open and closed loops of one channel: signals, their adjoints and gradients, two ways."""
    experiment = random_case(seed).experiment(200)
    fast, general = FiniteRecord(experiment, 200), RecordTransforms((experiment,), 200, 1.0)
    record, weights = np.random.default_rng(seed).normal(size=(2, 200, 1))
    for kind in ("input", "output"):
        wanted = general.signals(kind, record)
        np.testing.assert_allclose(fast.signals(kind, record), wanted, atol=1e-9 * np.abs(wanted).max())
        wanted = general.adjoint(kind, weights)
        np.testing.assert_allclose(fast.adjoint(kind, weights), wanted, atol=1e-9 * np.abs(wanted).max())
    wanted = general.gradient(record)
    for found, column in zip(fast.gradient(record).T[0], wanted.T[0], strict=True):
        np.testing.assert_allclose(found, column, atol=1e-9 * np.abs(column).max())


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

    found = integrate(lambda w: np.abs(g.at(w)) ** 2, None, logarithmic_distance(g.poles))[0]
    assert found == pytest.approx(h2_squared(numerator, denominator), rel=1e-10)


@pytest.mark.parametrize("lag", [0, 1, 17, 300])
def test_moments_of_a_first_order_spectrum_are_its_autocovariances(lag):
    """1 / |1 - a e^{jw}|^2 has the autocovariances a^lag / (1 - a^2)."""
    a = 0.999

    def density(w):
        return 1 / np.abs(1 - a * np.exp(-1j * w)) ** 2

    values = FirBasis(1, 300).integrals(density, logarithmic_distance([a]))
    assert values[lag] == pytest.approx((1 if lag == 0 else 2) * a**lag / (1 - a * a), rel=1e-10)


@pytest.mark.parametrize("several", [False, True])
def test_the_integral_does_not_depend_on_the_number_of_nodes_per_evaluation(several):
    """1 / |1 - a e^{jw}|^2 has the mean 1 / (1 - a^2)."""
    a = 0.95

    def density(w):
        assert 1 <= w.size <= (256 if several else 2048)
        return np.outer(1 / np.abs(1 - a * np.exp(-1j * w)) ** 2, np.ones(100 if several else 1))

    found = integrate(density, None, logarithmic_distance([a]), several=several)
    assert found == pytest.approx(1 / (1 - a * a), rel=1e-12)


def test_pole_on_the_circle_is_refused():
    def density(w):
        return 1 / np.abs(1 - np.exp(-1j * w)) ** 2

    found = refused(integrate, density, None, logarithmic_distance([1.0]), kind=InaccurateError)
    assert found[0].code == "integral-inaccurate"
