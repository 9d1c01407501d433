"""What else than noise decides on a measured response, and lines that data do not excite."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import assess, identify, parse_spec, solve
from inputdesign_cli.errors import DataError
from inputdesign_cli.identification.periodic_response import Periods, excited_lines
from inputdesign_cli.questions.frequency_response.build import build_measurement
from inputdesign_cli.records import Preparation

TEXT = """
plant: {B: [0, 0.4, 0.1], F: [1, -1.5, 0.8]}
noise: {D: [1, -0.9], variance: 0.01}
experiment: {samples: 3000}
accuracy: {frequency_response: {relative: 0.05, band: [0.05, 2], lines: 16, detection: 4}}
signal: {periods: 6, phases: optimised}
"""
PERIOD = 500


@pytest.fixture(scope="module")
def question():
    spec = parse_spec(TEXT)
    return spec, 1.6 * solve(spec).signal[:, 0]


def answer(u, seed, curve=lambda x: x, size=0.1):
    """The plant behind a curve, and noise, by a filter of its own."""
    e = size * np.random.default_rng(seed).standard_normal(len(u) + 200)
    v = scipy.signal.lfilter([1.0], [1.0, -0.9], e)[200:]
    return scipy.signal.lfilter([0, 0.4, 0.1], [1, -1.5, 0.8], curve(u)) + v


def judged(write, spec, u, y, **more):
    time = np.arange(float(len(u)))
    return assess(spec, write({"time_s": time, "u1": u, "y1": y}), **more)


def causes(found):
    return found.results.result["assessment"].get("causes", [])


def finding(found, code):
    (one,) = [one for one in found.results.outcome.findings if one.code == code]
    return one


def clipping(share):
    return lambda x: np.clip(x, -share * np.std(x), share * np.std(x))


def dead(share):
    return lambda x: np.sign(x) * np.maximum(np.abs(x) - share * np.std(x), 0.0)


def bent(spec, u, curve):
    """The largest change of the response by a curve without noise, over what is admitted."""
    task = build_measurement(spec).terms
    curved, linear = (
        task.periods.means(answer(u, 0, one, 0.0)[:, None], task.grid.excited)[:, 0, 0]
        for one in (curve, lambda x: x)
    )
    return float(np.max(np.abs(curved / linear - 1.0)) / 0.05)


@pytest.mark.first(5)
@pytest.mark.parametrize(
    ("curve", "strength"),
    [
        *((clipping(1.2), 0.05), (clipping(0.5), 2.0), (dead(0.3), 1.0), (dead(1.0), 0.05)),
        *((lambda x: x + 0.1 * x**3, strength) for strength in (0.05, 1.0, 2.0)),
    ],
)
def test_no_number_of_periods_mends_a_nonlinearity(write, question, curve, strength):
    """Whatever the noise: the response of more periods errs by the same, and so none are offered."""
    spec, u = question
    assert bent(spec, u, curve) > 1.5
    found = judged(write, spec, u, answer(u, 1, curve, 0.1 * strength))
    told = found.results.result["assessment"]
    assert "periods" not in told
    assert found.verdict != "met"
    assert finding(found, "nonlinear-response").figures["share"] > 0.5


def test_noise_that_misses_whatever_the_nonlinearity_does_is_a_miss(write, question):
    spec, u = question
    found = judged(write, spec, u, answer(u, 1, lambda x: x + 0.5 * x**3 / np.var(x), 1.0))
    assert found.verdict == "missed"
    assert finding(found, "nonlinear-response").severity == "doubt"


@pytest.mark.first(3)
@pytest.mark.parametrize(("height", "seed"), [(5.0, 1), (-20.0, 2), (200.0, 1)])
def test_a_drift_is_no_nonlinearity_and_detrending_mends_it(write, question, height, seed):
    spec, u = question
    y = answer(u, seed)
    drifting = y + np.linspace(0.0, height, len(y))
    plain, found = judged(write, spec, u, y), judged(write, spec, u, drifting)
    assert plain.verdict == "met"
    assert causes(found) == ["drift"]
    assert [one.code for one in found.results.outcome.findings] == ["drifting-periods"]
    figures = finding(found, "drifting-periods").figures
    assert figures["straight"]
    assert figures["drift"]["y"] == pytest.approx(abs(height), rel=0.1)
    mended = judged(write, spec, u, drifting, preparation=Preparation(detrend="linear"))
    assert mended.verdict == "met"


def test_a_curved_drift_is_not_mended_by_a_line_and_a_nonlinearity_is_named_too(write, question):
    spec, u = question
    along = np.linspace(-1.0, 1.0, len(u))
    found = judged(write, spec, u, answer(u, 3) + 30.0 * along**3)
    assert causes(found) == ["drift"]
    assert not finding(found, "drifting-periods").figures["straight"]
    both = judged(write, spec, u, answer(u, 3, clipping(0.8)) + 10.0 * (along + 1.0))
    assert causes(both) == ["drift", "nonlinearity"]


def test_spikes_of_several_samples_are_named_and_nothing_is_made_of_them(write, question):
    spec, u = question
    y, samples = answer(u, 1), [1800, 1801, 1802]
    y[samples] += 60.0
    found = judged(write, spec, u, y)
    assert causes(found) == ["spikes"]
    told = found.results.result
    assert finding(found, "spiked-periods").figures["samples"] == samples
    assert "periods" not in told["assessment"]
    assert "nonlinearity" not in told["frequency_response"]
    y[samples] = np.nan
    assert judged(write, spec, u, y).verdict in ("met", "undecided")


@pytest.mark.parametrize("samples", [[1234], [700, 2222], [100]])
def test_single_spikes_and_those_of_the_transient_decide_nothing(write, question, samples):
    """They are replaced as the file is read, which a finding says."""
    spec, u = question
    y = answer(u, 1)
    y[samples] += 60.0
    found = judged(write, spec, u, y)
    assert finding(found, "spikes-replaced").figures["rows"] == [at + 2 for at in samples]
    assert found.verdict == "met"


@pytest.mark.first(1)
@pytest.mark.parametrize("past", [0.9, 0.99, 0.998])
def test_slow_noise_that_the_spec_knows_is_neither_drift_nor_spikes(write, past):
    """Down to a memory of a period, far below the lowest line."""
    spec = parse_spec(TEXT.replace("-0.9", f"-{past}"))
    u, found = 1.6 * solve(spec).signal[:, 0], []
    for seed in range(4):
        e = 0.1 * np.random.default_rng(seed).standard_normal(len(u) + 3000)
        y = answer(u, 0, size=0.0) + scipy.signal.lfilter([1.0], [1.0, -past], e)[3000:]
        found += causes(judged(write, spec, u, y))
    assert not {"drift", "spikes"} & set(found)


def test_of_two_files_each_drifts_by_itself(write, question):
    spec, u = question
    time = np.arange(float(len(u)))
    files = [
        write({"time_s": time, "u1": u, "y1": answer(u, seed) + np.linspace(0.0, height, len(u))}, name)
        for seed, height, name in ((1, 20.0, "1.csv"), (2, -20.0, "2.csv"))
    ]
    # One ramp undoes the other in the response, and the scatter has them both.
    told = identify(spec, files, frequency_response=True).result
    silent = told["frequency_response"]["nonlinearity"]
    assert all(entry["probability"][0] > 1e-3 for entry in silent.values())


EXCITED = """
plant: {B: [0, 0.4, 0.1], F: [1, -1.5, 0.8]}
noise: {D: [1, -0.9], variance: 0.01}
experiment: {samples: 2500}
accuracy: {frequency_response: {relative: 0.05, band: [0.05, 2.5], lines: 20, transient: 1}}
signal: {periods: 5, phases: schroeder}
"""
LINE = 4  # harmonic of the first line, 2 pi 4 / 500 = 0.05 rad/sample


def table_of(u, seed=0):
    """A record of the plant and the noise of the spec, whatever the input."""
    model = build_measurement(parse_spec(EXCITED)).model
    e = 0.1 * np.random.default_rng(seed).standard_normal((1, len(u), 1))
    answer, noise = model.simulate(u[None, :, None], e, 1.0)
    y = (answer + noise)[0, :, 0]
    return {"time_s": np.arange(float(len(u))), "u1": u, "y1": y}


def times(periods=5):
    return np.arange(float(periods * PERIOD))


def sine():
    return np.sin(2.0 * np.pi * LINE / PERIOD * times())


def square():
    """Of odd harmonics of 250 samples: 2, 6, 10, .. of the period."""
    return np.where(times() % 250 < 125, 1.0, -1.0)


def of_spec():
    return set(build_measurement(parse_spec(EXCITED)).terms.grid.excited)


@pytest.mark.parametrize(
    ("u", "lines"), [(sine(), {LINE}), (1e6 * sine() + 1e8, {LINE}), (square(), set(range(2, 250, 4)))]
)
def test_only_lines_with_power_are_measured(write, u, lines):
    there = lines & of_spec()
    results = identify(parse_spec(EXCITED), write(table_of(u)), frequency_response=True)
    told = results.result["frequency_response"]
    w = 2.0 * np.pi * np.array(sorted(there)) / PERIOD
    for name in ("frequency_response", "deviations"):
        assert results.tables[name].columns["frequency_rad_per_s"] == pytest.approx(w)
    assert (told["lines"], told["asked"]) == (len(there), 20)
    first = 2.0 * np.pi * min(of_spec() - there) / PERIOD
    (one,) = [one for one in results.outcome.findings if one.code == "unexcited-lines"]
    assert one.figures == {"lines": 20 - len(there), "asked": 20, "first": pytest.approx(first)}


@pytest.mark.slow
def test_the_noise_of_a_line_is_not_that_of_its_unexcited_neighbours(write):
    # Of |U|^2 = N p / 2 with p = 1/2 and 2000 samples, Phi_v = 0.01 / |1 - 0.9 exp(-jw)|^2.
    w = 2.0 * np.pi * LINE / PERIOD
    truth = np.sqrt(0.01 / np.abs(1.0 - 0.9 * np.exp(-1j * w)) ** 2 / (2000 * 0.25))
    found = []
    for seed in range(20):
        data = write(table_of(sine(), seed))
        results = identify(parse_spec(EXCITED), data, frequency_response=True)
        found.append(float(results.tables["deviations"].columns["deviation_data"][0]))
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(truth, rel=0.3)


def test_noise_of_the_inputs_is_no_excitation_and_strong_lines_are_some():
    rng = np.random.default_rng(1)
    harmonics = np.arange(1, 200)
    seen = excited_lines((sine() + 0.01 * rng.standard_normal(2500))[:, None], Periods(PERIOD), harmonics)
    assert seen[LINE - 1]
    assert seen.sum() <= 8  # 2 of 198 are expected by chance


def test_data_that_leave_lines_out_have_no_verdict(write):
    with pytest.raises(DataError, match="19 of 20 lines") as caught:
        assess(parse_spec(EXCITED), write(table_of(sine())))
    assert caught.value.diagnostics[0].code == "not-exciting"


def told_periods(write, u, admitted=0.05):
    spec = parse_spec(EXCITED).with_(**{"accuracy.frequency_response.relative": admitted})
    found = assess(spec, write(table_of(u)))
    return spec, found, found.results.result["assessment"].get("periods")


@pytest.mark.slow
def test_as_many_periods_as_are_told_do(write):
    u = solve(parse_spec(EXCITED)).signal[:, 0]
    spec, first, needed = told_periods(write, u, 0.04)
    assert first.verdict != "met"
    longer = np.tile(u[:PERIOD], needed + 1)
    verdicts = [assess(spec, write(table_of(longer, 10 + seed))).verdict for seed in range(12)]
    assert verdicts.count("met") >= 6
    assert "missed" not in verdicts
    half = np.tile(u[:PERIOD], needed // 2 + 1)
    assert assess(spec, write(table_of(half, 9))).verdict != "met"


@pytest.mark.parametrize(
    ("u", "why"),
    [
        (np.random.default_rng(9).standard_normal(2500), "do not repeat"),
        (1e-3 * np.tile(np.random.default_rng(9).standard_normal(500), 5), "are too weak at some lines"),
    ],
    ids=["white", "weak"],
)
def test_more_periods_are_not_asked_for_where_they_are_no_remedy(write, u, why):
    _, found, needed = told_periods(write, u)
    assert needed is None
    told = found.results.result["assessment"]
    text = told.get("no_top_up", "") + " ".join(told.get("undecided", []))
    assert "no remedy" in text
    assert why in text
    assert "signal.csv" in text
