from dataclasses import dataclass

import numpy as np
import pytest

from inputdesign_cli.identification import fit_batch, identify
from inputdesign_cli.identification.estimators import estimator
from tests.support.identification_systems import SYSTEMS, data


@dataclass(frozen=True)
class Renamed:
    """A kind of model from outside the package: a polynomial one by another name."""

    inner: object


def test_a_kind_of_model_without_an_estimator_is_no_surprise():
    with pytest.raises(TypeError, match="object"):
        identify(object(), np.ones((10, 1)), np.ones((10, 1)))


def test_a_new_kind_of_model_brings_its_estimator():
    estimator.register(Renamed, lambda model, step: estimator(model.inner, step))
    model = SYSTEMS["oe"]
    u, y = data("oe", 200, np.random.default_rng(1), runs=2)
    np.testing.assert_array_equal(
        identify(Renamed(model), u[0], y[0]).theta, identify(model, u[0], y[0]).theta
    )
    found = fit_batch(Renamed(model), u, y, start=model.theta)
    np.testing.assert_array_equal(found.theta, fit_batch(model, u, y, start=model.theta).theta)
