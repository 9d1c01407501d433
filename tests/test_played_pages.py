"""Pages whose commands are run have the text and the figures of these commands."""

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
def test_the_page_has_the_text_of_its_script(name):
    """The output of commands fills the gaps of the text."""
    text, _ = PAGES[name]
    gaps = r"(?:```\n.*?\n```|\d[\d.]*(?: %)?|(?:\|.*\|\n?)+)"
    expected = gaps.join(map(re.escape, re.split(r"\{\w+\}", text)))
    assert re.fullmatch(expected, written(name), re.DOTALL)
    assert shown(name) == {file.name for file in DOCS.glob(f"images/{name}_*")}


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_the_commands_still_print_the_text_of_the_page(name, tmp_path):
    images = tmp_path / "images"
    images.mkdir()
    _, page = PAGES[name]
    made = page(tmp_path, images)
    # Digits may differ between machines; words may not.
    assert NUMBER.sub("#", made) == NUMBER.sub("#", written(name))
    assert {file.name for file in images.iterdir()} == shown(name)


def test_the_tutorial_misses_and_then_meets_its_accuracy():
    verdicts = re.findall(
        r"^verdict +(these data (?:miss|meet)) the accuracy", written("tutorial"), re.MULTILINE
    )
    assert verdicts == ["these data miss", "these data meet"]


def test_the_motor_of_mechatronics_is_identified_and_its_margin_kept():
    """The estimates are within three standard deviations of the simulated motor; |S| is below 6 dB."""
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


def test_the_log_of_the_tutorial_is_that_of_the_script():
    assert make_tutorial.LOG.read_text(encoding="utf-8") == make_tutorial.log_text()


def test_the_plant_of_the_tutorial_answers_a_step_as_its_numbers_say():
    """A lag behind a dead time: K (1 - exp(-(t - L) / T)) per unit of the step, within the noise."""
    valve = np.repeat([45.0, 46.0], [100, 3000])
    found = np.mean([make_tutorial.answer(valve, np.random.default_rng(n)) for n in range(50)], axis=0) - 82.0
    late = np.maximum(np.arange(-100, 3000) - make_tutorial.DEAD, 0)
    wanted = make_tutorial.GAIN * -np.expm1(-late / make_tutorial.LAG)
    assert np.abs(found - wanted).max() < 6 * make_tutorial.NOISE / np.sqrt(50)


def test_the_estimates_of_the_tutorial_agree_with_the_simulated_plant():
    """Every estimate on the page is within three of its standard deviations of the truth."""
    truth = {"K": make_tutorial.GAIN, "T": make_tutorial.LAG, "L": make_tutorial.DEAD}
    found = re.findall(r"\b([KTL]) ([\d.]+) \+- ([\d.]+)", written("tutorial"))
    assert len(found) == 9
    assert all(abs(float(value) - truth[name]) < 3 * float(spread) for name, value, spread in found)
