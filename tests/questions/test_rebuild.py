"""`Rebuild` builds a design question again at an estimate, and it alone keeps the spec for that."""

import ast
import pickle
from pathlib import Path

import numpy as np
import pytest

import inputdesign_cli
from inputdesign_cli import parse_spec
from inputdesign_cli.errors import SpecError
from inputdesign_cli.questions.building.rebuild import Change, Rebuild
from inputdesign_cli.questions.building.system import build_experiment, build_model
from tests.support.campaigns import SPEC

KNOWN = "uncertainty={intervals: {b1: [3, 4]}, scenarios: 10, fresh: 0}"


def rebuilt(change, *overrides, theta=None):
    spec = parse_spec(SPEC, overrides=[KNOWN, "solver.any_spectrum=true", *overrides])
    model = None if theta is None else build_model(spec).at(np.array(theta), np.array([[1.2]]))
    return Rebuild(spec, lambda spec: spec).at(model, change)


def test_without_a_change_a_rebuilt_experiment_differs_only_in_its_model():
    spec = parse_spec(SPEC)
    again = Rebuild(spec, build_experiment)
    model = build_model(spec).at(np.array([3.4, -0.73]), np.array([[1.2]]))
    experiment = again.at(model)
    assert np.array_equal(experiment.model.theta, model.theta)
    assert np.array_equal(experiment.model.covariance, model.covariance)
    assert (experiment.samples, experiment.prior) == (200, None)
    assert np.array_equal(again.at(None).model.theta, [3.6, -0.7])
    with pytest.raises(SpecError):
        again.at(model.at(np.array([3.4, -1.2])))


def test_each_change_sets_its_keys_of_the_spec_and_leaves_the_others():
    """The values are those that a user would write; other keys stay as the spec has them."""
    plain = rebuilt(Change(120, 5))
    assert (plain.experiment.samples, plain.signal.seed, plain.campaign) == (120, 5, None)
    assert (plain.uncertainty, plain.signal.scale, plain.solver.any_spectrum) == (None, None, False)
    assert (plain.spectrum.order, plain.accuracy) == (4, parse_spec(SPEC).accuracy)
    assert rebuilt(Change(120, 5, white=True)).spectrum.type == "white"
    assert rebuilt(Change(120, 5, goes_on=True)).signal.scale == "design"
    assert rebuilt(Change(120, 5, goes_on=True), "signal.scale=target").signal.scale == "target"
    best = Change(120, 5, best=True)
    assert rebuilt(best, "limits.input_power=2").goal == "best_accuracy"
    assert set(rebuilt(Change(120, 5, uncertainty="stated")).uncertainty.intervals) == {"b1"}


def test_the_uncertainty_from_data_replaces_that_of_the_spec():
    information = np.array([[2e2, -1e3], [-1e3, 2e4]])
    spec = rebuilt(Change(120, 5, information=information, uncertainty="data"), theta=[3.4, -0.73])
    assert np.array_equal(spec.experiment.prior.information, information)
    assert np.array_equal(spec.uncertainty.information, information)
    assert (spec.uncertainty.intervals, spec.uncertainty.scenarios) == (None, 10)


def test_a_rebuild_can_be_pickled():
    again = pickle.loads(pickle.dumps(Rebuild(parse_spec(SPEC), build_experiment)))
    assert again.at(None).samples == 200


def test_only_rebuild_and_uncertain_plant_have_a_field_for_the_spec():
    root = Path(inputdesign_cli.__file__).parent / "questions"
    fields = [
        (node.name, line.annotation)
        for path in root.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef)
        for line in node.body
        if isinstance(line, ast.AnnAssign)
    ]
    assert len(fields) > 100
    assert {name for name, annotation in fields if ast.unparse(annotation) == "Spec"} == {
        "Rebuild",
        "UncertainPlant",  # it exists while a question is built, when plants are drawn
    }
