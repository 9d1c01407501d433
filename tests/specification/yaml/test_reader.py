"""Text to data: the scalar rules, syntax errors, limits, and files that are not text."""

from __future__ import annotations

import math
import os

import pytest

from inputdesign_cli.specification import load_spec, parse_spec
from inputdesign_cli.specification.yaml import reader
from inputdesign_cli.specification.yaml.reader import MAX_NODES, read
from inputdesign_cli.specification.yaml.scalars import resolve
from tests.support.refusals import refused

GOOD = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 1}\naccuracy: {model_error: {relative: 0.01}}\n"


VALUES = {
    "1": 1, "+1": 1, "-0": 0, "1.": 1.0, ".5": 0.5, "-.5": -0.5, "1e-3": 1e-3, "1E5": 1e5, "1.0e+3": 1000.0,
    "00.5": 0.5, "true": True, "False": False, "null": None, "~": None, "": None,
}  # fmt: skip


@pytest.mark.parametrize(("word", "value"), VALUES.items())
def test_scalars_without_quotes_become_values(word, value):
    assert resolve(word) == value
    assert type(resolve(word)) is type(value)


@pytest.mark.parametrize(
    "word",
    [
        "yes", "no", "on", "off", "y", "n", "010", "-010", "0x10", "0o10", "0b1", "1_000", "1:30", "1:30:20",
        "2001-01-01", ".inf", "-.Inf", ".nan", "inf", "nan", "1e", "e5", "1e400", "1e-400", "--1", "1 2", ".",
        "-", "١", "²",
    ],
)  # fmt: skip
def test_scalars_of_other_forms_stay_text(word):
    assert resolve(word) == word


def test_every_double_survives_writing_and_reading():
    for value in (0.1, 1e-308, 5e-324, 1.7976931348623157e308, -math.pi, 1e22, 123456789.123):
        assert resolve(repr(value)) == value


@pytest.mark.parametrize(
    ("text", "line", "column", "words"),
    [
        ("plant: {B: [0, 1\nnoise: 1\n", 2, 6, "closed"),
        ("plant: {B: [0, 1]\n", 1, 18, "closed"),
        ("plant:\n\tB: 1\n", 2, 1, "tab"),
        ("a: b: c\n", 1, 5, "colon"),
        ("a: 1\n b: 2\n", 2, 3, "colon"),
        ("a: 1\nbcd\n", 2, 4, "colon"),
        ("a: 'text\n", 1, 9, "quotation mark"),
        ("a: *nowhere\n", 1, 4, "anchor"),
        ("a: @x\n", 1, 4, "cannot begin"),
        ("a:\n  - 1\n - 2\n", 3, 2, "indentation"),
        ("a: %b\n", 1, 4, "cannot begin"),
        ("a: !foo!bar 1\n", 1, 4, "tag"),
    ],
)
def test_syntax_errors_have_a_place_and_plain_words(text, line, column, words):
    (diagnostic,) = refused(parse_spec, text, "x.yaml")
    assert diagnostic.code == "yaml-syntax"
    assert words in diagnostic.message + diagnostic.hint
    place = diagnostic.location
    assert (place.file, place.line, place.column) == ("x.yaml", line, column)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "empty-file"),
        ("# only a comment\n", "empty-file"),
        ("---\n", "empty-file"),
        ("- 1\n- 2\n", "not-a-mapping"),
        (GOOD + "---\n" + GOOD, "several-documents"),
        ("a: \x00", "file-encoding"),
        ("a: \ud800", "file-encoding"),
        ("a: " + "[" * 70 + "]" * 70, "yaml-limit"),
        ("\n".join(["a0: &a0 [1]"] + [f"a{i}: &a{i} [*a{i - 1}]" for i in range(1, 200)]), "yaml-limit"),
        ("a: " + "[" * 100_000, "yaml-limit"),
        ("a: " + "{x: " * 100_000, "yaml-limit"),
        ("- " * 100_000, "yaml-limit"),
        ("a: [" + "1, " * 200_001 + "]", "yaml-limit"),
        ("a: &a [*a]", "yaml-limit"),
        ("? " + "".join(f"&a{i} [" for i in range(20_000)) + "1" + "]" * 20_000 + "\n: 1", "yaml-limit"),
    ],
    ids=range(15),
)
def test_texts_that_hold_no_spec_are_refused(text, code):
    found = refused(parse_spec, text)
    assert [c.code for c in found] == [code]
    assert found[0].location is not None


