"""What tests of bad specs share."""

import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification import parse_spec
from tests.support.bad_specs import BASE

UNTOLD = ("Input should", "valid dictionary", "Field required", "Extra inputs", "{key}", "type=", "\x00")


@pytest.fixture
def diagnostics():
    """What is said of a text that is no spec, and the line and column that the sign § marks in it."""

    def found(marked):
        index = marked.index("§") if "§" in marked else None
        with pytest.raises(SpecError) as caught:
            parse_spec(marked.replace("§", ""), "x.yaml")
        expected = None
        if index is not None:
            before = marked[:index]
            expected = (before.count("\n") + 1, index - (before.rfind("\n") + 1) + 1)
        return caught.value.diagnostics, expected

    return found


@pytest.fixture
def check_row(diagnostics):
    """The one complaint about a row names its code, its key, its place and what mends it."""

    def check(row):
        code, key, words, sections = row
        # A row may rename a section to put the mark before its key.
        merged = dict(BASE)
        for name, value in sections.items():
            merged.pop(name.lstrip("§"), None)
            merged[name] = value
        text = "".join(f"{k}: {v}\n" for k, v in merged.items() if v is not None)
        found, place = diagnostics(text)
        assert [(c.code, c.key) for c in found] == [(code, key)]
        (diagnostic,) = found
        assert words in diagnostic.message + " | " + diagnostic.hint
        assert diagnostic.location is not None
        if place is not None:
            assert (diagnostic.location.line, diagnostic.location.column) == place
            assert diagnostic.location.text == text.replace("§", "").splitlines()[place[0] - 1]
        for phrase in UNTOLD:
            assert phrase not in diagnostic.message + diagnostic.hint

    return check
