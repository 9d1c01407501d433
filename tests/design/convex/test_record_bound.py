"""Bounds over all records within an amplitude, against enumeration and closed forms."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.amplitude.polytope import LagPolytope
from inputdesign_cli.design.amplitude.windows import Windows, weighted
from inputdesign_cli.design.convex.designs import Design, solve_design
from inputdesign_cli.design.convex.record_bound import bound_over_records
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.signal.flips import FlipSearch, PlantGoal
from inputdesign_cli.signal.prbs import pseudo_random
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
    """Return the goal that ranks records of this length."""
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
def test_the_bound_holds_for_all_records_and_the_search_finds_the_best(plant, accuracy):
    samples = 7
    design = designed(plant, samples, accuracy)
    bound = bound_over_records(design.problem, design.any_spectrum, samples, windows=6)
    goal = worst_of(design, samples)
    best = best_of_all(goal, samples)
    assert np.sqrt(bound.bound) <= best * (1.0 + 1e-9)
    assert bound.bound >= design.any_spectrum.certificate.bound * (1.0 - 1e-6)

    rng = np.random.default_rng(0)
    starts = [bound.best, np.sign(rng.standard_normal((samples, 1)))]
    search = FlipSearch([goal], np.array([[-1.0], [1.0]]), samples)
    record, ratio = search.best(starts, rng, enough=0.0, over=lambda: False, changes=5)
    assert ratio == pytest.approx(best, rel=1e-9)
    assert goal.worst(goal.plant.information(record)) == pytest.approx(ratio, rel=1e-9)


def test_the_bound_for_held_values_holds_for_all_records():
    hold, values = 3, 8
    design = designed({"B": [0, 0.4], "F": [1, -0.9]}, hold * values, ERROR)
    bound = bound_over_records(design.problem, design.any_spectrum, hold * values, windows=8, hold=hold)
    best = best_of_all(worst_of(design, hold * values), values, hold)
    assert 0.6 * best <= np.sqrt(bound.bound) <= best * (1.0 + 1e-9)


def test_the_bound_on_errors_falls_as_the_amplitude_grows():
    bounds = []
    for size in (1.0, 1e-14, 1e-6, 1e9):
        design = designed(PLANTS[0][0], 20, ERROR, limits={"amplitude": {"input": size}})
        found = bound_over_records(design.problem, design.any_spectrum, 20, windows=5)
        bounds.append(np.sqrt(found.bound) * size)
    assert bounds[1:] == pytest.approx([bounds[0]] * 3, rel=1e-3)


def test_fewer_samples_than_the_bound_do_not_suffice():
    relative = {"model_error": {"relative": 1.0, "band": [0.02, 2.5], "alpha": 3}}
    design = designed({"B": [0, 1.0], "F": [1, -0.5]}, 9, relative, "shortest_experiment")
    bound = bound_over_records(design.problem, design.any_spectrum, 9, windows=6)
    fewer = int(bound.bound) - 1
    assert 4 <= fewer <= 12
    factor = designed({"B": [0, 1.0], "F": [1, -0.5]}, fewer, relative)
    assert best_of_all(worst_of(factor, fewer), fewer) > 1.0


def test_the_bound_holds_for_all_records_of_two_inputs():
    plant = {"B": [[[0, 1.0], [0, 0.5]]], "F": [[[1, -0.5], [1, 0.3]]]}
    design = designed(plant, 4, {"criterion": "D"})
    bound = bound_over_records(design.problem, design.any_spectrum, 4, windows=3)
    goal = worst_of(design, 4)
    letters = np.array(list(product((-1.0, 1.0), repeat=2)))
    best = min(goal.worst(goal.plant.information(np.array(u))) for u in product(letters, repeat=4))
    assert np.sqrt(bound.bound) <= best * (1.0 + 1e-9)


def test_a_reference_figure_of_the_window_bound():
    """Plant 6 of eight output-error plants: 0.2834 by the power, 0.2977 by windows (here of eight values)."""
    plant = {"B": [0, -2.853291838457013], "F": [1, -0.5059625218880031]}
    design = designed(plant, 300, ERROR)
    bound = bound_over_records(design.problem, design.any_spectrum, 300, windows=8)
    assert np.sqrt(design.any_spectrum.certificate.bound) == pytest.approx(0.2834, abs=5e-5)
    assert np.sqrt(bound.bound) == pytest.approx(0.2977, abs=4e-4)


def test_a_record_shorter_than_the_longest_run_is_searched():
    design = designed({"B": [0, 1.3], "F": [1, 0.4]}, 5, {"criterion": "D"})
    goal = worst_of(design, 5)
    start = np.ones((5, 1))
    search = FlipSearch([goal], np.array([[-1.0], [1.0]]), 5)
    _, found = search.best([start], np.random.default_rng(0), enough=0.0, over=lambda: False, changes=5)
    assert found == pytest.approx(best_of_all(goal, 5), rel=1e-9)


def test_there_is_no_record_bound_in_closed_loop():
    more = {"experiment": {"samples": 50, "controller": {"numerator": [0.2]}}}
    design = designed({"B": [0, 0.63], "F": [1, -0.5]}, 50, ERROR, **more)
    assert bound_over_records(design.problem, design.any_spectrum, 50, windows=8) is None


def _form_of(record: Array, form: Array) -> float:
    """Return sum u_t^T Q_0 u_t + 2 sum u_t^T Q_k u_(t-k), term by term."""
    total = 0.0
    for t in range(len(record)):
        for lag in range(min(len(form), t + 1)):
            total += (1.0 if lag == 0 else 2.0) * record[t] @ form[lag] @ record[t - lag]
    return float(total)


def _random_form(length: int, inputs: int, seed: int) -> Array:
    form = np.random.default_rng(seed).standard_normal((length, inputs, inputs))
    form[0] = form[0] @ form[0].T
    return form


@pytest.mark.parametrize(
    ("inputs", "length", "samples"), [(1, 2, 5), (1, 4, 11), (1, 9, 6), (1, 5, 1), (2, 3, 5)]
)
def test_the_largest_form_agrees_with_enumerated_records(inputs: int, length: int, samples: int) -> None:
    windows = Windows.within(np.array([1.5, 0.5])[:inputs], length)
    form = _random_form(length, inputs, length)
    largest, record = windows.largest_sum(form, samples)
    every = [_form_of(np.array(letters), form) for letters in product(windows.letters, repeat=samples)]
    assert largest == pytest.approx(max(every), rel=1e-12)
    assert _form_of(record, form) == pytest.approx(largest, rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_no_cycle_has_a_larger_mean(seed: int) -> None:
    windows, form = Windows.within(np.ones(1), 3), _random_form(3, 1, seed)
    bound, cycle, _ = windows.largest_mean(form)
    means = [
        float(np.sum(weighted(form) * windows.lags(np.array(letters))))
        for period in range(1, 9)  # four states: the best cycle is no longer than four
        for letters in product(windows.letters, repeat=period)
    ]
    assert max(means) <= bound * (1.0 + 1e-12) + 1e-12
    assert float(np.sum(weighted(form) * windows.lags(cycle))) == pytest.approx(max(means), rel=1e-6)


@pytest.mark.parametrize(("c1", "c2"), [(0.3, -0.2), (-0.8, 0.1), (0.5, -0.9), (0.9, 0.9)])
def test_gauge_of_three_lags_is_the_known_polytope(c1: float, c2: float) -> None:
    """Three signs have s_1 s_2 + s_2 s_3 + s_1 s_3 >= -1, so that 1 + c_2 >= 2 |c_1|; and |c_2| <= 1."""
    polytope = LagPolytope(Windows.within(np.array([2.0]), 3))
    multiple, face = polytope.gauge(4.0 * np.array([1.0, c1, c2]).reshape(3, 1, 1))
    # The least c_0 / a^2 with c_0 + c_2 >= 2 |c_1| and c_0 >= |c_2|, c_0 >= 1.
    assert multiple == pytest.approx(max(1.0, 2.0 * abs(c1) - c2, abs(c2)), rel=1e-9)
    assert face.share == pytest.approx(multiple, rel=1e-4)


def test_no_signal_exceeds_a_face() -> None:
    rng = np.random.default_rng(3)
    polytope = LagPolytope(Windows.within(np.array([1.0, 2.0]), 4))
    w = 0.7
    lags = np.array([np.cos(k * w) * np.array([[1.0, 1.0], [1.0, 4.0]]) for k in range(4)])
    multiple, face = polytope.gauge(lags)
    assert multiple > 1.1
    for _ in range(200):
        signal = polytope.windows.letters[rng.integers(4, size=int(rng.integers(1, 30)))]
        assert np.sum(weighted(face.form) * polytope.windows.lags(signal)) <= 1.0 + 1e-9


def output_error_plant(rng):
    """A random plant with one or two poles of moduli up to 0.9."""
    order = int(rng.integers(1, 3))
    poles = rng.uniform(0.2, 0.9, order) * rng.choice([-1.0, 1.0], order)
    if order == 2 and rng.random() < 0.5:
        poles = poles[0] * np.exp(1j * rng.uniform(0.2, 2.8) * np.array([1.0, -1.0]))
    return {"B": [0.0, *rng.standard_normal(order).tolist()], "F": np.real(np.poly(poles)).tolist()}


def test_the_search_starts_from_the_best_pseudo_random_sequences():
    """Registers of 2 to 9 bits at four clocks are ranked; a record may hold only a part of the sequence."""
    design = designed(PLANTS[0][0], 30, ERROR)
    goal = worst_of(design, 30)
    search = FlipSearch([goal, goal], np.array([[-1.0], [1.0]]), 30)
    rng = np.random.default_rng(2)
    starts = [
        np.repeat(pseudo_random(bits, -(-30 // clock), rng), clock)[:30, None]
        for clock in (1, 2, 3, 5)
        for bits in range(2, 10)
    ]
    every = sorted(goal.worst(goal.plant.information(u)) for u in starts)
    ranked = [goal.worst(goal.plant.information(u)) for u in search.ranked(starts, 4)]
    assert ranked == pytest.approx(every[:4], rel=1e-9)


@pytest.mark.slow
def test_the_search_finds_the_best_of_all_records_of_most_plants():
    """All 2^9 records of ten samples are ranked on a grid, and the best 20 at every frequency."""
    samples, found = 10, 0
    every = np.array([(1.0, *rest) for rest in product((-1.0, 1.0), repeat=samples - 1)])
    for seed in range(50):
        plant = output_error_plant(np.random.default_rng(seed))
        design = designed(plant, samples, ERROR)
        bound = bound_over_records(design.problem, design.any_spectrum, samples, windows=8)
        goal = worst_of(design, samples)
        pulses = [goal.plant.gradient(np.eye(samples)[:, [k]]) for k in range(samples)]
        psi = np.tensordot(every, np.array(pulses).reshape(samples, samples, -1), axes=1)
        rows = design.problem.requirements[0].rows(np.geomspace(0.02, 2.5, 60))
        covariances = np.linalg.inv(goal.plant.known + psi.swapaxes(1, 2) @ psi)
        rough = np.linalg.norm(np.einsum("wqi,rij,wpj->rwqp", rows, covariances, rows), 2, axis=(2, 3))
        few = every[np.argsort(rough.max(axis=1))[:20]]
        best = min(goal.worst(goal.plant.information(u[:, None])) for u in few)
        assert np.sqrt(bound.bound) <= best * (1.0 + 1e-9)
        rng = np.random.default_rng(seed)
        starts = [bound.best, *(np.sign(rng.standard_normal((samples, 1))) for _ in range(8))]
        search = FlipSearch([goal], np.array([[-1.0], [1.0]]), samples)
        _, ratio = search.best(starts, rng, enough=best * (1.0 + 1e-9), over=lambda: False, changes=30)
        found += ratio <= best * (1.0 + 1e-6)
    assert found >= 45, found
