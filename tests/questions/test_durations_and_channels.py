"""Durations in place of samples, and names and units of channels."""

import re

import numpy as np
import pytest

from inputdesign_cli import identify, parse_spec, solve
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.outcome.units import Units

HEATER = """
sample_time: 4.76
plant: {continuous: {gain: 2.1, time_constant: 180, dead_time: 25}, sample: zoh}
noise: {variance: 0.04}
accuracy: {standard_deviation: {gain: 0.05}}
spectrum: {type: multisine, lines: 60}
signal: {candidates: 1}
solver: {any_spectrum: false}
"""
CHANNELS = 'channels: {u1: {name: heating, unit: "%"}, y1: {unit: degC}}\n'


def test_a_duration_is_as_many_samples_as_fit():
    spec = parse_spec(HEATER + "experiment: {duration: 3600}\nlimits: {duration: 4760}\n")
    assert (spec.experiment.samples, spec.limits.samples) == (756, 1000)
    assert "duration: 3600" in spec.to_yaml()
    assert "samples" not in spec.to_yaml()
    costs = [
        solve(parse_spec(f"{HEATER}experiment: {{{length}}}\n")).result["cost"]
        for length in ("duration: 3600", "samples: 756")
    ]
    assert costs[0] == costs[1]


def test_names_and_units_of_channels_appear_in_headers_and_labels(tmp_path):
    spec = parse_spec(f"{HEATER}{CHANNELS}experiment: {{samples: 120}}\n")
    found = solve(spec)
    assert list(found.tables["signal"].columns) == ["time_s", "u1 heating (%)"]
    u = np.array(found.tables["signal"].columns["u1 heating (%)"])
    y = 2.1 * np.convolve(u, np.exp(-np.arange(200) / 38.0) / 38.0)[: u.size]
    y += 0.01 * np.random.default_rng(0).standard_normal(u.size)
    data = tmp_path / "log.csv"
    rows = [f"{a!r},{b!r}" for a, b in zip(u.tolist(), y.tolist(), strict=True)]
    data.write_text("\n".join(["u1 heating (%),y1 (degC)", *rows]))
    fitted = identify(spec.with_(**{"plant.known": ["time_constant", "dead_time"]}), data)
    assert fitted.curves["fit"].panels[0].label == "(degC)"


def test_an_excitation_has_the_unit_of_its_input():
    units = Units("s", 1.0, True, True, 2, 1, {"u1": ("valve", "%"), "u2": ("", "V"), "y1": ("level", "")})
    assert [units.label(name) for name in ("r1", "u1", "r2", "y1")] == ["(%)", "valve (%)", "(V)", "level"]
    assert units.header("r2") == "r2 (V)"


@pytest.mark.parametrize("lengths", [("duration", 0.5), pytest.param(("samples", 1), marks=pytest.mark.slow)])
def test_a_hint_states_the_sufficient_length_under_the_key_of_the_spec(lengths):
    """The length of the hint suffices for a spectrum; a record needs up to 15 % more."""
    word, unit = lengths
    text = (
        "sample_time: 0.5\nplant: {B: [0, 3.6], F: [1, -0.7]}\nnoise: {variance: 1}\n"
        f"experiment: {{{word}: {{}}}}\naccuracy: {{model_error: {{relative: 0.05}}}}\n"
        "limits: {amplitude: 0.25}\nspectrum: {type: fir, order: 8}\nsolver: {any_spectrum: false}\n"
    ).replace("{}", "%s")
    with pytest.raises(InfeasibleError) as caught:
        solve(parse_spec(text % (400 * unit)))
    (needed,) = re.findall(rf"experiment\.{word}: ([0-9.]+)", caught.value.diagnostics[0].hint)
    longer = unit * round(1.15 * float(needed) / unit)
    assert solve(parse_spec(text % longer)).result["signal"]["worst_ratio"] <= 1.0 + 1e-9
