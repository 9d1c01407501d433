"""Structures that cannot be computed are left out; limits that nothing tells are not told."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.errors import SpecError
from inputdesign_cli.explore import by_chance, delays, explore_records, explore_structure, search


@pytest.fixture(scope="module")
def parts():
    rng = np.random.default_rng(4)
    u = np.repeat(rng.choice([-1.0, 1.0], 40), 5)
    y = scipy.signal.lfilter([0.0, 0.0, 0.2], [1.0, -0.8], u) + 0.05 * rng.standard_normal(200)
    u, y = u[:, None], y[:, None]
    return [(u[:120], y[:120])], [(u[120:], y[120:])]


@pytest.mark.parametrize("fault", [FloatingPointError, RuntimeWarning, ZeroDivisionError])
def test_what_arithmetic_says_against_one_structure_leaves_the_others(fault, parts, monkeypatch):
    calls = []
    plain = search.search

    def failing(*args, **kwargs):
        calls.append(1)
        if len(calls) % 3 == 1:
            raise fault("divide by zero encountered in scalar divide")
        return plain(*args, **kwargs)

    monkeypatch.setattr(search, "search", failing)
    found = explore_structure(*parts, physical=False)
    assert 0 < len(found.candidates) < len(calls)
    assert found.best.orders.delays == (2,)


def test_of_no_samples_chance_explains_all():
    assert by_chance(0, 3, 20) == 100.0


def test_a_delay_beyond_the_record_is_no_limit(parts):
    found = explore_structure(*parts, physical=False)
    told = [found.ranges(replace(found.best, ranges=((1, high),))) for high in (7, 120, 121, 1_000_001)]
    assert told == [((1, 7),), ((1, 120),), ((1, None),), ((1, None),)]


def test_a_dead_time_that_has_run_off_to_where_nothing_answers_is_no_plant(parts):
    """Unknown inputs before the record would explain all that comes until then, at the price of hours."""
    found = explore_structure(*parts)
    in_s = [c for c in found.candidates if c.orders.family == "FOPDT" and not c.orders.coloured]
    assert in_s
    assert all(max(c.orders.delays) <= c.latest < 80 for c in in_s)
    K, T, L = in_s[0].theta
    near = in_s[0].estimated(np.array([K, T, L + 1.0]), np.eye(1))
    np.testing.assert_array_equal(near.theta, [K, T, L + 1.0])
    with pytest.raises(ArithmeticError, match="run off"):
        in_s[0].estimated(np.array([K, T, in_s[0].latest + 0.5]), np.eye(1))


@pytest.mark.parametrize("samples", [1, 29])
def test_records_that_are_too_short_are_told_so_whatever_stands_in_them(samples):
    signal = np.ones((samples, 1))
    with pytest.raises(SpecError) as caught:
        explore_records([(signal, signal)], feedback=False, step=1.0, ramp=False)
    assert caught.value.diagnostics[0].code == "too-few-samples"


@pytest.mark.parametrize(("late", "most"), [(70, 80), (10, 40)])
def test_delays_at_the_limit_of_those_that_are_tried_are_looked_for_beyond_it(late, most):
    """High orders turn the phase as a longer delay does: by 40 samples at most they stood for 70."""
    rng = np.random.default_rng(7)
    u = np.stack([np.repeat(rng.choice([-1.0, 1.0], 60), 4), np.repeat(rng.choice([-1.0, 1.0], 20), 12)], 1)
    y = scipy.signal.lfilter([0.0, 0.0, 0.0, 0.2], [1.0, -0.9], u[:, 0])
    y += scipy.signal.lfilter(np.append(np.zeros(late + 1), 0.15), [1.0, -0.85], u[:, 1])
    parts = [(u, (y + 0.1 * rng.standard_normal(240))[:, None])]
    quick = delays._quick(parts, 3, 40, (1, 1), (0, 0))
    found, longest = delays._beyond_limit(parts, quick, 40, 100, (0, 0))
    assert longest == most
    np.testing.assert_allclose(found[1].delays, (3, late + 1), atol=1)
