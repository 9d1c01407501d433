"""Options of `signal:` and limits on single samples, from the spec to the files."""

import io
import re

import numpy as np
import pytest
import scipy.io
import scipy.io.wavfile

from inputdesign_cli import load_spec, parse_spec, solve
from inputdesign_cli.errors import InfeasibleError
from tests.support.first_order_specs import ERROR, PLANT
from tests.support.outcomes import codes_in

BASE = f"{PLANT}{ERROR}spectrum: {{type: fir, order: 5}}\n"


def samples_in(hint):
    """The length that a hint names."""
    return int(re.search(r"about (\d+) samples", hint).group(1))


CASES = [
    ("signal: {type: multisine, phases: schroeder}", {}),
    ("signal: {type: multisine, phases: optimised, candidates: 1}", {"crest_factor": 1.5}),
    ("signal: {type: multisine, lines: odd, periods: 2}", {}),
    ("signal: {lines: [3, 5, 9, 20, 40, 70, 110, 200]}", {}),
    ("signal: {type: binary}", {"crest_factor": 1 + 1e-9}),
    ("signal: {type: ternary, hold: 2}", {}),
    ("signal: {bits: 7}", {"crest_factor": 1 + 1e-9}),
    ("signal: {type: white, ramp: 20}", {}),
    ("signal: {type: chirp, candidates: 1}", {"crest_factor": 1.45}),
    ("signal: {type: steps, candidates: 1}", {"crest_factor": 1.45}),
    ("signal: {quantisation: {bits: 8, range: 4}, offset: 1}", {}),
    ("limits: {amplitude: 1.2}", {"peak": 1.2}),
    ("limits: {rate: 0.5}", {"input_move": 0.5 + 1e-12}),
    ("limits: {rate: 0.5, amplitude: 1}\nsignal: {type: slewed}", {"input_move": 0.5 + 1e-12, "peak": 1}),
    (
        "limits: {amplitude: {input: 1.4, output: 13}}\nsignal: {candidates: 3}",
        {"input_peak": 1.4, "output_peak": 13},
    ),
]


@pytest.mark.first(5)
@pytest.mark.parametrize(("text", "most"), CASES, ids=[text for text, _ in CASES])
def test_records_of_all_kinds_meet_the_accuracy_and_keep_their_limits(text, most):
    outcome = solve(parse_spec(BASE + text + "\n"))
    signal = outcome.result["signal"]
    assert 0.98 <= signal["worst_ratio"] <= 1 + 1e-9
    column = outcome.tables["signal"].columns["u1"] - signal.get("operating_point", [0.0])[0]
    assert signal["power"][0] == pytest.approx(np.mean(column**2), rel=1e-9)
    assert signal["extra_power"] == pytest.approx(signal["power"][0] / outcome.result["cost"] - 1)
    for key, value in most.items():
        assert signal[key][0] <= value


@pytest.mark.slow
def test_the_length_named_in_a_refusal_is_long_enough_for_a_record():
    with pytest.raises(InfeasibleError) as error:
        solve(parse_spec(BASE + "limits: {amplitude: 0.65}\nsignal: {candidates: 2, type: filtered_noise}\n"))
    (diagnostic,) = error.value.diagnostics
    assert diagnostic.code == "limits-too-tight"
    assert diagnostic.location is not None
    length = samples_in(diagnostic.hint)
    assert length > 500
    spec = parse_spec(
        BASE.replace("500", str(length)) + "limits: {amplitude: 0.65}\nsignal: {candidates: 8}\n"
    )
    signal = solve(spec).result["signal"]
    assert signal["worst_ratio"] <= 1 + 1e-9
    assert signal["peak"][0] <= 0.65


def test_another_kind_of_signal_is_delivered_where_noise_does_not_fit():
    found = solve(parse_spec(BASE + "limits: {amplitude: 0.65}\nsignal: {candidates: 2}\n")).result
    assert found["signal"]["type"] != "filtered_noise"
    assert found["signal"]["worst_ratio"] <= 1 + 1e-9
    assert found["signal"]["peak"][0] <= 0.65
    assert "other-signal" in codes_in(found)


SLOW = """
plant: {B: [0, 0.1], F: [1, -0.9]}
noise: {variance: 0.05}
experiment: {samples: 220}
accuracy: {model_error: {relative: 0.1, band: [0.005, 0.4]}}
spectrum: {type: fir, order: 30}
limits: {amplitude: 1, rate: 0.1}
solver: {any_spectrum: false}
"""


def test_ramps_between_two_levels_are_delivered_where_noise_and_sinusoids_do_not_fit():
    outcome = solve(parse_spec(SLOW))
    signal = outcome.result["signal"]
    assert signal["type"] == "slewed"
    assert signal["worst_ratio"] <= 1 + 1e-9
    moves = np.abs(np.diff(outcome.tables["signal"].columns["u1"], prepend=0.0))
    assert np.isclose(moves, 0.1).mean() > 0.5
    assert moves.max() <= 0.1


@pytest.mark.slow
def test_a_converter_of_too_small_a_range_is_named():
    text = "signal: {candidates: 1, quantisation: {bits: 8, range: 0.45}}\n"
    with pytest.raises(InfeasibleError) as error:
        solve(parse_spec(BASE + text))
    (diagnostic,) = error.value.diagnostics
    assert (diagnostic.code, diagnostic.key) == ("limits-too-tight", "signal.quantisation")
    assert 500 < samples_in(diagnostic.hint) < 2000


