"""The likelihood of records is that of the Gaussian density of all their samples at once."""

import numpy as np
import pytest
import scipy

from inputdesign_cli import parse_spec
from inputdesign_cli.identification import identify
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.records import Records, evaluate
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.questions.building.system import build_model

N = 40
RICH = PolynomialModel.single(
    [0.0, 1.0, 0.4], F=[1.0, -1.2, 0.5], C=[1.0, 0.9, 0.3], D=[1.0, -0.7, 0.1, 0.05], variance=1.0
)
NEAR = PolynomialModel.single([0.0, 1.0, 0.4], F=[1.0, -0.9], C=[1.0, -0.99], variance=1.0)
MODELS = {
    "Box-Jenkins": RICH,
    "zero near the circle": NEAR,
    "pole near the circle": PolynomialModel.single([0.0, 1.0], F=[1.0, -0.9], D=[1.0, -0.99]),
}


def lagged(first):
    return scipy.linalg.toeplitz(first, np.zeros(len(first)))


def response(above, below, samples):
    impulse = np.eye(1, samples)[0]
    return scipy.signal.lfilter(above, below, impulse)


def covariance(C, D, samples):
    """Of stationary noise C/D e, from its autocovariances, the tail of its response being summed."""
    h = response(C, D, 6000)
    return scipy.linalg.toeplitz([h[lag:] @ h[: len(h) - lag] for lag in range(samples)])


def textbook(model, records, *, free):
    """-2 log likelihood at the likeliest variance, up to a constant, unknown starts being integrated out."""
    (B,), (F,), (C,), (D,) = model.B[0], model.F[0], model.C, model.D
    deviance, squares, freedom = 2.0 * np.log(np.sum(response([1.0], C, 6000) ** 2)), 0.0, 0
    for u, y in records:
        left, V = y - scipy.signal.lfilter(B, F, u), covariance(C, D, len(y))
        X = scipy.linalg.orth(starts_of(model, len(y))) if free else np.zeros((len(y), 0))
        W = np.linalg.inv(V)
        middle = X.T @ W @ X
        left = left - X @ np.linalg.solve(middle, X.T @ W @ left)
        deviance += np.linalg.slogdet(V)[1] + np.linalg.slogdet(middle)[1]
        squares, freedom = squares + left @ W @ left, freedom + len(y) - X.shape[1]
    return freedom * np.log(squares) + deviance


def starts_of(model, samples):
    F = model.F[0][0]
    order = F.size - 1
    older = max(model.B[0][0].size - 1 - order, 0)
    states = [scipy.signal.lfilter([1.0], F, np.eye(order, samples)[i]) for i in range(order)]
    return np.column_stack([np.ones(samples), np.eye(samples)[:, :older], *states])


def ours(model, parts, *, free):
    records = Records(estimator(model, 1.0), tuple((u[:, None], y[:, None]) for u, y in parts))
    records = records.begun_freely(0) if free else records
    point = evaluate(records, model.theta)
    return point.freedom * np.log(point.cost), records, point


@pytest.mark.parametrize("lengths", [(N,), (30, N, 24)])
@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_it_is_that_of_the_covariance_of_all_samples(model, free, lengths):
    """Differences between models are compared; a stationary start and its determinant are in both."""
    rng = np.random.default_rng(3)
    parts = [(rng.standard_normal(n), np.cumsum(rng.standard_normal(n))) for n in lengths]
    other = model.at(model.theta * (1.0 - 0.1 * rng.random(model.theta.size)), model.covariance)
    found = ours(other, parts, free=free)[0] - ours(model, parts, free=free)[0]
    expected = textbook(other, parts, free=free) - textbook(model, parts, free=free)
    assert found == pytest.approx(expected, rel=1e-3, abs=1e-3)


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_its_slope_is_that_of_differences(model, free):
    """At errors that no parameter changes much the slope of Gauss and Newton is exact to first order."""
    rng = np.random.default_rng(4)
    parts = [(rng.standard_normal(n), rng.standard_normal(n)) for n in (N, 30)]
    _, records, point = ours(model, parts, free=free)
    for k, step in enumerate(1e-6 * np.eye(model.theta.size)):
        ends = [evaluate(records, model.theta + sign * step).cost for sign in (1.0, -1.0)]
        assert -2.0 * point.slope[k] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5, abs=1e-5)


def test_a_known_pole_on_the_circle_leaves_a_regression_of_differences():
    """y = b u(t - 1) + noise that is a sum: where it began is unknown, of its steps nothing is."""
    rng = np.random.default_rng(5)
    u, e = rng.standard_normal(N), rng.standard_normal(N)
    delayed = np.append(0.0, u[:-1])
    y = 0.6 * delayed + 40.0 + np.cumsum(e)
    spec = parse_spec("plant: {B: [0, 0.5]}\nnoise: {D: [1, -1], known: [d1], variance: 1}\n", design=False)
    found = identify(build_model(spec), u[:, None], y[:, None])
    steps, of_y = np.diff(delayed), np.diff(y)
    b = steps @ of_y / (steps @ steps)
    assert found.theta == pytest.approx([b], rel=1e-2)
    assert found.noise[0, 0] == pytest.approx(np.sum((of_y - b * steps) ** 2) / (N - 2), rel=0.05)
