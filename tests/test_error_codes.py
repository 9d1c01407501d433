"""Every code that a diagnostic carries anywhere in the package is explained."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable

import pytest

from inputdesign_cli.diagnostics import explanation, explanations
from inputdesign_cli.findings import kinds
from tests.support.refusals import refused
from tests.support.wording import long_sentences, unclear_words
from tests.test_architecture import FILES, ROOT, nodes, offenders, room_of

MAKERS = {"Diagnostic", "complain", "_complain", "bad_spec", "PathDiagnostic", "stop", "_error", "because"}
CODE = re.compile(r"[a-z]+(-[a-z]+)*")


def codes_in(nodes: Iterable[ast.AST]) -> set[str]:
    """The string literals that stand for a code in calls that make diagnostics. A code is also the first of
    three texts that a function returns as code, message and hint."""
    found = set()
    for node in nodes:
        if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple) and len(node.value.elts) == 3:
            first = node.value.elts[0]
            found |= {first.value} if isinstance(first, ast.Constant) and "-" in str(first.value) else set()
        if not isinstance(node, ast.Call):
            continue
        called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if called not in MAKERS:
            continue
        arguments = [*node.args, *(k.value for k in node.keywords if k.arg == "code")]
        candidates = arguments[:1] if called != "_complain" else arguments[:2]
        for argument in candidates:
            parts = [argument.body, argument.orelse] if isinstance(argument, ast.IfExp) else [argument]
            found |= {p.value for p in parts if isinstance(p, ast.Constant) and isinstance(p.value, str)}
    return {code for code in found if CODE.fullmatch(code)}


def test_the_scan_finds_codes():
    source = "raise bad_spec('a-b', 'm')\nx.complain('c', 'm')\nDiagnostic(code='d-e', message='')"
    assert codes_in(ast.walk(ast.parse(source))) == {"a-b", "c", "d-e"}
    everything = set().union(*(codes_in(nodes(p)) for p in FILES if room_of(p) == "specification"))
    known = {"unknown-key", "unstable-polynomial", "duplicate-key", "file-missing", "needs-limits"}
    assert known <= everything


def test_every_code_is_explained():
    assert offenders(lambda path: codes_in(nodes(path)) - explanations().keys()) == {}


def test_every_code_with_an_explanation_is_used():
    source = "\n".join(p.read_text() for p in FILES)
    source += 'unknown-code"'
    assert [code for code in explanations() if f'{code}"' not in source] == []


@pytest.mark.parametrize("known", [explanations, kinds])
def test_explanations_of_errors_and_findings_are_complete(known):
    for code, entry in known().items():
        assert CODE.fullmatch(code), code
        assert entry.title[0].isupper(), code
        assert not entry.title.endswith("."), code
        assert entry.text.endswith("."), code
        assert entry.remedy.endswith("."), code
        assert "Args" not in entry.text, code
        assert long_sentences(f"{entry.text} {entry.remedy}") == [], code
        assert unclear_words(f"{entry.title}. {entry.text} {entry.remedy}") == [], code


def test_no_code_is_explained_twice():
    # A YAML reader keeps the last of two equal keys and says nothing.
    lines = (ROOT / "error_codes.yaml").read_text(encoding="utf-8").splitlines()
    stated = [line.removesuffix(":") for line in lines if CODE.match(line)]
    assert stated == list(explanations())
    assert kinds().keys() & explanations().keys() == set()


def test_an_unknown_code_is_refused_with_the_nearest_one():
    assert explanation("not-monic", explanations()).startswith("not-monic: ")
    assert refused(explanation, "not-monik", explanations())[0].hint == 'did you mean "not-monic"?'
