"""What can be wrong with the keys, the values and the YAML of any section: where it is reported, under which code and key.

See `tests.support.bad_specs` for the sign §.
"""

# ruff: noqa: E501 (a row is easier to read on one line)

from __future__ import annotations

from tests.support.bad_specs import Row, each

ROWS: list[Row] = [
    # keys
    ("unknown-key", "plants", 'did you mean "plant"', {"§plants": "1"}),
    ("unknown-key", "sampletime", 'did you mean "sample_time"', {"§sampletime": "1"}),
    ("unknown-key", "Ts", 'did you mean "sample_time"', {"§Ts": "1"}),
    ("unknown-key", "alpha", "belongs under accuracy.model_error", {"§alpha": "2"}),
    ("unknown-key", "noise.vairance", "", {"noise": "{variance: 1, §vairance: 2}"}),
    ("unknown-key", "plant.limits", "belongs at the top level", {"plant": "{B: [0, 1], §limits: {}}"}),
    ("missing-key", "plant", '"plant"', {"plant": None}),
    ("missing-key", "noise", "variance: 1", {"noise": None}),
    ("missing-key", "noise.variance", '"variance"', {"§noise": "{C: [1]}"}),
    ("missing-key", "plant.B", '"B"', {"§plant": "{F: [1]}"}),
    ("empty-value", "noise", "no value", {"§noise": ""}),
    ("empty-value", "plant.F", "no value", {"plant": "{B: [0, 1], §F: null}"}),
    ("empty-value", "accuracy.model_error.45", "decimal point", {
        "accuracy": "{model_error: {relative: 0.01, alpha: 2,§45}}"}),
    ("duplicate-key", "plant.B", "twice, on line 3", {"plant": "{B: [0, 1], §B: [0, 2]}"}),
    # kinds of values
    ("wrong-shape", "plant", "mapping", {"plant": "§3"}),
    ("wrong-shape", "noise", "mapping", {"noise": "§[1]"}),
    ("wrong-shape", "spectrum", "mapping", {"spectrum": "§fir"}),
    ("wrong-shape", "accuracy.model_error", "mapping", {"accuracy": "{model_error: §0.01}"}),
    ("wrong-shape", "uncertainty.intervals.b1", "two numbers, not 1", {
        "uncertainty": "{intervals: {b1: §[0.7]}}"}),
    ("wrong-shape", "uncertainty.intervals.b1", "two numbers, not 3", {
        "uncertainty": "{intervals: {b1: §[0.7, 0.8, 0.9]}}"}),
    ("not-a-number", "sample_time", "true", {"sample_time": "§true"}),
    ("not-a-number", "sample_time", 'the text "yes"', {"sample_time": "§yes"}),
    ("not-a-number", "sample_time", "a list", {"sample_time": "§[1]"}),
    ("not-a-number", "sample_time", "write 10", {"sample_time": "§010"}),
    ("not-a-number", "sample_time", "decimal: 16", {"sample_time": "§0x10"}),
    ("not-a-number", "sample_time", "underscores: 1000", {"sample_time": "§1_000"}),
    ("not-a-number", "sample_time", "1:30", {"sample_time": "§1:30"}),
    ("not-a-number", "sample_time", "2001-01-01", {"sample_time": "§2001-01-01"}),
    ("not-a-number", "sample_time", "decimal point: 0.5", {"sample_time": "§0,5"}),
    ("not-a-number", "sample_time", "write 0.005", {"sample_time": "§5 ms"}),
    ("not-a-number", "sample_time", "remove the quotes", {"sample_time": "§'1e-3'"}),
    ("not-a-number", "sample_time", "3.14159", {"sample_time": "§pi"}),
    ("not-a-number", "accuracy.model_error.relative", "fraction: 0.01", {
        "accuracy": "{model_error: {relative: §1%}}"}),
    ("not-finite", "sample_time", "finite", {"sample_time": "§.inf"}),
    ("not-finite", "sample_time", "finite", {"sample_time": "§-.INF"}),
    ("not-finite", "sample_time", "finite", {"sample_time": "§.nan"}),
    ("not-finite", "sample_time", "too large", {"sample_time": "§1e400"}),
    ("not-finite", "sample_time", "too large", {"sample_time": "§" + "9" * 5000}),
    ("not-finite", "sample_time", "too small", {"sample_time": "§1e-400"}),
    ("out-of-range", "sample_time", "greater than 0, not 0", {"sample_time": "§0"}),
    ("out-of-range", "sample_time", "greater than 0, not -1", {"sample_time": "§-1"}),
    ("unknown-word", "time_unit", 'did you mean "min"', {"time_unit": "§minutes"}),
    ("unknown-word", "objective", 'did you mean "least_cost"', {"objective": "§least-cost"}),
    ("unknown-word", "objective", "the number 3", {"objective": "§3"}),
    ("not-a-text", "title", "a list", {"title": "§[a]"}),
    ("not-a-whole-number", "experiment.samples", "500 or 501", {"experiment": "{samples: §500.5}"}),
    ("out-of-range", "experiment.samples", "at least 1", {"experiment": "{samples: §0}"}),
    ("out-of-range", "experiment.samples", "at most", {"experiment": "{samples: §1e30}"}),
    # YAML that is read but not wanted
    ("yaml-tag", "plant.B", "remove the tag", {"plant": "{B: §!!python/tuple [0, 1]}"}),
    ("yaml-tag", "sample_time", "float", {"sample_time": "§!!float 1"}),
    ("yaml-merge-key", "plant.<<", "alias", {"plant": "{B: [0, 1], §<<: {F: [1]}}"}),
    ("bad-key", "plant", "not a word", {"plant": "{B: [0, 1], §[1]: 2}"}),
    ("bad-text", "title", "U+0001", {"title": '§"\\x01"'}),
]  # fmt: skip


