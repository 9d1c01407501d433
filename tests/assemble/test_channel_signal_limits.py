"""Records of several inputs: jointly low peaks, limits on each channel, their own accuracy."""

from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import load_spec, solve
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.signal import Lines, low_peak_angles, multisine_record, schroeder_angles

SPEC = Path(__file__).parent.parent.parent / "specs" / "two_by_two_arx.yaml"


def coloured(lines, period):
    """Correlated inputs of different powers."""
    rng = np.random.default_rng(0)
    roots = rng.normal(size=(lines, 2, 2)) + 1j * rng.normal(size=(lines, 2, 2))
    powers = roots @ roots.conj().swapaxes(1, 2) * np.array([[1.0, 0.3], [0.3, 0.09]])
    return Lines(2 * np.pi * np.arange(1, lines + 1) / period, powers, period)


def test_low_peaks_of_all_inputs_and_periods_at_once():
    lines, rng = coloured(40, 256), np.random.default_rng(1)
    start = 2 * np.pi * rng.random(40)
    rms = np.sqrt(np.einsum("naa->a", lines.powers).real)

    def crest(angles):
        record = multisine_record(lines, 512, rng, "orthogonal", angles=angles)
        np.testing.assert_allclose(np.sqrt(np.mean(record**2, axis=0)), rms, rtol=1e-9)
        return (np.abs(record).max(axis=0) / rms).max()

    assert crest(low_peak_angles(lines, 512, start)) < 0.75 * crest(start)
    assert np.isfinite(crest(schroeder_angles(lines, 512)))


def test_weights_of_the_inputs():
    """An input that may reach little is kept low at the expense of the other."""
    lines, rng = coloured(40, 256), np.random.default_rng(1)
    start = 2 * np.pi * rng.random(40)
    rms = np.sqrt(np.einsum("naa->a", lines.powers).real)
    peaks = []
    for weight in (1.0, 3.0):
        angles = low_peak_angles(lines, 512, start, amplitude=rms * np.array([1.0, weight]))
        peaks.append(np.abs(multisine_record(lines, 512, rng, "orthogonal", angles=angles)).max(axis=0))
    assert peaks[1][0] < peaks[0][0]


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


def test_limits_that_are_too_tight():
    with pytest.raises(InfeasibleError) as error:
        solve(load_spec(SPEC, ["spectrum.order=4", "limits.amplitude=8", "signal.candidates=1"]))
    (complaint,) = error.value.complaints
    assert complaint.code == "limits-too-tight"
    assert complaint.key == "limits.amplitude"
    assert "about" in complaint.hint
