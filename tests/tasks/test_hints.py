"""What a hint says would do does: specs that are infeasible or too tight, changed as they are told to be."""

from __future__ import annotations

import re

import pytest

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.errors import InfeasibleError

PLANTS = {
    "open": "plant: {B: [0, 3.6], F: [1, -0.7]}\nnoise: {C: [1, -0.9], variance: 1.0}\n"
    "experiment: {samples: 100}\n",
    "loop": "plant: {A: [1, -0.5], B: [0, 1.0, 0.3]}\nnoise: {C: [1, 0.4], variance: 0.2}\n"
    "experiment: {samples: 100, controller: {numerator: [0.05], denominator: [1, -0.2]}}\n",
    "resonant": "plant: {B: [0, 0.5, 0.2], F: [1, -1.2, 0.5]}\nnoise: {variance: 0.1}\n"
    "experiment: {samples: 100}\n",
}
LIMITS = {
    "power of noise": "limits: {input_power: %g}\nspectrum: {type: fir, order: 4}\n",
    "power of sinusoids": "limits: {output_power: %g}\nspectrum: {type: multisine, lines: 10}\n"
    "signal: {type: multisine, seed: 1}\n",
    "binary": "limits: {input_power: %g}\nspectrum: {type: white}\nsignal: {type: binary, seed: 1}\n",
    "peaks": "limits: {amplitude: %g}\nspectrum: {type: white}\nsignal: {type: multisine, seed: 1}\n",
}
TRIED = [
    ("open", "power of noise", 0.02, 0.05),
    ("open", "peaks", 0.05, 0.3),
    ("loop", "power of sinusoids", 0.2, 0.5),
    ("loop", "binary", 0.2, 0.3),
    ("resonant", "power of noise", 0.4, 0.2),
]
COMMON = (
    "accuracy: {model_error: {relative: %g, confidence: 0.95}}\nsolver: {any_spectrum_tolerance: 0.009}\n"
)
# A sentence of a hint, and what it asks for.
ADVICE = {
    r"experiment\.samples: (\d+) \(and": ["experiment.samples={}"],
    r"(\d+) samples can \(": ["experiment.samples={}", "signal.samples={}"],
    r"a spectrum can keep errors (\S+) times": ["accuracy.model_error.relative={}"],
    r"needs input power >= (\S+), limit": ["limits.input_power={}"],
    r"needs output power >= (\S+), limit": ["limits.output_power={}"],
}


@pytest.mark.parametrize(("plant", "limit", "relative", "level"), TRIED)
def test_who_follows_a_hint_succeeds(plant, limit, relative, level):
    text = PLANTS[plant] + LIMITS[limit] % level + COMMON % relative
    with pytest.raises(InfeasibleError) as refused:
        solve(parse_spec(text))
    (told,) = refused.value.diagnostics
    followed = 0
    for sentence, changes in ADVICE.items():
        for number in re.findall(sentence, f"{told.message}; {told.hint}"):
            value = f"{float(number) * relative:.6g}" if "relative" in changes[0] else number
            if "relative" in changes[0] and "amplitude" in text:
                continue  # only the spectrum is spoken of, and a record within hard limits is needed
            result = solve(parse_spec(text, overrides=[change.format(value) for change in changes])).result
            assert result["status"] == "optimal"
            if "samples" in changes[0]:
                assert result["signal"]["worst_ratio"] <= 1.0 + 1e-6
            followed += 1
    assert followed
    if told.code == "infeasible":
        assert "a record can" in told.hint
