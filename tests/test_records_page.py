"""The page of the converter says what its commands say, and shows what they draw."""

import importlib.util
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parent.parent / "docs"
NUMBER = re.compile(r"-?\d+(\.\d+)?(e[+-]?\d+)?")


@pytest.fixture
def script():
    found = importlib.util.spec_from_file_location("make_records_page", DOCS / "make_records_page.py")
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


def without_blocks(text):
    return NUMBER.sub("#", re.sub(r"```.*?```", "```", text, flags=re.DOTALL))


def test_the_page_is_that_of_the_script(script):
    page = (DOCS / script.PAGE).read_text(encoding="utf-8")
    text = script.TEXT.replace("{converter_left}", "0 %")
    for name in script.STEPS:
        text = text.replace(f"{{{name}}}", "``` ```")
    assert without_blocks(page) == without_blocks(text)
    shown = set(re.findall(r"images/(\S+\.png)", page))
    assert shown == {file.name for file in DOCS.glob("images/records_*")}


@pytest.mark.slow
def test_the_commands_still_say_what_the_page_says(script, tmp_path):
    images = tmp_path / "images"
    images.mkdir()
    made = script.page(tmp_path, images)
    # Digits may differ from machine to machine; what is found, and in which words, may not.
    page = (DOCS / script.PAGE).read_text(encoding="utf-8")
    assert NUMBER.sub("#", made) == NUMBER.sub("#", page)
