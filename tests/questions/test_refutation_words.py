"""Refutations in sentences: probabilities below the smallest number, samples that come again."""

from types import SimpleNamespace

import pytest

from inputdesign_cli.findings.other_systems import SAMPLES_REPEATED, contradictions, differences, repetitions
from inputdesign_cli.identification.repeated import Repetition
from inputdesign_cli.outcome.shares import chance


@pytest.mark.parametrize(
    ("probability", "told"),
    [(0.0123, "1.2e-02"), (1e-299, "1.0e-299"), (1e-310, "below 1e-300"), (0.0, "below 1e-300")],
)
def test_no_probability_is_told_as_zero(probability, told):
    assert chance(probability) == told


def test_samples_that_come_again_in_a_record_without_a_file_are_told():
    estimate = SimpleNamespace(repeated=Repetition(162, 473, 76))
    (found,) = repetitions(estimate, ())
    assert (found.code, found.where) == ("samples-repeated", "the record")
    assert found.figures == {"samples": 76, "of": "the record"}


def test_files_with_rows_in_common_are_found_beside_no_repetition():
    copies = [SAMPLES_REPEATED.found("a.csv and b.csv have rows in common", where="b.csv")]
    (found,) = repetitions(SimpleNamespace(repeated=None), (), copies)
    assert (found.code, found.severity) == ("samples-repeated", "refuted")


def test_looks_share_the_level_of_what_they_may_end():
    """0.001 for records and 0.01 for a prior, of two records and twenty looks at data that come in."""
    estimate = SimpleNamespace(alike=(2e-5, 2e-5), agreement=4e-4, likeness=0.9)
    assert differences(estimate, ["a.csv", "b.csv"], looks=24)
    assert contradictions(estimate, looks=24)
    assert not differences(estimate, ["a.csv", "b.csv"], looks=26)
    assert not contradictions(estimate, looks=26)
