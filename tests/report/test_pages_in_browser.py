"""Pages in a real browser: no part is clipped, the width is used, and axe-core has nothing to say."""

import re

import numpy as np
import pytest

from inputdesign_cli.report.render import report_text
from inputdesign_cli.sweep.running import sweep
from tests.support.browser import clipped, needs_browser, started, violations

pytestmark = [needs_browser, pytest.mark.browser]


@pytest.fixture(scope="module")
def pages(runs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    sweep(runs / "open.yaml", ["experiment.samples=50,100,-1", "spectrum.order=1,2"], directory=folder / "s")
    for name, place in (("open", runs / "open"), ("closed", runs / "closed"), ("sweep", folder / "s")):
        (folder / f"{name}.html").write_text(report_text(place))
    return folder


@pytest.fixture(scope="module")
def browser():
    with started() as found:
        yield found


@pytest.mark.parametrize("name", ["open", "closed", "sweep"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [400, 1400])
def test_a_page_is_accessible_and_nothing_is_clipped(pages, browser, name, scheme, width):
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page.goto((pages / f"{name}.html").as_uri())
    assert violations(page) == []
    assert clipped(page) == []
    used = page.evaluate("document.querySelector('main').getBoundingClientRect().width")
    assert used > 0.9 * width
    page.close()


def test_the_contents_lead_to_headings_by_keyboard(pages, browser):
    page = browser.new_page()
    page.goto((pages / "open.html").as_uri())
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    assert page.url.endswith("#the-question")
    missing = page.evaluate("""() => [...document.querySelectorAll("nav a")]
        .filter((a) => !document.querySelector(a.getAttribute("href"))).map((a) => a.textContent)""")
    assert missing == []


def test_values_are_told_where_one_points_and_by_the_arrow_keys(pages, browser, runs):
    """They are those of bound.csv, to the digits that are shown, at the frequency that is shown."""
    table = np.genfromtxt(runs / "open" / "bound.csv", delimiter=",", names=True)
    w, r_u = table[table.dtype.names[0]], table["r_u"]
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    page.goto((pages / "open.html").as_uri())
    plot = page.locator("[role=slider]").first
    told = plot.locator("xpath=following-sibling::p")
    box = plot.bounding_box()
    said = {told.inner_text()}
    for share in (0.3, 0.5, 0.8):
        plot.hover(position={"x": share * box["width"], "y": 0.3 * box["height"]})
        text = told.inner_text()
        said.add(text)
        frequency, error = re.search(r"\) ([\d.e+-]+) \|.*?r_u, design ([\d.e+-]+)", text).groups()
        assert float(error) == pytest.approx(np.interp(float(frequency), w, r_u), rel=2e-3)
    plot.focus()
    page.keyboard.press("ArrowRight")
    said.add(told.inner_text())
    assert len(said) == 5
    assert plot.get_attribute("aria-valuetext") == told.inner_text()
    assert violations(page) == []


def test_a_page_without_scripts_shows_the_same_pictures(pages, browser):
    page = browser.new_context(java_script_enabled=False).new_page()
    page.goto((pages / "open.html").as_uri())
    assert page.locator("figure img").count() >= 4
    assert page.locator("[role=slider]").count() == 0


def test_all_numbers_are_folded_until_they_are_asked_for(pages, browser):
    page = browser.new_page()
    page.goto((pages / "open.html").as_uri())
    cell = page.get_by_text("objective.lower_bound", exact=True)
    assert not cell.is_visible()
    page.locator("summary").click()
    assert cell.is_visible()
