"""The tutorial says what its commands say, and shows what they draw."""

import importlib.util
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parent.parent / "docs"
NUMBER = re.compile(r"-?\d+(\.\d+)?(e[+-]?\d+)?")


@pytest.fixture
def script():
    found = importlib.util.spec_from_file_location("make_tutorial", DOCS / "make_tutorial.py")
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


def without_blocks(text):
    return NUMBER.sub("#", re.sub(r"```.*?```", "```", text, flags=re.DOTALL))


def test_the_page_is_that_of_the_script(script):
    page = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    blocks = dict.fromkeys(("explore", "solve", "first", "second"), "``` ```")
    numbers = dict.fromkeys(("white", "spectrum", "record", "ratio"), "0") | {"validated": "0 %"}
    text = script.TEXT
    for name, value in (blocks | numbers).items():
        text = text.replace(f"{{{name}}}", value)
    assert without_blocks(page) == without_blocks(text)


def test_the_board_is_that_of_the_log(script):
    """The energy balance follows the real temperature to half a degree."""
    parameters, step = script.fitted_board()
    _, u1, _, y1, y2 = script.np.loadtxt(script.LOG, delimiter=",", skiprows=1).T
    error = script.answer(u1, y2, step, parameters, y1[0]) - y1
    assert script.np.sqrt(script.np.mean(error**2)) < 0.6
    assert 20.0 < parameters[3] < 40.0


@pytest.mark.slow
def test_the_commands_still_say_what_the_page_says(script, tmp_path):
    images = tmp_path / "images"
    images.mkdir()
    made = script.tutorial(tmp_path, images)
    page = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    # Digits may differ from machine to machine; what is done, in which words, and the verdicts may not.
    assert NUMBER.sub("#", made) == NUMBER.sub("#", page)
    assert "these data miss the accuracy" in made
    assert "these data meet the accuracy" in made
    shown = set(re.findall(r"images/(\S+\.png)", page))
    assert (
        shown == {file.name for file in images.iterdir()} == {f.name for f in DOCS.glob("images/tutorial_*")}
    )
