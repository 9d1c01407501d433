"""Models in other parameters: the chain rule against differences, and what is known takes no part."""

import numpy as np
import pytest

from inputdesign_cli.expressions import Expression
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import (
    ContinuousModel,
    Parametrisation,
    Reparametrised,
    SampledModel,
    TransferMatrix,
    close_loop,
)
from tests.support.plants import box_jenkins, descending

W = np.array([0.05, 0.4, 1.3, 2.9])


def known(model, names):
    return Reparametrised(model, Parametrisation.identity(model.names, model.theta, names))


def process(sampled=True) -> Reparametrised:
    """K e^(-Ls) / (Ts + 1) with L one fifth of T, in K and T."""
    K, T = 2.0, 3.3
    inner = ContinuousModel.monic(
        descending([[[K]]]), descending([[[T, 1.0]]]), np.eye(1), delay=((np.array([T / 5]),),)
    )
    terms = tuple(map(Expression.of, ("K/T", "1/T", "T/5")))
    at = Parametrisation(("K", "T"), ("K", "T"), np.array([K, T]), np.ones(2, dtype=bool), terms)
    return Reparametrised(SampledModel(inner, 0.7) if sampled else inner, at)


MODELS = [process(), process(sampled=False), known(box_jenkins(), ["c1[2]", "b2[1,1]", "a1"])]


@pytest.mark.parametrize("model", MODELS)
def test_gradients_are_differences(model):
    step, theta = 1e-5, model.theta
    exact = model.plant_gradient(W)
    assert exact.shape[1] == len(model.names) == theta.size
    for k in range(theta.size):
        unit = step * np.eye(theta.size)[k]
        slope = (model.at(theta + unit).plant_at(W) - model.at(theta - unit).plant_at(W)) / (2 * step)
        np.testing.assert_allclose(exact[:, k], slope, atol=1e-8)
        assert model.in_plant[k] == np.any(slope != 0.0)


def test_what_is_known_leaves_a_part_of_the_information():
    """Knowing parameters is the same as deleting their rows and columns."""
    model = box_jenkins()
    names = ["c1[2]", "b2[1,1]", "a1"]
    kept = [i for i, name in enumerate(model.names) if name not in names]
    whole, part = (Experiment(m, 100) for m in (model, known(model, names)))
    densities = [e.information_density(W) for e in (whole, part)]
    np.testing.assert_allclose(densities[1], densities[0][:, kept][:, :, kept], atol=1e-12)
    np.testing.assert_allclose(part.noise_information, whole.noise_information[np.ix_(kept, kept)], rtol=1e-9)


def test_a_loop_is_that_of_the_coefficients():
    model = process()
    C = TransferMatrix.build([[[0.1]]], [[(1.0, -1.0)]])
    loop, inner = close_loop(model, C), close_loop(model.coefficients, C)
    loop.check_stability()
    np.testing.assert_allclose(loop.closed_poles, inner.closed_poles)
    J = model.parametrisation.jacobian
    expected = np.einsum("nlpr,lk->nkpr", inner.excitation_gradient(W), J)
    np.testing.assert_allclose(loop.excitation_gradient(W), expected, atol=1e-12)


def test_a_fraction_is_affine_where_nothing_free_bends_it():
    inner = process(sampled=False).coefficients
    assert np.array_equal(inner.bends(0, 0), [False, False, True])
    assert not np.any(known(inner, ["delay"]).bends(0, 0))
    assert np.all(process(sampled=False).bends(0, 0))
    part = known(inner, ["delay"]).entry_fraction(0, 0, W)
    np.testing.assert_allclose(part.numerator / part.denominator, inner.plant_at(W)[:, 0, 0])
