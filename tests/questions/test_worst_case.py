"""`uncertainty.worst_case`: the worst plant of a region, searched and served."""

import json

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.questions.building.uncertainty import build_plants
from inputdesign_cli.questions.common.robust import Batch, tried_on
from inputdesign_cli.questions.least_cost.build import build_convex
from tests.support.robust_specs import COVARIANCE, FIRST, LOOP, solved


def test_of_an_interval_the_end_that_asks_for_most_is_found():
    """A faster pole asks for more power: the worst case is the design for the end of the interval."""
    found = solved(
        FIRST, "uncertainty={intervals: {f1: [-0.8, -0.5]}, scenarios: 3, fresh: 0, worst_case: 0.95}"
    )
    told = found["robust"]["searched"]
    assert told["proved"] is False
    assert told["region"] == "the intervals"
    assert told["added"] == 1
    assert told["parameters"] == pytest.approx({"b1": 3.6, "c1": -0.9, "f1": -0.5}, abs=1e-12)
    assert told["share"] == pytest.approx(1.0, abs=1e-6)
    at_the_end = solved(FIRST, "uncertainty={scenarios: [{f1: -0.5}]}")
    assert found["cost"] == pytest.approx(at_the_end["cost"], rel=1e-6)
    assert "risk" not in found["robust"]  # the plant was not drawn


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "covariance"), [(FIRST, COVARIANCE), (LOOP, "[[0.001, 0.0003], [0.0003, 4.0e-4]]")]
)
def test_no_plant_of_the_ellipsoid_is_worse_than_the_one_that_is_found(text, covariance):
    """Of 200 plants on the boundary of the ellipsoid, drawn by other means."""
    overrides = [f"uncertainty={{covariance: {covariance}, scenarios: 5, fresh: 0, worst_case: 0.9}}"]
    spec = parse_spec(text, overrides=overrides)
    task = build_convex(spec)
    done = task.designed()
    share = done.plants.searched.kept.share
    assert share <= 1.0 + 1e-3
    assert done.plants.searched.added >= 1
    covariance = np.array(json.loads(covariance))
    rng, nominal = np.random.default_rng(1), task.simulation.nominal.model.theta
    z = rng.standard_normal((200, nominal.size))
    z /= np.sqrt(np.einsum("ni,ij,nj->n", z, np.linalg.inv(covariance), z))[:, None]
    radius = {2: 4.605170, 3: 6.251389}[nominal.size] ** 0.5  # of tables of chi-squared, 90 %
    plants = build_plants(spec, task.asked.question.experiment, task.asked.question.basis)
    tried = [(theta, plants.region.at(theta)) for theta in nominal + radius * z]
    thetas, alternatives = zip(*[one for one in tried if one[1] is not None], strict=True)
    assert len(thetas) > 150
    shares = [
        one.kept.share for one in tried_on(done.design, 500, Batch(np.array(thetas), alternatives, 200))
    ]
    assert max(shares) <= share * (1 + 1e-3)
    assert max(shares) > 0.8
