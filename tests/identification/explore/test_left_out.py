"""Structures that cannot be computed are left out; limits that nothing tells are not told."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.identification.explore import by_chance, explore_structure, search


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
