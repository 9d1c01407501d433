"""Models with coloured noise, drift or other parameters, against polynomials and differences."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.plant import (
    Coloured,
    PolynomialModel,
    SampledModel,
    TransferMatrix,
    close_loop,
    input_gradients,
    noise_gradients,
)
from inputdesign_cli.spectrum import FirBasis
from tests.support.plants import arrays, box_jenkins, in_words, known, lag_of, process
from tests.support.records import check_estimate, check_record

W = np.concatenate([np.geomspace(1e-3, 0.1, 10), np.linspace(0.1, np.pi, 20)])
C, D = np.array([1.0, 0.5, 0.2]), np.array([1.0, -0.7])
B, F = [0, 0.4, 0.1], [1, -1.2, 0.5]
PI = TransferMatrix.build([[[0.5, -0.3]]], [[[1, -1]]])
COVARIANCE = np.array([[1.0, 0.3], [0.3, 0.5]])
ROWS = [[[0, 0.3], [0, 0, -0.2]], [[0.0], [0, 0.5]]], [[[1, -0.5], [1, 0.2]], [[1], [1, -0.8]]]


def outside():
    """A model with C and D around it, and the order of its parameters in `inside`: b, c, d, f."""
    model = Coloured(PolynomialModel.single(B, F=F, variance=0.3), (C,), (D,))
    order = [0, 1, 4, 5, 6, 2, 3]
    assert [model.names[i] for i in order] == ["b1", "b2", "c1", "c2", "d1", "f1", "f2"]
    return model, order


def inside(D=D):
    return PolynomialModel.single(B, F=F, C=C, D=D, variance=0.3)


def test_coloured_noise_gives_the_gradients_of_a_polynomial_model():
    (model, order), known = outside(), inside()
    rng = np.random.default_rng(0)
    y, u, e = (rng.standard_normal((W.size, 1, 2)) + 0j for _ in range(3))
    for one, other in (
        (input_gradients([model], W)[0], input_gradients([known], W)[0]),
        (noise_gradients([model], W)[0], noise_gradients([known], W)[0]),
        (model.plant_gradient(W), known.plant_gradient(W)),
        (model.prediction_gradient(W, y, u, e), known.prediction_gradient(W, y, u, e)),
    ):
        np.testing.assert_allclose(one[:, order], other, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("loop", [False, True])
def test_coloured_noise_gives_the_information_of_a_polynomial_model(loop):
    (model, order), known = outside(), inside()
    loops = [close_loop(m, PI) if loop else None for m in (model, known)]
    a, b = (Experiment(m, 50, loop=one) for m, one in zip((model, known), loops, strict=True))
    pick = np.ix_(order, order)
    np.testing.assert_allclose(a.noise_information[pick], b.noise_information, rtol=1e-9, atol=1e-9)
    basis = FirBasis(1, 3)
    maps = [basis.integrals(e.information_density, e.singularities) for e in (a, b)]
    np.testing.assert_allclose(maps[0][:, order][:, :, order], maps[1], rtol=1e-9, atol=1e-9)
    record = np.random.default_rng(1).standard_normal((90, 1))
    psi = [FiniteRecord(e, 90).gradient(record) for e in (a, b)]
    np.testing.assert_allclose(psi[0][:, order], psi[1], atol=1e-9)
    if loop:
        r, e = np.random.default_rng(2).standard_normal((2, 4, 60, 1))
        for one, other in zip(loops[0].signals(r, e), loops[1].signals(r, e), strict=True):
            np.testing.assert_allclose(one, other, atol=1e-10)


@pytest.mark.parametrize("loop", [False, True])
def test_drift_equals_a_known_root_of_d_at_one(loop):
    """D (1 - q^-1) with known coefficients gives the same gradients by r and by e."""
    drifting = Coloured(inside(), drift=(True,))
    whole = inside(np.convolve(D, [1, -1]))
    pair, w = (known(drifting, "d1"), known(whole, "d1", "d2")), W[W > 0.02]
    models = [Experiment(model, 50, loop=close_loop(model, PI) if loop else None) for model in pair]
    gradients = [e.excitation_gradient(w) for e in models]
    np.testing.assert_allclose(gradients[0], gradients[1], rtol=1e-8, atol=1e-12)
    noises = [e.noise_gradient(w) for e in models]
    np.testing.assert_allclose(noises[0], noises[1], rtol=1e-8, atol=1e-12)
    assert np.all(np.isfinite(models[0].noise_information))


def test_each_output_has_its_own_drift_and_filters():
    """Simulated noise of two outputs, one integrated; the gradient of a record by differences."""
    one = (np.ones(1),)
    plant = PolynomialModel(arrays(ROWS[0]), one, arrays(ROWS[1]), one, one, COVARIANCE)
    model = Coloured(plant, (C, np.ones(1)), (np.ones(1), D), (False, False), (True, False))
    assert model.names[-3:] == ("c1[1]", "c2[1]", "d1[2]")
    e = np.random.default_rng(0).standard_normal((80, 2))
    _, v = model.simulate(np.zeros((80, 2)), e, 1.0)
    np.testing.assert_allclose(np.diff(v[:, 0], prepend=0.0), np.convolve(C, e[:, 0])[:80], atol=1e-12)
    np.testing.assert_allclose(np.convolve(D, v[:, 1])[:80], e[:, 1], atol=1e-12)
    check_record(model, 120)
    check_record(Coloured(heater(), (C,), (D,), drift=(True,)), 150)  # of a sampled plant


def heater():
    return SampledModel(lag_of([2.0], [3.0, 1], 1.685, variance=0.01), 0.5)


@pytest.mark.slow
@pytest.mark.parametrize(
    "noise",
    [{"C": (C,), "D": (D,)}, {"drift": (True,)}, {"C": (np.array([1.0, -0.4]),), "drift": (True,)}],
    ids=["ARMA", "random walk", "IMA"],
)
@pytest.mark.parametrize("feedback", [False, True])
def test_estimates_with_coloured_and_drifting_noise_agree_with_their_covariance(noise, feedback):
    """The search starts far from the truth and ends within four standard deviations of it."""
    model = Coloured(heater(), **noise)
    rng = np.random.default_rng(7)
    r = np.repeat(rng.choice([-1.0, 1.0], (200, 1)), 4, axis=0)
    e = 0.1 * rng.standard_normal((800, 1))
    if feedback:
        loop = close_loop(model, TransferMatrix.build([[[0.4, -0.35]]], [[[1, -1]]]))
        loop.check_stability()
        y, u = (x[0] for x in loop.signals(r[None], e[None]))
    else:
        u, y = r, sum(model.simulate(r, e, 1.0))
    far = model.theta * np.where(np.array(model.names) == "delay", 2.0, 0.5)
    assert check_estimate(model, u, y, far, feedback=feedback, rest=True).tests.failed == ()


def test_a_root_on_the_circle_may_be_known():
    """A disturbance of a known period: D = 1 - 2 cos(w0) q^-1 + q^-2."""
    seasonal = np.array([1.0, -2.0 * np.cos(0.4), 1.0])
    plant = PolynomialModel.single([0, 0.5], F=[1, -0.8], variance=0.01)
    coloured = Coloured(plant, D=(seasonal,), held=(True,))
    experiment = Experiment(known(coloured, "d1", "d2"), 100)
    white = FirBasis(1, 0).integrals(experiment.information_density, experiment.singularities)[0]
    impulse = np.eye(1, 400)[0]
    by_b = scipy.signal.lfilter(seasonal, [1, -0.8], np.roll(impulse, 1))
    by_f = scipy.signal.lfilter([0, -0.5], [1, -0.8], by_b)
    psi = np.stack([by_b, by_f])
    np.testing.assert_allclose(white, 100 / 0.01 * psi @ psi.T, rtol=1e-9)


AT = np.array([0.05, 0.4, 1.3, 2.9])


def test_known_parameters_lose_their_rows_and_columns_of_the_information():
    """Knowing parameters is the same as deleting their rows and columns."""
    model = box_jenkins()
    names = ["c1[2]", "b2[1,1]", "a1"]
    kept = [i for i, name in enumerate(model.names) if name not in names]
    whole, part = (Experiment(m, 100) for m in (model, known(model, *names)))
    densities = [e.information_density(AT) for e in (whole, part)]
    np.testing.assert_allclose(densities[1], densities[0][:, kept][:, :, kept], atol=1e-12)
    np.testing.assert_allclose(part.noise_information, whole.noise_information[np.ix_(kept, kept)], rtol=1e-9)


def test_a_loop_in_physical_parameters_equals_that_of_its_coefficients():
    model = in_words(SampledModel(process(), 0.7))
    C = TransferMatrix.build([[[0.1]]], [[(1.0, -1.0)]])
    loop, inner = close_loop(model, C), close_loop(model.coefficients, C)
    loop.check_stability()
    np.testing.assert_allclose(loop.closed_poles, inner.closed_poles)
    J = model.parametrisation.jacobian
    expected = np.einsum("nlpr,lk->nkpr", inner.excitation_gradient(AT), J)
    np.testing.assert_allclose(loop.excitation_gradient(AT), expected, atol=1e-12)


def test_a_fraction_is_affine_unless_a_free_parameter_enters_nonlinearly():
    inner = process()
    assert np.array_equal(inner.bends(0, 0), [False, False, True])
    assert not np.any(known(inner, "delay").bends(0, 0))
    assert np.all(in_words(inner).bends(0, 0))
    part = known(inner, "delay").entry_fraction(0, 0, AT)
    np.testing.assert_allclose(part.numerator / part.denominator, inner.plant_at(AT)[:, 0, 0])
