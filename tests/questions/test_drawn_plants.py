"""The plants that `uncertainty` draws or lists: what is drawn again, and what is refused."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.errors import SpecError
from inputdesign_cli.questions import build_task
from inputdesign_cli.questions.least_cost.build import build_convex
from tests.support.robust_specs import COVARIANCE, FIRST, LOOP, PHYSICAL, PROCESS


@pytest.mark.first(1)
@pytest.mark.parametrize(
    "prior",
    [
        f"covariance: {COVARIANCE}",
        "information: [[100, 0, 0], [0, 1000, 0], [0, 0, 2500]]",
        "covariance: [[0.01, 0], [0, 0.0004]], parameters: [b1, f1]",
        "intervals: {b1: [3.3, 3.9], f1: [-0.75, -0.65]}",
    ],
)
def test_plants_are_drawn_from_what_is_known(prior):
    spec = parse_spec(FIRST, overrides=[f"uncertainty={{{prior}, scenarios: 150}}"])
    thetas = build_convex(spec).asked.plants.batch.thetas
    assert thetas.shape == (150, 3)
    mean, spread = thetas.mean(axis=0), thetas.std(axis=0)
    assert mean == pytest.approx([3.6, -0.9, -0.7], abs=0.03)
    b1, c1, f1 = (0.1, 0.0316, 0.02) if "intervals" not in prior else (0.1732, 0.0, 0.02887)
    assert spread == pytest.approx([b1, 0.0 if "b1, f1" in prior else c1, f1], rel=0.2)
    again = build_convex(spec).asked.plants.batch.thetas
    np.testing.assert_array_equal(thetas, again)


def test_a_record_and_a_model_file_tell_how_well_the_plant_is_known(tmp_path):
    rng = np.random.default_rng(1)
    np.savetxt(tmp_path / "first.csv", rng.normal(size=400), header="u", comments="")
    (tmp_path / "model.yaml").write_text(
        "estimate: {parameters: {b1: 3.6, c1: -0.9, f1: -0.7}, covariance: " + COVARIANCE + "}"
    )
    for asked in ("information: first.csv", "covariance: model.yaml", "information: model.yaml"):
        spec = parse_spec(FIRST, overrides=[f"uncertainty={{{asked}, scenarios: 100}}"], folder=tmp_path)
        thetas = build_convex(spec).asked.plants.batch.thetas
        if "model" in asked:
            assert thetas.std(axis=0) == pytest.approx([0.1, 0.0316, 0.02], rel=0.2)
        else:
            # White input of power one: the variance of b1 is about that of a mean of 400 samples or more.
            assert 0.02 < thetas[:, 0].std() < 0.2
    moved = "estimate: {parameters: {b1: 4.6, c1: -0.9, f1: -0.7}, covariance: " + COVARIANCE + "}"
    (tmp_path / "model.yaml").write_text(moved)
    spec = parse_spec(FIRST, overrides=["uncertainty={covariance: model.yaml}"], folder=tmp_path)
    with pytest.raises(SpecError, match=r"b1 is 4\.6 there and 3\.6 here"):
        build_task(spec)


def test_the_risk_sets_the_number_of_plants():
    for order, risk, number in ((10, 0.1, 235), (6, 0.2, 85)):
        asked = f"uncertainty={{covariance: {COVARIANCE}, risk: {risk}}}"
        spec = parse_spec(FIRST, overrides=[asked, f"spectrum.order={order}"])
        assert len(build_convex(spec).asked.plants.batch.plants) == number


@pytest.mark.parametrize(
    ("text", "intervals", "name"),
    [(PROCESS, "dead_time: [-1, 4]", "dead_time"), (PHYSICAL, "K: [-1, 3]", "K")],
)
def test_what_is_no_plant_is_drawn_again_and_counted(text, intervals, name):
    """A fifth of the interval is a negative dead time; the root of a negative number is no gain."""
    prior = f"uncertainty={{intervals: {{{intervals}}}, scenarios: 40, seed: 1}}"
    batch = build_convex(parse_spec(text, overrides=[prior])).asked.plants.batch
    assert len(batch.plants) == 40
    assert 2 <= batch.rejected <= 25
    index = batch.plants[0].experiment.model.names.index(name)
    assert np.all(batch.thetas[:, index] >= 0.0)


def test_unstable_loops_are_drawn_again_and_counted():
    """In this loop f1 < -1.02 or so is unstable."""
    prior = "intervals: {f1: [-1.2, -0.6]}, scenarios: 60, seed: 3"
    batch = build_convex(parse_spec(LOOP, overrides=[f"uncertainty={{{prior}}}"])).asked.plants.batch
    assert len(batch.plants) == 60
    assert batch.rejected > 0
    for plant in batch.plants:
        assert np.abs(plant.experiment.loop.closed_poles).max() < 0.9981
