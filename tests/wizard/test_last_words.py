"""What the wizard says is to be applied and logged."""

from types import SimpleNamespace

import pytest

from inputdesign_cli.wizard.means import input_range
from inputdesign_cli.wizard.solving import to_log


def words(applied, caused, offset=None):
    spec = SimpleNamespace(signal=SimpleNamespace(offset=offset), sample_time=2.0, time_unit="s")
    tables = {
        "signal": SimpleNamespace(columns=dict.fromkeys(["time_s", *applied])),
        "predicted_output": SimpleNamespace(
            columns=dict.fromkeys(["time_s", *caused, *(f"{y}_noise_deviation" for y in caused)])
        ),
    }
    return to_log(spec, SimpleNamespace(tables=tables), "spec.yaml")


def test_all_channels_are_logged():
    apply, judge = words(["u1", "u2"], ["y1", "y2"], [40.0, 5.0])
    assert "apply signal.csv, and log time, u1, u2, y1 and y2 every 2 s" in apply
    assert "--operating-point u1=40,u2=5,y1=REST,y2=REST" in judge


def test_a_reference_is_no_position_of_the_actuator():
    apply, judge = words(["r1"], ["y1"], 40.0)
    assert "u = r - C y" in apply
    assert "no position of the actuator" in apply
    assert "log time, u1 and y1" in apply
    assert "--operating-point u1=40,y1=REST" in judge


@pytest.mark.parametrize(
    "text", ["5 % around 40 %", "5 around 40", "plus/minus 5 around 40", "± 5 % around 40 %", "35 to 45"]
)
def test_ranges_in_many_words(text):
    span = input_range(text)
    assert (span.amplitude, span.offset) == (5.0, 40.0)