def test_a_limit_on_the_rate_below_the_needed_power_of_moves_is_infeasible():
    with pytest.raises(InfeasibleError) as error:
        solve(parse_spec(BASE + "limits: {rate: 0.003}\nsignal: {candidates: 1}\n"))
    assert error.value.diagnostics[0].code == "infeasible"  # by the power of the moves
    assert "a spectrum can" in error.value.diagnostics[0].hint


def test_a_missed_accuracy_is_noted():
    outcome = solve(parse_spec(BASE + "signal: {type: binary, amplitudes: 0.4}\n"))
    assert outcome.result["signal"]["peak"] == [pytest.approx(0.4)]
    assert outcome.result["signal"]["worst_ratio"] > 1
    assert "record-misses-accuracy" in codes_in(outcome.result)


@pytest.mark.slow
@pytest.mark.parametrize("offset", [0.37, 0.3, -0.1])
def test_limits_count_from_the_offset_also_between_two_values_of_a_converter(offset):
    """The converter has steps of 0.25; the record varies about the value nearest to the offset."""
    found = solve(
        parse_spec(
            BASE.replace("500", "900") + "limits: {amplitude: 0.75}\n"
            f"signal: {{type: binary, candidates: 2, offset: {offset},"
            " quantisation: {bits: 4, range: 2}}\n"
        )
    )
    u = np.array(found.tables["signal"].columns["u1"])
    np.testing.assert_allclose(u / 0.25, np.rint(u / 0.25), atol=1e-9)
    assert np.abs(u - offset).max() <= 0.75 + 1e-12


@pytest.mark.slow
def test_the_share_of_each_limit_that_the_largest_samples_take_is_stated():
    """Levels -a and a have moves of 2 a: a limit on moves binds before an equal one on values."""
    limits = "limits: {amplitude: 1.6, rate: 1.6}\nsignal: {type: binary, candidates: 2}\n"
    outcome = solve(parse_spec(BASE + "objective: shortest_experiment\n" + limits))
    u, shares = outcome.tables["signal"].columns["u1"], outcome.result["signal"]["of_limits"]
    moves = np.abs(np.diff(np.concatenate([[0.0], u])))
    assert shares == pytest.approx({"amplitude.input": np.abs(u).max() / 1.6, "rate": moves.max() / 1.6})
    assert shares["rate"] == pytest.approx(2.0 * shares["amplitude.input"])
    assert 0.98 < shares["rate"] <= 1.0 + 1e-9
    (longer,) = [one for one in outcome.result["findings"] if one["code"] == "record-longer"]
    assert f"{100 * shares['rate']:.3g} % of limits.rate" in longer["message"]
    assert outcome.curves["signal"].moves["u1"] == pytest.approx((moves.max(), 1.6))


TWO = "specs/two_by_two_arx.yaml"


def test_the_files_of_two_inputs_keep_converters_offsets_and_periods():
    """Each input has a converter and an offset; all files and curves hold the same record."""
    changes = [
        "spectrum.order=4",
        "signal.type=binary",
        "signal.candidates=2",
        "signal.periods=2",
        "signal.offset=[1, -20]",
        "signal.quantisation={bits: 10, range: [20, 100]}",
        "signal.also=[mat, wav]",
        "limits.amplitude=[19, 60]",
        "sample_time=0.5",
        "solver.any_spectrum=false",
    ]
    outcome = solve(load_spec(TWO, changes))
    signal = outcome.result["signal"]
    assert signal["type"] == "binary"
    assert signal["crest_factor"] == pytest.approx([1, 1])
    assert 0.99 <= signal["worst_ratio"] <= 1 + 1e-9
    designed = sum(outcome.result["power"]["input"])
    assert signal["extra_power"] == pytest.approx(sum(signal["power"]) / designed - 1)
    assert signal["extra_power"] < 0.25
    columns = outcome.tables["signal"].columns
    applied = np.stack([columns["u1"], columns["u2"]], axis=1)
    steps = applied / (np.array([40.0, 200.0]) / 2**10)
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-9)
    np.testing.assert_array_equal(applied[:250], applied[250:])
    np.testing.assert_allclose(np.mean((applied - signal["operating_point"]) ** 2, axis=0), signal["power"])
    content = scipy.io.loadmat(io.BytesIO(outcome.files["signal.mat"]))
    np.testing.assert_array_equal(content["u2"][:, 0], applied[:, 1])
    rate, wave = scipy.io.wavfile.read(io.BytesIO(outcome.files["signal.wav"]))
    assert (rate, content["time_s"][1, 0]) == (2, 0.5)
    np.testing.assert_allclose(wave * signal["wav_full_scale"], applied, rtol=1e-6)
    assert {"phi_record_11", "phi_record_22"} <= set(outcome.tables["spectrum"].columns)
    for entry in outcome.curves["bound"].panels:
        assert np.all(entry.r_u_record <= entry.r_adm * (1 + 1e-9))
    low, high = outcome.curves["signal"].limits["u1"]
    assert low <= columns["u1"].min() < columns["u1"].max() <= high
