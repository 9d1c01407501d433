"""Limits that are too tight: stated factors and remedies hold, and records come near to the limits."""

import re

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.errors import InfeasibleError
from tests.support.first_order_specs import ERROR, FIR, PLANT, run
from tests.support.refusals import refusal, refusals

FIRST = f"{PLANT}spectrum: {{type: fir, order: 8}}\nsignal: {{candidates: 1}}\n"
WITHIN = "accuracy: {{model_error: {{relative: {}, alpha: 2.45}}}}\n"
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
    diagnostic = refusal(lambda: solve(parse_spec(text)), InfeasibleError)
    assert diagnostic.code == code
    return diagnostic


def test_the_attainable_deviation_of_one_gain_has_its_closed_form():
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


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("head", "accuracy", "fraction"),
    [
        (FIRST + "limits: {input_power: 0.2}\n", WITHIN, 0.01),
        (FIRST + "limits: {input_power: 0.2, output_power: {min: 20, max: 45}}\n", WITHIN, 0.01),
        (TWO, WITHIN, 0.1),
        (TWO, "accuracy: {{weighted_variance: {{max: {}}}}}\n", 0.0004),
    ],
    ids=["power", "floor", "channels", "variance"],
)
def test_the_stated_attainable_accuracy_is_feasible_and_a_better_one_is_not(head, accuracy, fraction):
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


def test_a_limit_on_samples_that_is_too_small_states_the_attainable_error():
    text = FIRST + "objective: shortest_experiment\n" + WITHIN.format(0.01)
    limits = "limits: {{input_power: 0.2, samples: {}}}\n"
    told = refused(text + limits.format(400), "too-long")
    assert told.key == "limits.samples"
    details = told.details
    loosened = (
        FIRST + "objective: shortest_experiment\n" + WITHIN.format(0.01 * details["factor"] * (1 + 1e-6))
    )
    assert solve(parse_spec(loosened + limits.format(400))).result["samples"] == 400


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limits", "keys"),
    [
        ("amplitude: {}", {"amplitude.input": 0.1}),
        ("amplitude: {}, input_power: {}", {"amplitude.input": 0.1, "input_power": 0.009}),
        ("amplitude: {}, output_power: {}", {"amplitude.input": 0.1, "output_power": 0.02}),
    ],
)
def test_the_stated_factors_of_several_limits_just_suffice_for_a_spectrum(limits, keys):
    """Several limits are active together: raised by the stated factors they admit a spectrum, not below."""
    text = TWO.replace("input_power: [1.0, 0.02]", "LIMITS").replace("signal: {candidates: 1}\n", "")
    text += WITHIN.format(0.3)
    message = refused(text.replace("LIMITS", limits.format(*keys.values()))).message

    def raised(share):
        times = {key: message.split(f"limits.{key} would have to be ")[1] for key in keys}
        told = {key: float(text.split(" times")[0]) for key, text in times.items()}
        bounds = [share * bound * told[key] for key, bound in keys.items()]
        return text.replace("LIMITS", limits.format(*bounds))

    assert "no change of a single limit is enough" in message
    refused(raised(1.0 + 1e-4), "limits-too-tight")  # a spectrum exists, and no record
    refused(raised(1.0 - 1e-2), "infeasible")


DEAR_OUTPUT = """
sample_time: 5
plant: {B: [0, 0, 0.05], F: [1, -0.9]}
noise: {variance: 1.0}
experiment: {samples: 720}
cost: {output_power: 1}
limits: {%s}
accuracy: {model_error: {relative: 0.25, band: [0.001, 0.2]}}
spectrum: {type: fir, order: 20}
"""


def test_an_amplitude_below_the_root_of_the_least_power_is_infeasible():
    least = solve(parse_spec(DEAR_OUTPUT.replace("output_power: 1", "input_power: 1") % "samples: 720"))
    least = least.result["objective"]["value"]
    with pytest.raises(InfeasibleError) as caught:
        solve(parse_spec(DEAR_OUTPUT % f"amplitude: {0.99 * np.sqrt(least)}"))
    assert caught.value.diagnostics[0].code == "infeasible"
    told = caught.value.diagnostics[0]
    assert "a peak of" in told.message
    samples = int(told.hint.split("; with experiment.samples: ")[1].split()[0])
    assert samples == pytest.approx(720 / 0.99**2, rel=0.02)


