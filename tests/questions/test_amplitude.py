"""Two-level records within an amplitude: lower bound, distance to it, and proofs of infeasibility."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.signal.prbs import pseudo_random
from tests.support.refusals import refusals

B, F = 1.2, -0.6
ROUGH = "{model_error: {relative: 0.4, band: [0.02, 2.5], alpha: 3}}"
W = np.geomspace(0.02, 2.5, 4000)


def asked(**more):
    keys = {
        "plant": f"{{B: [0, {B}], F: [1, {F}]}}",
        "noise": "{variance: 1.0}",
        "experiment": "{samples: 60}",
        "objective": "best_accuracy",
        "limits": "{amplitude: 1}",
        "accuracy": "{model_error: {relative: 0.2, band: [0.02, 2.5], alpha: 3}}",
        "spectrum": "{type: free}",
        "signal": "{type: binary, seconds: 0.1}",
        "solver": "{windows: 8}",
    }
    return parse_spec("\n".join(f"{key}: {value}" for key, value in {**keys, **more}.items()))


def ratio(u, relative=0.2):
    """The largest r_u/r_adm of a record from rest by a textbook formula on a grid."""
    rows = [
        scipy.signal.lfilter([0, 1], [1, F], u),
        scipy.signal.lfilter([0, 0, -B], np.convolve([1, F], [1, F]), u),
    ]
    covariance = np.linalg.inv(np.array(rows) @ np.array(rows).T)
    q = np.exp(-1j * W)
    slopes = np.stack([q / (1 + F * q), -B * q**2 / (1 + F * q) ** 2], axis=1)
    parts = np.stack([slopes.real, slopes.imag], axis=1)
    spread = np.linalg.eigvalsh(parts @ covariance @ parts.transpose(0, 2, 1))[:, -1]
    return float(np.max(3 * np.sqrt(spread) / (relative * np.abs(B * q / (1 + F * q)))))


def test_a_binary_record_is_within_8_percent_of_its_bound_and_beats_25_prbs():
    results = solve(asked())
    objective, signal, u = results.result["objective"], results.result["signal"], results.signal[:, 0]
    assert set(np.abs(u)) == {1.0}
    assert ratio(u) == pytest.approx(signal["worst_ratio"], rel=1e-4)
    assert objective["any_spectrum_bound"] < objective["any_record_bound"] < signal["worst_ratio"]
    further = signal["worst_ratio"] / objective["any_record_bound"] - 1
    assert signal["distance_to_best"] == pytest.approx(further, abs=1e-9)
    assert further < 0.08
    rng = np.random.default_rng(1)
    for clock, bits in product((1, 2, 3, 4, 6), range(2, 7)):
        sequence = np.repeat(pseudo_random(bits, 60, rng), clock)[:60]
        assert signal["worst_ratio"] <= ratio(sequence) * (1 + 1e-6)


def test_a_record_of_six_held_values_is_the_best_of_all_sign_patterns():
    results = solve(asked(experiment="{samples: 24}", signal="{type: binary, hold: 4, seconds: 0.1}"))
    u = results.signal[:, 0].reshape(-1, 4)
    assert np.all(u == u[:, :1])
    every = [ratio(np.repeat((1.0, *rest), 4)) for rest in product((-1.0, 1.0), repeat=5)]
    assert ratio(u.ravel()) == pytest.approx(min(every), rel=1e-6)
    assert results.result["objective"]["any_record_bound"] <= ratio(u.ravel())


def test_the_cheapest_record_just_meets_the_accuracy_and_states_its_distance():
    more = {"experiment": "{samples: 200}", "objective": "least_cost", "cost": "{input_power: 1}"}
    results = solve(asked(**more))
    objective, u = results.result["objective"], results.signal[:, 0]
    assert ratio(u) == pytest.approx(1.0, abs=1e-5)
    cost = np.mean(u**2)
    assert objective["any_record_bound"] <= cost
    assert results.result["signal"]["distance_to_best"] == pytest.approx(
        cost / objective["any_record_bound"] - 1, rel=1e-6
    )


@pytest.mark.slow
def test_the_shortest_record_is_no_shorter_than_the_bound_and_meets_the_accuracy():
    results = solve(asked(experiment="{samples: 9}", objective="shortest_experiment", accuracy=ROUGH))
    least, u = results.result["objective"]["any_record_bound"], results.signal[:, 0]
    assert ratio(u, 0.4) <= 1.0 + 1e-6
    assert least <= len(u) <= 1.2 * least
    assert results.result["signal"]["distance_to_best"] == pytest.approx(len(u) / least - 1)


@pytest.mark.slow
def test_an_accuracy_that_no_record_reaches_is_refused_with_the_least_length():
    more = {"objective": "least_cost", "cost": "{input_power: 1}", "accuracy": ROUGH}
    with pytest.raises(InfeasibleError) as refused:
        solve(asked(experiment="{samples: 25}", **more))
    message = refused.value.diagnostics[0].message
    assert refused.value.diagnostics[0].code == "limits-too-tight"
    least = int(message.split("; ")[-1].split()[0])
    assert 26 <= least <= 32


@pytest.mark.parametrize(
    "more",
    [
        {"limits": "{input_power: 1}"},
        {"limits": "{amplitude: 1}", "solver": "{windows: 0}"},
        {"experiment": "{samples: 60, controller: {numerator: [0.2]}}"},
        {
            "plant": "{B: [0, 0.1], F: [1, -1], known: [f1]}",
            "limits": "{amplitude: 1, band: [0.05, 3]}",
            "accuracy": "{standard_deviation: {b1: 0.01}}",
        },
    ],
)
def test_no_record_bound_is_stated_in_loops_for_integrators_or_without_amplitude(more):
    result = solve(asked(**{"signal": "{type: binary}", **more})).result
    assert "any_record_bound" not in result["objective"]
    assert "distance_to_best" not in result["signal"]
    assert result["signal"]["samples"] == 60


def moves(u):
    return int(np.count_nonzero(np.diff(u, prepend=0.0)))


@pytest.mark.first(3)
@pytest.mark.parametrize(
    ("limit", "most"), [("8", 8), ("{per_hour: 600}", 10), ("{per_hour: 60}", 1), ("200", 200)]
)
def test_a_record_has_no_more_moves_than_allowed(limit, most):
    """60 samples of one second last a minute, so 600 moves per hour allow 10."""
    results = solve(asked(limits=f"{{amplitude: 1, moves: {limit}}}", solver="{windows: 4}"))
    u, signal = results.signal[:, 0], results.result["signal"]
    assert moves(u) <= most
    assert signal["moves"]["count"] == moves(u)
    changes = [*np.flatnonzero(np.diff(u, prepend=0.0)), len(u)]
    assert signal["moves"]["shortest_dwell"] == min(np.diff(changes))
    assert signal["moves"]["largest"] == pytest.approx([2.0 if moves(u) > 1 else 1.0])
    if most > 1:
        assert ratio(u) == pytest.approx(signal["worst_ratio"], rel=1e-4)


@pytest.mark.first(1)
@pytest.mark.parametrize("returns", [True, False])
def test_the_best_record_with_at_most_four_moves_is_found(returns):
    """All two-level records of 12 samples with at most four moves are enumerated."""
    spec = asked(
        experiment="{samples: 12}",
        limits="{amplitude: 1, moves: 4}",
        solver="{windows: 4}",
        signal=f"{{type: binary, seconds: 0.1, return: {str(returns).lower()}}}",
    )
    found = solve(spec).signal[:, 0]
    free = 12 - returns
    every = (np.array([1.0, *rest, *[0.0] * returns]) for rest in product((-1.0, 1.0), repeat=free - 1))
    best = min(ratio(u) for u in every if moves(u) <= 4)
    assert moves(found) <= 4
    assert ratio(found) == pytest.approx(best, rel=1e-6)


@pytest.mark.parametrize(
    ("more", "code"),
    [
        ({"limits": "{amplitude: 1, moves: {per_hour: 30}}"}, "out-of-range"),
        ({"limits": "{amplitude: 1, moves: 1}", "signal": "{type: binary, return: true}"}, "out-of-range"),
        *(
            (more, "not-supported")
            for more in (
                {"signal": "{type: filtered_noise}"},
                {"signal": "{type: prbs}"},
                {"signal": "{type: binary, samples: 30}"},
                {"signal": "{type: binary, periods: 2}"},
                {"solver": "{windows: 0}"},
                {"solver": "{any_spectrum: false}"},
                {"limits": "{amplitude: {output: 1}, moves: 8}"},
                {"experiment": "{samples: 60, controller: {numerator: [0.2]}}"},
                {"objective": "shortest_experiment", "accuracy": ROUGH},
                {"objective": "least_cost", "cost": "{output_power: 1}", "accuracy": ROUGH},
            )
        ),
    ],
)
def test_a_limit_on_moves_is_refused_where_no_search_supports_it(more, code):
    """Limits that leave no move are out of range."""
    found = refusals(lambda: solve(asked(**{"limits": "{amplitude: 1, moves: 8}", **more})))[0]
    assert (found.code, found.key) == (code, "limits.moves")


RETURNING = [(kind, "") for kind in ("binary", "prbs", "filtered_noise", "multisine", "ternary")]
RETURNING += [(kind, ", rate: 0.5") for kind in ("slewed", "multisine", "ternary", "filtered_noise")]
RETURNING += [(kind, ", rate: 0.5") for kind in ("binary", "prbs")]


@pytest.mark.first(5)
@pytest.mark.parametrize(("kind", "rate"), RETURNING)
def test_a_record_that_returns_ends_at_the_operating_point(kind, rate):
    spec = asked(
        experiment="{samples: 40}",
        solver="{windows: 4}",
        limits=f"{{amplitude: 1{rate}}}",
        signal=f"{{type: {kind}, return: true, offset: 45, seconds: 0.2, candidates: 1}}",
    )
    results = solve(spec)
    u = results.signal[:, 0] - 45.0
    assert abs(u[-1]) < 1e-12
    assert np.max(np.abs(u)) <= 1.0 + 1e-9
    assert ratio(u) == pytest.approx(results.result["signal"]["worst_ratio"], rel=1e-3)
    if rate:
        assert np.max(np.abs(np.diff(u, prepend=0.0))) <= 0.5 + 1e-9


def test_the_table_of_steps_reproduces_the_record(tmp_path):
    results = solve(
        asked(signal="{type: binary, hold: 3, seconds: 0.1, export: [step_table]}", solver="{windows: 4}")
    )
    steps, u = results.tables["steps"].columns, results.signal[:, 0]
    at = np.searchsorted(steps["time_s"], np.arange(60.0), side="right") - 1
    assert np.array_equal(steps["u1"][at], u)
    assert np.all(np.diff(steps["u1"]) != 0.0)


@pytest.mark.parametrize(
    ("pole", "samples", "hold"), [(0.98, 300, 4), (0.6, 300, 1), (0.99, 60, 1), (0.999, 500, 10)]
)
def test_hold_auto_is_a_tenth_of_the_slowest_time_constant_of_the_plant(pole, samples, hold):
    """The hold leaves at least fifty values; poles of the noise do not count."""
    spec = asked(
        plant=f"{{B: [0, 1], F: [1, -{pole}]}}",
        experiment=f"{{samples: {samples}}}",
        signal="{type: binary, hold: auto, seconds: 0.1}",
        accuracy="{criterion: D}",
    )
    assert build_convex(spec).record.settings.hold == hold
    coloured = spec.revised({"noise": {"variance": 1.0, "D": [1, -0.995]}})
    assert build_convex(coloured).record.settings.hold == hold


def test_the_cheapest_record_of_few_moves_costs_as_much_as_the_scaled_best_one():
    limits, accuracy = (
        "{amplitude: 3, moves: 12}",
        "{model_error: {relative: 0.4, band: [0.02, 2.5], alpha: 3}}",
    )
    least = solve(asked(objective="least_cost", cost="{input_power: 1}", limits=limits, accuracy=accuracy))
    best = solve(asked(limits=limits, accuracy=accuracy))
    u = least.signal[:, 0]
    assert moves(u) <= 12
    assert ratio(u, 0.4) == pytest.approx(1.0, abs=1e-5)
    needed = 9.0 * best.result["signal"]["worst_ratio"] ** 2
    assert np.mean(u**2) == pytest.approx(needed, rel=0.1)
