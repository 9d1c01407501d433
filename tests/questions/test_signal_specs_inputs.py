"""The words of `signal:` and of limits on single samples with several inputs, from the spec to the files."""

import io
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.io.wavfile

from inputdesign_cli import load_spec, solve

SPEC = Path(__file__).parent.parent.parent / "specs" / "two_by_two_arx.yaml"


@pytest.mark.slow
def test_limits_on_each_channel():
    changes = [
        "spectrum.order=4",
        "limits.amplitude={input: [14, 35], output: [70, 70]}",
        "signal.offset=[1, 2]",
    ]
    outcome = solve(load_spec(SPEC, [*changes, "signal.candidates=2"]))
    signal = outcome.result["signal"]
    assert signal["worst_ratio"] == pytest.approx(1.0, abs=1e-8)
    assert np.all(np.array(signal["input_peak"]) <= [14, 35])
    assert np.all(np.array(signal["output_peak"]) <= 70)
    assert signal["phases"] == "optimised"
    record = outcome.tables["signal"].columns
    np.testing.assert_allclose(np.abs(record["u1"] - 1).max(), signal["peak"][0])
    assert outcome.curves["signal"].limits["u2"] == (-33, 37)


def test_what_is_applied_to_several_inputs():
    """Converters of a range each, offsets, periods, all files, and the record in every plot."""
    changes = [
        "spectrum.order=4",
        "signal.type=binary",
        "signal.candidates=2",
        "signal.periods=2",
        "signal.offset=[1, -20]",
        "signal.quantisation={bits: 10, range: [20, 100]}",
        "signal.also=[mat, wav]",
    ]
    outcome = solve(load_spec(SPEC, changes))
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
    _, wave = scipy.io.wavfile.read(io.BytesIO(outcome.files["signal.wav"]))
    np.testing.assert_allclose(wave * signal["wav_full_scale"], applied, rtol=1e-6)
    assert {"phi_record_11", "phi_record_22"} <= set(outcome.tables["spectrum"].columns)
    for entry in outcome.curves["bound"].panels:
        assert np.all(entry.r_u_record <= entry.r_adm * (1 + 1e-9))
