"""Whole periods of records with gaps: as many as fit between the gaps, all of the same phase."""

from itertools import pairwise

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings, strategies as st

from inputdesign_cli import identify, parse_spec, solve
from inputdesign_cli.errors import DataError
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.questions.frequency_response.measure import whole_periods
from inputdesign_cli.records import Record
from tests.support.refusals import code_of

PERIOD = 20


def record(pieces, *, step=1.0, files=1):
    """A record of pieces (first, last + 1), repeated in each file; u holds the numbers of the samples."""
    at = np.concatenate([np.arange(first, last) for first, last in pieces] * files)
    lengths = tuple(last - first for first, last in pieces) * files
    named = tuple((f"{i}.csv", len(at) // files) for i in range(files))
    u = at[:, None].astype(float)
    return Record(u=u, y=u**2, r=None, time=7.0 + step * at, lengths=lengths, files=named)


def most_by_trial(pieces, skip):
    """The largest number of periods in the pieces after the transient, over all phases."""
    counts = []
    for phase in range(PERIOD):
        starts = np.arange(phase, 2000, PERIOD)
        counts.append(
            sum(
                first <= start and start + PERIOD <= last and start >= skip * PERIOD + pieces[0][0]
                for start in starts
                for first, last in pieces
            )
        )
    return max(counts)


@settings(deadline=None, max_examples=40)
@given(
    gaps=st.sets(st.integers(5, 190), min_size=1, max_size=4),
    skip=st.integers(0, 2),
    step=st.sampled_from([1.0, 0.01, 60.0]),
    files=st.integers(1, 2),
)
def test_as_many_periods_count_as_fit_between_the_gaps(gaps, skip, step, files):
    edges = [-1, *sorted(gaps), 200]
    pieces = [(a + 1, b) for a, b in pairwise(edges) if b > a + 1]
    data = record(pieces, step=step, files=files)
    most = files * most_by_trial(pieces, skip)
    if most < 2:
        few = code_of(whole_periods, Periods(PERIOD, skip=skip), data, "a.csv", step, kind=DataError)
        assert few == "too-few-samples"
        return
    counted = whole_periods(Periods(PERIOD, skip=skip), data, "a.csv", step)
    kept, periods, repeats = counted.data, counted.periods, counted.repeats
    if len(pieces) == 1:
        return
    assert repeats == 1
    assert periods.skip == 0
    parts = kept.u[:, 0].reshape(-1, PERIOD)
    assert len(parts) == most == periods.kept(len(kept.u))
    assert np.all(np.diff(parts, axis=1) == 1.0)  # no gap inside
    assert len({int(first) % PERIOD for first in parts[:, 0]}) == 1
    assert sum(count for _, count in kept.files) == len(kept.u)
    assert np.array_equal(kept.y, kept.u**2)


def test_records_without_gaps_stay_as_they_are():
    data = record([(0, 105)], files=3)
    counted = whole_periods(Periods(PERIOD, skip=1), data, "a.csv", 1.0)
    assert counted.data is data
    assert (counted.periods, counted.repeats) == (Periods(PERIOD, skip=1), 3)


def test_blocks_with_a_gap_are_refused():
    data = record([(0, 50), (51, 160)])
    assert (
        code_of(whole_periods, Periods(PERIOD, blocks=2, skip=1), data, "a.csv", 1.0, kind=DataError)
        == "bad-period"
    )


TEXT = """
plant: {B: [0, 0.4, 0.1], F: [1, -1.5, 0.8]}
noise: {variance: 0.01}
experiment: {samples: 3000}
accuracy: {frequency_response: {relative: 0.05, band: [0.1, 2], lines: 12, detection: 4}}
signal: {periods: 6}
"""


@pytest.mark.parametrize("gap", [700, 1203, 2999 - 640])
def test_the_response_of_a_record_with_a_gap_is_that_of_its_whole_periods(write, gap):
    """The reference is the ratio of the transforms of these periods; most discs contain the truth."""
    spec = parse_spec(TEXT)
    u = solve(spec).signal[:, 0]
    noise = 0.1 * np.random.default_rng(gap).standard_normal(len(u))
    y = scipy.signal.lfilter([0, 0.4, 0.1], [1, -1.5, 0.8], u) + noise
    holed = np.where(np.arange(len(u)) == gap, np.nan, y)
    found = identify(spec, write({"u1": u, "y1": holed}), frequency_response=True)
    period = 500
    phases = [
        [b for b in range(phase, len(u) - period + 1, period) if b >= period and not b <= gap < b + period]
        for phase in range(period)
    ]
    begins = max(phases, key=len)
    assert found.result["frequency_response"]["counted"] == period * len(begins)
    columns = found.tables["frequency_response"].columns
    w = columns["frequency_rad_per_s"]
    lines = np.round(w * period / (2.0 * np.pi)).astype(int)
    Y, U = (sum(np.fft.fft(x[b : b + period])[lines] for b in begins) for x in (y, u))
    G = columns["G_re"] + 1j * columns["G_im"]
    assert pytest.approx(Y / U, rel=1e-6) == G
    z = np.exp(-1j * w)
    true = (0.4 * z + 0.1 * z**2) / (1.0 - 1.5 * z + 0.8 * z**2)
    assert np.mean(np.abs(G - true) <= columns["radius"]) >= 0.7
