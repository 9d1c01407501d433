"""The bound over all records within an amplitude, against all records of a few samples."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from inputdesign_cli.design.convex.designs import Design, solve_design
from inputdesign_cli.design.convex.record_bound import bound_over_records
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.signal.flips import FlipSearch, PlantGoal
from inputdesign_cli.specification import Spec

ERROR = {"model_error": {"relative": 0.2, "band": [0.02, 2.5], "alpha": 3}}


def designed(plant, samples, accuracy, objective="best_accuracy", **more) -> Design:
    """Return the design over every spectrum within |u| <= 1."""
    spec = Spec.model_validate(
        {
            "plant": plant,
            "noise": {"variance": 1.0},
            "experiment": {"samples": samples},
            "objective": objective,
            "limits": {"amplitude": {"input": 1.0}},
            "accuracy": accuracy,
            "spectrum": {"type": "free"},
            **more,
        }
    )
    return solve_design(build_convex(spec).asked.question, tolerance=1e-6)


def worst_of(design: Design, samples: int) -> PlantGoal:
    """Return what ranks records of this length."""
    plant = FiniteRecord(replace(design.problem.experiment, samples=samples), samples)
    return PlantGoal(plant, design.problem.requirements)


def best_of_all(goal: PlantGoal, values: int, hold: int = 1) -> float:
    """Return the least ratio of all records of two levels; the first value is one, as -u is as good as u."""
    ratios = [
        goal.worst(goal.plant.information(np.repeat(np.array((1.0, *rest)), hold)[:, None]))
        for rest in product((-1.0, 1.0), repeat=values - 1)
    ]
    return min(ratios)


PLANTS = [
    ({"B": [0, 0.63], "F": [1, -0.87]}, ERROR),
    ({"B": [0, -2.7, 1.8], "F": [1, 0.32, 0.38]}, {"criterion": "D"}),
    ({"B": [0, 1.3], "F": [1, 0.4]}, {"criterion": "A"}),
    ({"B": [0, 1.3], "A": [1, 0.4]}, {"criterion": "E"}),
]


@pytest.mark.parametrize(("plant", "accuracy"), PLANTS)
def test_no_record_is_better_and_the_search_finds_the_best(plant, accuracy):
    samples = 10
    design = designed(plant, samples, accuracy)
    assert design.any_spectrum is not None
    bound = bound_over_records(design.problem, design.any_spectrum, samples, windows=8)
    assert bound is not None
    goal = worst_of(design, samples)
    best = best_of_all(goal, samples)
    assert np.sqrt(bound.bound) <= best * (1.0 + 1e-9)
    assert bound.bound >= design.any_spectrum.certificate.bound * (1.0 - 1e-6)

    rng = np.random.default_rng(0)
    starts = [bound.best, *(np.sign(rng.standard_normal((samples, 1))) for _ in range(4))]
    search = FlipSearch([goal], np.array([[-1.0], [1.0]]), samples)
    record, ratio = search.best(starts, rng, enough=0.0, over=lambda: False, changes=20)
    assert ratio == pytest.approx(best, rel=1e-9)
    assert goal.worst(goal.plant.information(record)) == pytest.approx(ratio, rel=1e-9)


def test_held_values_have_a_bound_of_their_own():
    hold, values = 3, 8
    design = designed({"B": [0, 0.4], "F": [1, -0.9]}, hold * values, ERROR)
    assert design.any_spectrum is not None
    bound = bound_over_records(design.problem, design.any_spectrum, hold * values, windows=8, hold=hold)
    assert bound is not None
    best = best_of_all(worst_of(design, hold * values), values, hold)
    assert 0.6 * best <= np.sqrt(bound.bound) <= best * (1.0 + 1e-9)


def test_fewer_samples_than_the_bound_do_not_suffice():
    relative = {"model_error": {"relative": 1.0, "band": [0.02, 2.5], "alpha": 3}}
    design = designed({"B": [0, 1.0], "F": [1, -0.5]}, 9, relative, "shortest_experiment")
    assert design.any_spectrum is not None
    bound = bound_over_records(design.problem, design.any_spectrum, 9, windows=6)
    assert bound is not None
    fewer = int(bound.bound) - 1
    assert 4 <= fewer <= 12
    factor = designed({"B": [0, 1.0], "F": [1, -0.5]}, fewer, relative)
    assert best_of_all(worst_of(factor, fewer), fewer) > 1.0


def test_two_inputs():
    plant = {"B": [[[0, 1.0], [0, 0.5]]], "F": [[[1, -0.5], [1, 0.3]]]}
    design = designed(plant, 6, {"criterion": "D"})
    assert design.any_spectrum is not None
    bound = bound_over_records(design.problem, design.any_spectrum, 6, windows=4)
    assert bound is not None
    goal = worst_of(design, 6)
    letters = np.array(list(product((-1.0, 1.0), repeat=2)))
    best = min(goal.worst(goal.plant.information(np.array(u))) for u in product(letters, repeat=6))
    assert np.sqrt(bound.bound) <= best * (1.0 + 1e-9)


def test_a_reference_figure_of_the_window_bound():
    """Plant 6 of the eight output-error plants: 0.2834 by the power, 0.2977 by windows of twelve values."""
    plant = {"B": [0, -2.853291838457013], "F": [1, -0.5059625218880031]}
    design = designed(plant, 300, ERROR)
    assert design.any_spectrum is not None
    bound = bound_over_records(design.problem, design.any_spectrum, 300, windows=8)
    assert bound is not None
    assert np.sqrt(design.any_spectrum.certificate.bound) == pytest.approx(0.2834, abs=5e-5)
    assert np.sqrt(bound.bound) == pytest.approx(0.2977, abs=4e-4)


def test_a_record_shorter_than_the_longest_run_is_searched():
    design = designed({"B": [0, 1.3], "F": [1, 0.4]}, 5, {"criterion": "D"})
    goal = worst_of(design, 5)
    start = np.ones((5, 1))
    search = FlipSearch([goal], np.array([[-1.0], [1.0]]), 5)
    _, found = search.best([start], np.random.default_rng(0), enough=0.0, over=lambda: False, changes=20)
    assert found == pytest.approx(best_of_all(goal, 5), rel=1e-9)


@pytest.mark.parametrize("more", [{"experiment": {"samples": 50, "controller": {"numerator": [0.2]}}}])
def test_there_is_none_in_a_loop(more):
    design = designed({"B": [0, 0.63], "F": [1, -0.5]}, 50, ERROR, **more)
    assert design.any_spectrum is not None
    assert bound_over_records(design.problem, design.any_spectrum, 50, windows=8) is None