def test_a_record_of_another_spectrum_is_delivered_where_the_cheapest_does_not_fit():
    found = solve(parse_spec(DEAR_OUTPUT % "amplitude: 1.95"))
    signal, u = found.result["signal"], np.array(found.tables["signal"].columns["u1"])
    assert np.abs(u).max() <= 1.95
    assert signal["worst_ratio"] <= 1.0 + 1e-9
    assert found.result["status"] == "optimal"
    (note,) = [one for one in found.result["findings"] if one["code"] == "other-signal"]
    power = signal["spectrum_of"]["input_power"]
    assert note["figures"]["input_power"] == pytest.approx(power, rel=1e-3)
    # The extra power is relative to the design, and the remedy of the note works.
    assert signal["extra_power"] == pytest.approx(signal["output_power"][0] / found.result["cost"] - 1)
    again = solve(parse_spec(DEAR_OUTPUT % f"amplitude: 1.95, input_power: {power}")).result["signal"]
    assert again["worst_ratio"] <= 1.0 + 1e-9


@pytest.mark.slow
def test_a_stated_kind_of_signal_is_not_replaced_and_the_proposed_one_works():
    stated = DEAR_OUTPUT + "signal: {type: ternary, candidates: 8}\n"
    told = refusals(lambda: solve(parse_spec(stated % "amplitude: 2")), InfeasibleError)[0]
    assert told.code == "limits-too-tight"
    kind, power = told.hint.split("signal.type: ")[1].split(" with limits.input_power: ")
    as_told = DEAR_OUTPUT + f"signal: {{type: {kind}, candidates: 8}}\n"
    found = solve(parse_spec(as_told % f"amplitude: 2, input_power: {power}"))
    assert found.result["signal"]["worst_ratio"] <= 1.0 + 1e-9


def test_a_two_level_record_is_within_6_percent_of_the_proved_least_peak():
    """The refusal at 1.8 states that no record of any kind with a peak below 1.80486 meets the accuracy."""
    stated = DEAR_OUTPUT + "signal: {type: binary, candidates: 8}\n"
    with pytest.raises(InfeasibleError) as caught:
        solve(parse_spec(stated % "amplitude: 1.8"))
    least = float(re.search(r"a peak of ([\d.]+) at least", caught.value.diagnostics[0].message)[1])
    found = solve(parse_spec(stated % f"amplitude: {1.06 * least}")).result["signal"]
    assert found["worst_ratio"] <= 1.0 + 1e-9
    assert found["peak"][0] <= 1.06 * least


def test_a_record_that_falls_short_of_the_best_accuracy_is_reported():
    spec = (
        PLANT.replace("500", "200")
        + WITHIN.format(0.01)
        + "objective: best_accuracy\nlimits: {amplitude: 0.4}\n"
    )
    spec += "spectrum: {type: fir, order: 4}\nsignal: {type: multisine, candidates: 1}\n"
    spec += "solver: {any_spectrum: false}\n"
    outcome = solve(parse_spec(spec))
    result = outcome.result
    more = result["signal"]["worst_ratio"] / result["objective"]["value"] - 1
    assert more > 0.01
    (found,) = [one for one in result["findings"] if one["code"] == "record-less-accurate"]
    assert found["figures"]["reached"] / found["figures"]["designed"] - 1 == pytest.approx(more)


LOOP = """
plant: {A: [1, -0.5], B: [0, 1.0, 0.3]}
noise: {C: [1, 0.4], variance: 0.2}
experiment: {samples: 100, controller: {numerator: [0.05], denominator: [1, -0.2]}}
accuracy: {model_error: {relative: 0.2}}
cost: {output_power: 1}
spectrum: {type: multisine, lines: 10}
"""


