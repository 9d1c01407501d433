"""Limits beside a given excitation: which of them it breaks, and what cannot be compared."""

import pytest

from inputdesign_cli import analyse, load_spec
from inputdesign_cli.errors import SpecError

ONE = "specs/first_order_given.yaml"  # a cosine of amplitude 0.75: power 0.28125
TWO = "specs/two_by_two_given.yaml"


@pytest.mark.parametrize(
    ("spec", "limits", "said"),
    [
        (ONE, "{input_power: 0.3, output_power: 40, samples: 500}", []),
        (ONE, "{input_power: 0.28}", ["limits.input_power is not kept: the power of input is 0.28125"]),
        (ONE, "{input_power: {min: 0.3}}", ["0.28125, below 0.3"]),
        (
            ONE,
            "{excitation_power: 0.2, output_power: 30}",
            ["limits.output_power", "limits.excitation_power"],
        ),
        (TWO, "{input_power: [30, 20]}", ["the power of input 2 is 22.5"]),
        (TWO, "{amplitude: {input: [100, 10], output: 1000}, rate: 100}", ["of channel 2, above 10"]),
        (TWO, "{rate: [1, 100], amplitude: {output: [1000, 1]}}", ["limits.amplitude.output", "limits.rate"]),
    ],
)
def test_what_an_excitation_breaks_is_noted(spec, limits, said):
    notes = analyse(load_spec(spec, [f"limits={limits}"])).result.get("notes", [])
    assert len(notes) == len(said)
    for part, note in zip(said, notes, strict=True):
        assert part in note


def test_a_record_longer_than_allowed_is_noted(tmp_path):
    (tmp_path / "u.csv").write_text("u\n" + "1\n-1\n1\n" * 40)
    given = f"spectrum={{given: {{signal: {tmp_path / 'u.csv'}}}}}"
    spec = load_spec(ONE, [given, "limits={samples: 100}", "experiment.samples=100"])
    note, *_ = analyse(spec).result["notes"]
    assert "120 samples, more than 100" in note


@pytest.mark.parametrize("spec", [ONE, TWO])
@pytest.mark.parametrize("limits", ["{spectrum: 5}", "{energy: 5}"])
def test_what_cannot_be_compared_is_refused(spec, limits):
    with pytest.raises(SpecError) as caught:
        analyse(load_spec(spec, [f"limits={limits}"]))
    assert caught.value.diagnostics[0].code == "not-supported"
    assert caught.value.diagnostics[0].key.startswith("limits.")


def test_phases_of_a_given_excitation_of_several_inputs():
    with pytest.raises(SpecError) as caught:
        analyse(load_spec(TWO, ["signal.phases=schroeder"]))
    assert caught.value.diagnostics[0].key == "signal.phases"