@each(ROWS)
def test_the_complaint_names_code_key_place_and_remedy(row, check_row):
    check_row(row)


def test_all_complaints_come_together_in_the_order_of_the_file(diagnostics):
    text = (
        "title: many\n"
        "sampletime: 1\n"
        "plant: {B: [0, x], F: [2, 1]}\n"
        "accuracy:\n"
        "  model_error: {relative: -1, confidence: 95, alpha: 2}\n"
        "limits: {band: [2, 1]}\n"
        "signal: {type: binary, phases: random}\n"
    )
    found, _ = diagnostics(text)
    assert [(c.location.line, c.code) for c in found] == [
        (1, "missing-key"),
        (2, "unknown-key"),
        (3, "not-a-number"),
        (3, "not-monic"),
        (5, "out-of-range"),
        (5, "out-of-range"),
        (6, "bad-band"),
        (7, "unsuitable-key"),
    ]


def test_a_mistake_does_not_cause_further_complaints(diagnostics):
    # A broken controller must not make the unstable plant a second mistake, nor a broken requirement
    # leave nothing asked.
    found, _ = diagnostics(
        "plant: {B: [0, 1], A: [1, -2]}\nnoise: {variance: 1}\n"
        "experiment: {controller: {numerator: [x], denominator: [1]}}\n"
        "accuracy: {model_error: {relative: x}}\n"
    )
    assert [c.key for c in found] == ["experiment.controller.numerator[0]", "accuracy.model_error.relative"]


def test_a_mistake_does_not_hide_another_in_the_same_section(diagnostics):
    found, _ = diagnostics(
        "plant: {B: [0, 1], F: [1, x]}\nnoise: {variance: 1}\n"
        "accuracy: {model_error: {relative: 0.01, alpha: 2, confidence: 0.9, band: [0, x]}}\n"
    )
    assert [c.key for c in found] == [
        "plant.F[1]",
        "accuracy.model_error.alpha",
        "accuracy.model_error.band[1]",
    ]


def test_a_missing_choice_is_reported_beside_a_broken_sibling(diagnostics):
    found, _ = diagnostics(
        "plant: {B: [0, 1]}\nnoise: {variance: 1}\naccuracy: {model_error: {band: [2, 1]}}\n"
    )
    assert [(c.code, c.key) for c in found] == [
        ("missing-key", "accuracy.model_error"),
        ("bad-band", "accuracy.model_error.band"),
    ]


def test_a_misspelt_key_is_not_missing_as_well(diagnostics):
    found, _ = diagnostics("plant: {b: [0, 1]}\nnose: {variance: 1}\nacuracy: {model_error: {relative: 1}}\n")
    assert [(c.key, c.hint) for c in found] == [
        ("plant.b", 'did you mean "B"?'),
        ("nose", 'did you mean "noise"?'),
        ("acuracy", 'did you mean "accuracy"?'),
    ]
