"""A record that is given twice, whole or in part, is no reason to say "met"."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import assess, parse_spec
from inputdesign_cli.errors import DataError
from inputdesign_cli.findings.other_systems import shared
from inputdesign_cli.questions import explore
from inputdesign_cli.records import Preparation

SPEC = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {C: [1, -0.5], variance: 1.0}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 8}
"""


def rows_of(seed, samples=500):
    rng = np.random.default_rng(seed)
    u = 0.3 * np.sign(rng.standard_normal(samples))
    y = scipy.signal.lfilter([0, 3.6], [1, -0.7], u)
    return np.column_stack([u, y + scipy.signal.lfilter([1, -0.5], [1], rng.standard_normal(samples))])


@pytest.fixture
def saved(tmp_path):
    def save(name, rows):
        np.savetxt(tmp_path / name, rows, delimiter=",", header="u,y", comments="", fmt="%.12g")
        return tmp_path / name

    return save


def test_the_same_input_applied_twice_counts_twice(saved):
    first, second = rows_of(3), rows_of(4)
    second[:, 1] += scipy.signal.lfilter([0, 3.6], [1, -0.7], first[:, 0] - second[:, 0])
    second[:, 0] = first[:, 0]
    found = assess(parse_spec(SPEC), [saved("a.csv", first), saved("b.csv", second)])
    assert found.verdict == "met"


def with_empty_cells(rows, every):
    emptied = rows.copy()
    emptied[::every, 1] = np.nan
    return emptied


@pytest.mark.first(3)
@pytest.mark.parametrize("every", [12, 25, 60])
@pytest.mark.parametrize("options", [{}, {"preparation": Preparation(detrend="constant")}])
def test_a_copy_with_empty_cells_is_refused(every, options, saved):
    rows = rows_of(3)
    files = [saved("a.csv", rows), saved("b.csv", with_empty_cells(rows, every))]
    for given in (files, files[::-1]):
        with pytest.raises(DataError, match="hold the same samples") as caught:
            assess(parse_spec(SPEC), given, **options)
        assert caught.value.diagnostics[0].code == "data-repeated"
    with pytest.raises(DataError, match="hold the same samples"):
        explore(files)


@pytest.mark.slow
def test_a_part_with_empty_cells_leaves_the_verdict_open(saved):
    first, second = rows_of(3), rows_of(4)
    second[200:400] = with_empty_cells(first, 25)[100:300]
    found = assess(parse_spec(SPEC), [saved("a.csv", first), saved("b.csv", second)])
    assert found.verdict == "undecided"
    (told, *_) = [r for r in found.results.result["assessment"]["undecided"] if "stand in a.csv as well" in r]
    assert "192 of 492 samples of b.csv" in told


def test_rests_and_coarse_steps_come_again_by_themselves():
    """Rows that are alike by rounding, and an input that is applied twice, make no copy."""
    rng = np.random.default_rng(8)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 10)[:, None]
    y = scipy.signal.lfilter([0.2], [1, -0.8], u, axis=0)
    one, other = (np.column_stack([u, np.round(y + 0.5 * rng.standard_normal(y.shape))]) for _ in range(2))
    assert shared(one, other).mean() < 0.05
    rest = np.zeros((100, 2))
    assert not shared(np.concatenate([rest, one]), np.concatenate([rest, other[::-1]]))[:100].any()