def test_the_noise_that_a_controller_passes_on_to_the_input_is_named():
    """With u = -0.3 y and y(t) = u(t-1) + e(t), the variance of u is a geometric series."""
    text = """
plant: {B: [0, 1.0]}
noise: {variance: 0.2}
experiment: {samples: 100, controller: {numerator: [0.3], denominator: [1]}}
accuracy: {model_error: {relative: 0.2}}
objective: best_accuracy
limits: {amplitude: {input: 2}}
spectrum: {type: multisine, lines: 5}
solver: {any_spectrum: false}
signal: {type: multisine, candidates: 1}
"""
    findings = solve(parse_spec(text)).outcome.findings
    (found,) = [one for one in findings if one.code == "noise-moves-input"]
    deviation = 0.3 * np.sqrt(0.2 / (1 - 0.3**2))
    assert found.figures["deviations"] == pytest.approx([deviation], rel=1e-9)


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("text", "power", "level", "relative"),
    [
        (PLANT + ERROR + FIR, "input_power", 0.2, 0.01),
        (LOOP, "output_power", 0.5, 0.2),
        (
            LOOP.replace("{type: multisine, lines: 10}", "{type: white}\nsignal: {type: binary}"),
            "output_power",
            0.3,
            0.2,
        ),
    ],
    ids=["noise", "sinusoids in a loop", "two levels in a loop"],
)
def test_the_stated_remedies_for_an_infeasible_power_limit_work(text, power, level, relative):
    """The remedies are a higher limit, a larger admissible error and a longer experiment."""
    least = solve(parse_spec(text)).result["power"][power.split("_")[0]][0]
    limited = f"{text}limits: {{{power}: %r}}\n"
    told = refusal(lambda: solve(parse_spec(limited % level)), InfeasibleError)
    assert (told.code, told.key) == ("infeasible", f"limits.{power}")
    assert told.location is not None
    needed = float(told.message.split(">= ")[1].split(",")[0])
    assert least * (1 - 1e-6) <= needed <= least * (1 + 1e-4)
    factor = float(told.hint.split("errors ")[1].split(" times")[0])
    assert factor == pytest.approx(np.sqrt(least / level), rel=1e-3) or "controller" in text
    found = solve(parse_spec(limited % (needed * (1 + 1e-6)))).result
    assert found["status"] == "optimal"
    wider = f"accuracy.model_error.relative={relative * factor * (1 + 1e-6):.12g}"
    longer = f"experiment.samples={re.search(r'experiment.samples: ([0-9]+)', told.hint)[1]}"
    for change in (wider, longer):
        assert solve(parse_spec(limited % level, overrides=[change])).result["status"] == "optimal"


def test_the_common_factor_of_two_infeasible_limits_just_suffices():
    limits = "limits: {input_power: 0.01, output_power: 0.1}\n"
    diagnostic = refused(PLANT + ERROR + FIR + limits)
    assert "no change of a single limit is enough" in diagnostic.message
    times = float(diagnostic.message.split("have to be ")[1].split(" times")[0])
    # The stated factor suffices, and 0.1 % less does not.
    raised = (
        f"limits: {{input_power: {0.01 * times * (1 + 1e-4)}, output_power: {0.1 * times * (1 + 1e-4)}}}\n"
    )
    assert run(ERROR + FIR + raised)["status"] == "optimal"
    lowered = (
        f"limits: {{input_power: {0.01 * times * (1 - 1e-3)}, output_power: {0.1 * times * (1 - 1e-3)}}}\n"
    )
    refused(PLANT + ERROR + FIR + lowered)


def test_a_limit_on_the_density_that_is_too_low_states_the_needed_factor():
    # A flat spectrum needs 1.705495; below that level no spectrum has more at any frequency.
    diagnostic = refused(PLANT + ERROR + FIR + "limits: {spectrum: 1.5}\n")
    times = float(diagnostic.message.split("limits.spectrum would have to be ")[1].split(" times")[0])
    assert times == pytest.approx(1.705495 / 1.5, rel=1e-4)


def test_contradictory_limits_are_refused_with_both_keys():
    limits = "limits: {input_power: 0.3, output_power: {min: 300}}\n"
    diagnostic = refused(PLANT + ERROR + FIR + limits, "contradictory-limits")
    assert all(power in diagnostic.message for power in ("output_power", "input_power"))
