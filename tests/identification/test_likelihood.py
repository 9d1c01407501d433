"""The likelihood is the Gaussian density of all samples; unknown starts are eliminated by regression."""

import numpy as np
import pytest
import scipy

from inputdesign_cli.identification import identify
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.records import Records, evaluate
from inputdesign_cli.identification.start import FreeStarts, Start
from inputdesign_cli.plant import PolynomialModel
from tests.support.plants import stated

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


def response(above, below, samples):
    impulse = np.eye(1, samples)[0]
    return scipy.signal.lfilter(above, below, impulse)


def covariance(C, D, samples):
    """The covariance (samples, samples) of stationary noise C/D e, from its long impulse response."""
    h = response(C, D, 6000)
    return scipy.linalg.toeplitz([h[lag:] @ h[: len(h) - lag] for lag in range(samples)])


def textbook(model, records, *, free):
    """-2 log likelihood at the likeliest variance, up to a constant; unknown starts are integrated out."""
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
def test_the_likelihood_is_the_gaussian_density_of_all_samples(model, free, lengths):
    """Differences between models are compared; both include the stationary start and its determinant."""
    rng = np.random.default_rng(3)
    parts = [(rng.standard_normal(n), np.cumsum(rng.standard_normal(n))) for n in lengths]
    other = model.at(model.theta * (1.0 - 0.1 * rng.random(model.theta.size)), model.covariance)
    found = ours(other, parts, free=free)[0] - ours(model, parts, free=free)[0]
    expected = textbook(other, parts, free=free) - textbook(model, parts, free=free)
    assert found == pytest.approx(expected, rel=1e-3, abs=1e-3)


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_the_slope_of_the_likelihood_is_a_difference_quotient(model, free):
    """No parameter changes these errors much; there the Gauss-Newton slope is exact to first order."""
    rng = np.random.default_rng(4)
    parts = [(rng.standard_normal(n), rng.standard_normal(n)) for n in (N, 30)]
    _, records, point = ours(model, parts, free=free)
    for k, step in enumerate(1e-6 * np.eye(model.theta.size)):
        ends = [evaluate(records, model.theta + sign * step).cost for sign in (1.0, -1.0)]
        assert -2.0 * point.slope[k] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5, abs=1e-5)


def test_with_a_known_noise_pole_at_one_the_estimate_regresses_differences():
    """y = b u(t - 1) + a random walk, whose start is unknown; its steps have no unknown past."""
    rng = np.random.default_rng(5)
    u, e = rng.standard_normal(N), rng.standard_normal(N)
    delayed = np.append(0.0, u[:-1])
    y = 0.6 * delayed + 40.0 + np.cumsum(e)
    model = stated("plant: {B: [0, 0.5]}\nnoise: {D: [1, -1], known: [d1], variance: 1}\n")
    found = identify(model, u[:, None], y[:, None])
    steps, of_y = np.diff(delayed), np.diff(y)
    b = steps @ of_y / (steps @ steps)
    assert found.theta == pytest.approx([b], rel=1e-2)
    assert found.noise[0, 0] == pytest.approx(np.sum((of_y - b * steps) ** 2) / (N - 2), rel=0.05)


LENGTHS = (50, 30)
COUNTS = (3, 4)


@pytest.fixture
def rng():
    return np.random.default_rng(8)


def dense(responses):
    """Every response as a column (N p, m) of the errors of all outputs and records."""
    columns, begin = [], 0
    for length in LENGTHS:
        for output, block in enumerate(responses):
            for row in block:
                column = np.zeros((sum(LENGTHS), 2))
                column[begin : begin + length, output] = row[:length]
                columns.append(column.ravel())
        begin += length
    return np.array(columns).T


def drawn(rng):
    return [rng.standard_normal((m, max(LENGTHS))) for m in COUNTS]


def begun(responses):
    return FreeStarts(LENGTHS, tuple(map(Start.white, responses)))


@pytest.mark.parametrize("weights", [None, np.array([[2.0, -1.2], [-1.2, 1.0]])])
@pytest.mark.parametrize("level", [0.0, 1e4])
def test_starts_are_eliminated_as_by_weighted_least_squares(weights, level, rng):
    responses = drawn(rng)
    for block in responses:
        block[0] = 1.0
    starts = begun(responses)
    errors = level + rng.standard_normal((sum(LENGTHS), 2)) @ np.array([[1.0, 0.9], [0.0, 0.3]])
    coefficients, root, directions = starts.eliminated(errors, weights)
    left = errors - starts.combined(coefficients, starts.starts)
    W = np.linalg.inv(left.T @ left / len(left)) if weights is None else weights
    np.testing.assert_allclose(root.T @ root / W, (root.T @ root / W)[0, 0], rtol=1e-6)
    X = np.kron(np.eye(sum(LENGTHS)), np.linalg.cholesky(W).T) @ dense(responses)
    expected = np.linalg.lstsq(X, (errors @ np.linalg.cholesky(W)).ravel(), rcond=None)[0]
    found = np.concatenate([np.concatenate(rows) for rows in zip(*coefficients, strict=True)])
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(directions.T @ directions, np.eye(directions.shape[1]), atol=1e-9)
    in_white_units = np.kron(np.eye(sum(LENGTHS)), root) @ dense(responses)
    outside = in_white_units - directions @ (directions.T @ in_white_units)
    assert np.linalg.norm(outside) < 1e-8 * np.linalg.norm(in_white_units)


@pytest.mark.parametrize("share", [-3.0, 0.0])
def test_proportional_and_zero_responses_span_no_additional_direction(share, rng):
    responses = drawn(rng)
    responses[1][1] = share * responses[1][0]
    errors = rng.standard_normal((sum(LENGTHS), 2))
    _, _, directions = begun(responses).eliminated(errors, None)
    assert directions.shape[1] == len(LENGTHS) * (sum(COUNTS) - 1)
    assert np.all(np.isfinite(directions))


def test_directions_are_orthonormal_for_outputs_with_nearly_equal_errors(rng):
    """Normal equations would lose directions here."""
    errors = rng.standard_normal((sum(LENGTHS), 1)) + 1e-6 * rng.standard_normal((sum(LENGTHS), 2))
    _, _, directions = begun(drawn(rng)).eliminated(errors, None)
    np.testing.assert_allclose(directions.T @ directions, np.eye(directions.shape[1]), atol=1e-9)
