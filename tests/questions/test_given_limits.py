"""Limits beside a given excitation: which of them it breaks, and what cannot be compared."""

import pytest

from inputdesign_cli import analyse, load_spec

ONE = "specs/first_order_given.yaml"  # a cosine of amplitude 0.75: power 0.28125
TWO = "specs/two_by_two_given.yaml"


def limits_not_kept(spec):
    return [one for one in analyse(spec).outcome.findings or () if one.code == "limit-not-kept"]


@pytest.mark.parametrize(
    ("spec", "limits", "broken"),
    [
        (ONE, "{input_power: 0.3, output_power: 40, samples: 500}", []),
        (ONE, "{input_power: 0.28}", [("limits.input_power", 0.28125, 0.28)]),
        (ONE, "{input_power: {min: 0.3}}", [("limits.input_power", 0.28125, 0.3)]),
        (TWO, "{input_power: [30, 20]}", [("limits.input_power", 22.5, 20.0)]),
    ],
)
def test_what_an_excitation_breaks_is_found(spec, limits, broken):
    found = limits_not_kept(load_spec(spec, [f"limits={limits}"]))
    assert [one.where for one in found] == [where for where, _, _ in broken]
    for one, (_, value, limit) in zip(found, broken, strict=True):
        assert one.figures["value"] == pytest.approx(value, rel=1e-9)
        assert one.figures["limit"] == limit


@pytest.mark.parametrize(
    ("spec", "limits", "broken"),
    [
        (
            ONE,
            "{excitation_power: 0.2, output_power: 30}",
            ["limits.output_power", "limits.excitation_power"],
        ),
        (TWO, "{amplitude: {input: [100, 6], output: 1000}}", ["limits.amplitude.input"]),
        (TWO, "{rate: [1, 100], amplitude: {output: [1000, 1]}}", ["limits.amplitude.output", "limits.rate"]),
    ],
)
def test_every_limit_is_looked_at(spec, limits, broken):
    assert [one.where for one in limits_not_kept(load_spec(spec, [f"limits={limits}"]))] == broken


def test_a_record_longer_than_allowed_is_found(tmp_path):
    (tmp_path / "u.csv").write_text("u\n" + "1\n-1\n1\n" * 40)
    given = f"spectrum={{given: {{signal: {tmp_path / 'u.csv'}}}}}"
    spec = load_spec(ONE, [given, "limits={samples: 100}", "experiment.samples=100"])
    (found,) = limits_not_kept(spec)
    assert found.where == "limits.samples"
    assert dict(found.figures) == {"value": 120, "limit": 100}
