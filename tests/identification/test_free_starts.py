"""Unknown starts are eliminated as a regression of all errors on all responses would do it."""

import numpy as np
import pytest

from inputdesign_cli.identification.start import FreeStarts, Start

LENGTHS = (50, 30)
COUNTS = (3, 4)


@pytest.fixture
def rng():
    return np.random.default_rng(8)


def dense(responses):
    """(N p, m): every response among the errors of all outputs and records."""
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
def test_what_is_left_is_that_of_weighed_least_squares(weights, level, rng):
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


def test_responses_that_are_the_same_count_once(rng):
    responses = drawn(rng)
    responses[1][1] = -3.0 * responses[1][0]
    errors = rng.standard_normal((sum(LENGTHS), 2))
    _, _, directions = begun(responses).eliminated(errors, None)
    assert directions.shape[1] == len(LENGTHS) * (sum(COUNTS) - 1)


def test_outputs_whose_errors_are_nearly_the_same_lose_no_direction(rng):
    """Normal equations would: the directions are orthonormal none the less."""
    errors = rng.standard_normal((sum(LENGTHS), 1)) + 1e-6 * rng.standard_normal((sum(LENGTHS), 2))
    _, _, directions = begun(drawn(rng)).eliminated(errors, None)
    np.testing.assert_allclose(directions.T @ directions, np.eye(directions.shape[1]), atol=1e-9)