def test_alias_bombs_are_refused_before_they_are_expanded(monkeypatch):
    """Twelve lines stand for 10^12 values; no more are made than a spec may hold."""
    made = []
    monkeypatch.setattr(reader, "resolve", lambda word: made.append(word))
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    assert [c.code for c in refused(parse_spec, "\n".join(lines))] == ["yaml-limit"]
    assert 150 < len(made) <= MAX_NODES + 1


def test_an_alias_stands_for_a_whole_value():
    spec = parse_spec(GOOD + "simulation: {plant: {B: &b [0, 2], F: [1, *h]}}\n".replace("*h", "-0.1"))
    assert spec.simulation.plant.B == (0.0, 2.0)
    spec = parse_spec(
        "plant: &p {B: [0, 1], F: [1, -0.5]}\n" + GOOD.split("\n", 1)[1] + "simulation: {plant: *p}\n"
    )
    assert spec.simulation.plant == spec.plant


def test_columns_count_characters():
    tree = read("été: [α, β]\n", "x")
    assert tree.places.values[("été", 1)].column == len("été: [α, ") + 1


def test_a_byte_order_mark_and_windows_line_ends_do_no_harm(tmp_path):
    file = tmp_path / "s.yaml"
    file.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert load_spec(file).plant.B == (0.0, 1.0)
    assert parse_spec("\ufeff" + GOOD).plant.B == (0.0, 1.0)
    assert load_spec(file).locate("noise").line == 2


@pytest.mark.parametrize(
    ("raw", "words", "line", "column"),
    [
        (GOOD.encode("utf-16"), "UTF-16", 1, 1),
        (b"title: a\nplant: caf\xe9\n", "0xE9", 2, 11),
        (b"\xff", "0xFF", 1, 1),
    ],
)
def test_other_encodings_are_refused_at_their_first_wrong_byte(tmp_path, raw, words, line, column):
    file = tmp_path / "s.yaml"
    file.write_bytes(raw)
    (diagnostic,) = refused(load_spec, file)
    assert diagnostic.code == "file-encoding"
    assert words in diagnostic.message
    assert (diagnostic.location.line, diagnostic.location.column) == (line, column)


def test_files_that_cannot_be_read_are_refused_with_a_hint(tmp_path):
    (tmp_path / "first_order.yaml").write_text(GOOD)

    def code_and_hint(path):
        (diagnostic,) = refused(load_spec, path)
        assert diagnostic.location.file == os.fspath(path)
        return diagnostic.code, diagnostic.hint

    assert code_and_hint(tmp_path) == ("file-unreadable", "name the YAML file itself")
    code, hint = code_and_hint(tmp_path / "frist_order.yaml")
    assert code == "file-missing"
    assert hint == f'did you mean "{tmp_path / "first_order.yaml"}"?'
    assert code_and_hint(tmp_path / "first_order")[1].endswith('first_order.yaml"?')
    assert "no folder" in code_and_hint(tmp_path / "nowhere" / "x.yaml")[1]
    assert code_and_hint("a\0b")[0] == "file-unreadable"
    assert code_and_hint("x" * 5000)[0] == "file-unreadable"
    big = tmp_path / "big.yaml"
    big.write_bytes(b"#" * (10 * 1024 * 1024 + 1))
    assert code_and_hint(big)[0] == "file-too-large"


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="the superuser may read everything")
def test_a_file_without_permission_is_refused(tmp_path):
    file = tmp_path / "s.yaml"
    file.write_text(GOOD)
    file.chmod(0)
    assert refused(load_spec, file)[0].code == "file-unreadable"
