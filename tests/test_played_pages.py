"""The pages whose commands are run say what these say, and show what they draw."""

import re

import numpy as np
import pytest

import make_mechatronics
import make_records_page
import make_tutorial
from pages import DOCS

PAGES = {
    "mechatronics": (make_mechatronics.TEXT, make_mechatronics.mechatronics),
    "records": (make_records_page.TEXT, make_records_page.records),
    "tutorial": (make_tutorial.TEXT, make_tutorial.tutorial),
}
NUMBER = re.compile(r"-?\d+(\.\d+)?(e[+-]?\d+)?")


def written(name):
    return (DOCS / f"{name}.md").read_text(encoding="utf-8")


def shown(name):
    return set(re.findall(r"images/(\S+\.png)", written(name)))


@pytest.mark.parametrize("name", PAGES)
def test_the_page_is_that_of_the_script(name):
    """But for what the commands say: that fills the gaps."""
    text, _ = PAGES[name]
    gaps = r"(?:```\n.*?\n```|\d[\d.]*(?: %)?|(?:\|.*\|\n?)+)"
    expected = gaps.join(map(re.escape, re.split(r"\{\w+\}", text)))
    assert re.fullmatch(expected, written(name), re.DOTALL)
    assert shown(name) == {file.name for file in DOCS.glob(f"images/{name}_*")}


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_the_commands_still_say_what_the_page_says(name, tmp_path):
    images = tmp_path / "images"
    images.mkdir()
    _, page = PAGES[name]
    made = page(tmp_path, images)
    # Digits may differ from machine to machine; what is done and found, in which words, may not.
    assert NUMBER.sub("#", made) == NUMBER.sub("#", written(name))
    assert {file.name for file in images.iterdir()} == shown(name)


def test_the_tutorial_misses_and_then_meets():
    verdicts = re.findall(
        r"^verdict +(these data (?:miss|meet)) the accuracy", written("tutorial"), re.MULTILINE
    )
    assert verdicts == ["these data miss", "these data meet"]


def test_the_motor_of_mechatronics_is_identified_and_its_margin_kept():
    """The estimates are within three standard deviations of what was played, and |S| there is below 6 dB."""
    text = written("mechatronics")
    (said,) = re.findall(
        r"^estimate +gain ([\d.]+) \+- ([\d.]+), time_constant ([\d.]+) \+- ([\d.]+)", text, re.M
    )
    K, dK, T, dT = map(float, said)
    assert abs(K - make_mechatronics.GAIN) < 3 * dK
    assert abs(T - make_mechatronics.LAG) < 3 * dT
    (settings,) = re.findall(r"^loop +Kp ([\d.]+), Ti ([\d.]+) s", text, re.M)
    Kp, Ti = map(float, settings)
    step, fall = make_mechatronics.STEP, np.exp(-make_mechatronics.STEP / make_mechatronics.LAG)
    q = np.exp(-1j * np.geomspace(1e-4, np.pi, 20000))
    plant = make_mechatronics.GAIN * (1 - fall) * q**2 / (1 - fall * q)
    controller = Kp * (1 + step / (2 * Ti) * (1 + q) / (1 - q))
    assert np.max(1 / np.abs(1 + plant * controller)) < 10 ** (6 / 20)


def test_the_board_of_the_tutorial_is_that_of_its_log():
    """The energy balance follows the real temperature to half a degree."""
    parameters, step = make_tutorial.fitted_board()
    _, u1, _, y1, y2 = np.loadtxt(make_tutorial.LOG, delimiter=",", skiprows=1).T
    error = make_tutorial.answer(u1, y2, step, parameters, y1[0]) - y1
    assert np.sqrt(np.mean(error**2)) < 0.6
    assert 20.0 < parameters[3] < 40.0
