"""Every kind of finding is explained in plain words, and verdicts follow from severities alone."""

import re

import pytest

from inputdesign_cli import diagnostics
from inputdesign_cli.finding import Finding, Severity, trusted, undecided
from inputdesign_cli.findings import kinds
from tests.support.wording import long_sentences, unclear_words

CODE = re.compile(r"[a-z]+(-[a-z]+)*")


@pytest.mark.parametrize("kind", kinds().values(), ids=kinds())
def test_a_kind_is_explained(kind):
    assert CODE.fullmatch(kind.code)
    assert kind.title[0].isupper()
    assert not kind.title.endswith(".")
    assert kind.text.endswith(".")
    assert kind.remedy.endswith(".")
    assert "Args" not in kind.text
    assert long_sentences(f"{kind.text} {kind.remedy}") == []
    assert unclear_words(f"{kind.title}. {kind.text} {kind.remedy}") == []


def test_no_code_is_that_of_an_error_too():
    assert kinds().keys() & diagnostics.explanations().keys() == set()


@pytest.mark.parametrize(
    ("severity", "decides", "trusts"),
    [
        (Severity.NOTE, True, True),
        (Severity.DOUBT, True, False),
        (Severity.UNDECIDED, False, False),
        (Severity.REFUTED, False, False),
    ],
)
def test_severities_decide(severity, decides, trusts):
    found = [Finding("a", Severity.NOTE, "x"), Finding("b", severity, "y")]
    assert undecided(found) != decides
    assert trusted(found) == trusts
