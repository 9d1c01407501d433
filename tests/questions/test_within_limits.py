"""What limits that are too tight do buy: against a closed form, and true where the spec is loosened by it."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.cli import app
from inputdesign_cli.errors import InfeasibleError

FIRST = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {C: [1, -0.9], variance: 1.0}
experiment: {samples: 500}
spectrum: {type: fir, order: 8}
signal: {candidates: 1}
"""
ERROR = "accuracy: {{model_error: {{relative: {}, alpha: 2.45}}}}\n"
TWO = """
plant:
  A: [1, -0.7]
  B: [[[0, 1.0], [0, -0.5, 0.2]], [[0, 0.6], [0, 1.2]]]
noise: {variance: [[0.5, 0.1], [0.1, 0.4]]}
experiment: {samples: 300}
spectrum: {type: fir, order: 3}
signal: {candidates: 1}
limits: {input_power: [1.0, 0.02]}
"""


def refused(text, code="infeasible"):
    with pytest.raises(InfeasibleError) as caught:
        solve(parse_spec(text))
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.code == code
    return diagnostic


def test_closed_form_of_one_gain():
    """One gain b1 in white noise: its variance is lambda / (N P), whatever the spectrum."""
    text = """
plant: {B: [0, 2.0]}
noise: {variance: 0.3}
experiment: {samples: 100}
spectrum: {type: white}
limits: {input_power: 0.5}
accuracy: {standard_deviation: {b1: 0.01}}
"""
    diagnostic = refused(text)
    deviation = np.sqrt(0.3 / (100 * 0.5))
    details = diagnostic.details
    assert details["factor"] == pytest.approx(deviation / 0.01, rel=1e-6)
    assert details["factor_bound"] == pytest.approx(deviation / 0.01, rel=1e-6)
    (bought,) = details["bought"]
    assert (bought["key"], bought["asked"]) == ("accuracy.standard_deviation.b1", 0.01)
    assert bought["bought"] == pytest.approx(deviation, rel=1e-6)
    (limit,) = details["limits"]
    assert (limit["name"], limit["max"]) == ("input_power", 0.5)
    assert limit["share"] == pytest.approx(1.0, rel=1e-6)
    assert (
        f"buy standard_deviation of b1 {np.ceil(deviation * 1e5) / 1e5:.4g} (asked: 0.01)"
        in diagnostic.message
    )


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("head", "accuracy", "fraction"),
    [
        (FIRST + "limits: {input_power: 0.2}\n", ERROR, 0.01),
        (FIRST + "limits: {input_power: 0.2, output_power: {min: 20, max: 45}}\n", ERROR, 0.01),
        (TWO, ERROR, 0.1),
        (TWO, "accuracy: {{weighted_variance: {{max: {}}}}}\n", 0.0004),
    ],
    ids=["power", "floor", "channels", "variance"],
)
def test_what_is_bought_can_be_had_and_no_more(head, accuracy, fraction):
    details = refused(head + accuracy.format(fraction)).details
    factor, power = details["factor"], 2 if "variance" in accuracy else 1
    (bought,) = details["bought"]
    assert bought["bought"] == pytest.approx(fraction * factor**power, rel=1e-12)
    best = head + "objective: best_accuracy\n"
    looser = solve(parse_spec(best + accuracy.format(f"{fraction * (factor * (1 + 1e-6)) ** power:.17g}")))
    assert looser.result["objective"]["value"] <= 1.0
    cheapest = solve(parse_spec(head + accuracy.format(f"{fraction * (factor * (1 + 1e-3)) ** power:.17g}")))
    assert cheapest.result["status"] == "optimal"
    still = refused(head + accuracy.format(f"{fraction * (factor * (1 - 1e-3)) ** power:.17g}"))
    assert still.details["factor"] == pytest.approx(1 / (1 - 1e-3), rel=1e-5)


@pytest.mark.slow
def test_several_channels_name_the_entry_and_the_input():
    diagnostic = refused(TWO + ERROR.format(0.1))
    details = diagnostic.details
    worst = details["worst"][0]
    assert worst["entry"] in ("[1,1]", "[1,2]", "[2,1]", "[2,2]")
    assert worst["worst_ratio"] == pytest.approx(details["factor"], rel=1e-4)
    assert f"worst in entry {worst['entry']} at " in diagnostic.message
    assert {item["channel"] for item in details["limits"]} <= {1, 2}
    tightest = max(details["limits"], key=lambda item: item["share"])
    assert tightest["channel"] == 2
    assert (
        "needs input 2 power >= " in diagnostic.message or "input 2 power is exhausted" in diagnostic.message
    )


def test_an_experiment_that_is_too_short_says_what_it_buys():
    text = FIRST + "objective: shortest_experiment\n" + ERROR.format(0.01)
    limits = "limits: {{input_power: 0.2, samples: {}}}\n"
    details = refused(text + limits.format(400), "too-long").details
    loosened = (
        FIRST + "objective: shortest_experiment\n" + ERROR.format(0.01 * details["factor"] * (1 + 1e-6))
    )
    assert solve(parse_spec(loosened + limits.format(400))).result["samples"] == 400


def test_data_of_the_error_reach_the_terminal(tmp_path):
    spec = tmp_path / "tight.yaml"
    spec.write_text(FIRST + "limits: {input_power: 0.2}\n" + ERROR.format(0.01))
    run = CliRunner().invoke(app, ["solve", str(spec), "--no-output", "--json"])
    assert run.exit_code == 3
    (error,) = json.loads(run.stdout)["errors"]
    assert error["details"]["factor"] >= error["details"]["factor_bound"] > 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limits", "keys"),
    [
        ("amplitude: {}", {"amplitude.input": 0.1}),
        ("amplitude: {}, input_power: {}", {"amplitude.input": 0.1, "input_power": 0.009}),
        ("amplitude: {}, output_power: {}", {"amplitude.input": 0.1, "output_power": 0.02}),
    ],
)
def test_the_factor_of_an_amplitude_is_its_own(limits, keys):
    """Several limits that are exhausted together: who raises each as told has a spectrum, no less does."""
    text = TWO.replace("input_power: [1.0, 0.02]", "LIMITS").replace("signal: {candidates: 1}\n", "")
    text += ERROR.format(0.3)
    message = refused(text.replace("LIMITS", limits.format(*keys.values()))).message

    def raised(share):
        times = {key: message.split(f"limits.{key} would have to be ")[1] for key in keys}
        told = {key: float(text.split(" times")[0]) for key, text in times.items()}
        bounds = [share * bound * told[key] for key, bound in keys.items()]
        return text.replace("LIMITS", limits.format(*bounds))

    assert "no change of a single limit is enough" in message
    refused(raised(1.0 + 1e-4), "limits-too-tight")  # a spectrum does; a record takes more, as is told
    refused(raised(1.0 - 1e-2), "infeasible")
