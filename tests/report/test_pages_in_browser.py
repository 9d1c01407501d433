"""Pages in a real browser: no part is clipped, the width is used, and axe-core finds no violation."""

import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import assess, load_spec, parse_spec, simulate, solve
from inputdesign_cli.errors import Location, SpecError
from inputdesign_cli.live.pages import Followed, message_page
from inputdesign_cli.outcome.run_directory import write_run
from inputdesign_cli.questions import explore
from inputdesign_cli.report.render import report_text
from tests.support.browser import clipped, needs_browser, started, violations
from tests.support.campaigns import applied
from tests.support.pages import SPEC, recorded
from tests.support.sweep_files import run_sweep

pytestmark = [needs_browser, pytest.mark.browser]

SPECS = Path(__file__).parents[2] / "specs"
LINE = "accuracy: {model_error: {relativ: 0.01, confidence: 0.95, band: [0.001, 3.1415926535]}}"
PLACE = Location("s.yaml", 1, 26, LINE)
FAULT = SpecError.because("unknown-key", "relativ is unknown", "did you mean relative?", location=PLACE)
WRONG = Followed("s.yaml").failed(FAULT, [LINE], "s.yaml")


# Small specs with a page of each kind, and the verb that is called with them.
KINDS = {
    "two inputs": (solve, "two_by_two_given", []),
    "robust": (solve, "robust_first_order", ["uncertainty.scenarios=5", "uncertainty.fresh=10"]),
    "loop": (solve, "heater_loop", ["signal.candidates=1", "spectrum.lines=20"]),
    "moments": (solve, "regression", ["experiment.samples=60"]),
    "lines": (solve, "frequency_response", []),
    "campaigns": (simulate, "campaign", ["simulation.runs=3"]),
    "study": (simulate, "first_order", ["simulation.runs=10", "spectrum.order=2"]),
}
SWEEPS = {
    "sweep": (["experiment.samples=50,100,-1", "spectrum.order=1,2"], slice(None)),
    "sweep of three": (
        ["experiment.samples=50,100", "spectrum.order=1,2", "noise.variance=1,2"],
        slice(None),
    ),
    "sweep in progress": (["experiment.samples=50,100,200"], slice(0, 3)),
}


MESSAGES = {
    "waiting": message_page("sweep", "3 points have a result so far.", "shows what comes"),
    "wrong": WRONG.page,
}
OF_RECORDS = {
    "assessed": lambda record: assess(parse_spec(SPEC % ""), record).results,
    "explored": lambda record: explore([record]).results,
}
NAMES = ["open", "closed", *KINDS, *SWEEPS, *OF_RECORDS, "campaign", "campaign begun", *MESSAGES]


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """A record that misses the accuracy."""
    return recorded(tmp_path_factory.mktemp("record") / "data.csv")


@pytest.fixture(scope="module")
def place(runs, record, tmp_path_factory):
    """The directory with the run of a page, by the kind of page; it is made at its first use."""
    folder = tmp_path_factory.mktemp("pages")

    def sweep(name):
        settings, rows = SWEEPS[name]
        run_sweep(runs / "open.yaml", settings, directory=folder / name)
        table = folder / name / "sweep.csv"
        lines = table.read_text().splitlines()[rows]
        pending = ",".join(["800", "pending", *[""] * (lines[0].count(",") - 1)])
        table.write_text("\n".join([*lines, *[pending] * (rows.stop is not None), ""]))

    def campaign(name):
        idesign("campaign", SPECS / "campaign.yaml", "-o", folder / name, "--no-figures", "-q")
        if name == "campaign":
            part = applied(folder / name, folder / "part.csv")
            idesign("next", folder / name, part, "--no-figures", "-q")

    @cache
    def made(name):
        if name in ("open", "closed"):
            return runs / name
        if name in KINDS:
            verb, spec, overrides = KINDS[name]
            write_run(verb(load_spec(SPECS / f"{spec}.yaml", overrides)), folder / name)
        elif name in OF_RECORDS:
            write_run(OF_RECORDS[name](record), folder / name)
        else:
            (sweep if name in SWEEPS else campaign)(name)
        return folder / name

    return made


def idesign(*words):
    subprocess.run([sys.executable, "-m", "inputdesign_cli", *map(str, words)], check=True)


@pytest.fixture(scope="module")
def address(place, tmp_path_factory):
    """The address of a page, by the kind of page."""
    folder = tmp_path_factory.mktemp("html")

    @cache
    def of(name):
        path = folder / f"{name}.html"
        path.write_text(MESSAGES[name] if name in MESSAGES else report_text(place(name)))
        return path.as_uri()

    return of


@pytest.fixture(scope="module")
def browser():
    with started() as found:
        yield found


@pytest.fixture
def shown(address, browser):
    """Opens a page of a kind."""

    def opened(name):
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.goto(address(name))
        return page

    return opened


@pytest.mark.first(2)
@pytest.mark.parametrize(("width", "scheme"), [(400, "dark"), (1400, "light"), (672, "paper")])
@pytest.mark.parametrize("name", NAMES)
def test_a_page_is_accessible_and_nothing_is_clipped(address, browser, name, scheme, width):
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.emulate_media(**{"media": "print"} if scheme == "paper" else {"color_scheme": scheme})
    page.goto(address(name))
    assert violations(page) == []
    assert clipped(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert small_text(page) == []
    used = page.evaluate("document.querySelector('main').getBoundingClientRect().width")
    assert used > 0.9 * width
    page.close()


def small_text(page):
    """The kinds of pictures that are no SVG, whose text may be smaller than that of the page."""
    return page.evaluate("""() => [...document.querySelectorAll("figure img")]
        .map((e) => e.src.slice(0, 22)).filter((kind) => kind !== "data:image/svg+xml;bas")""")


def test_the_contents_lead_to_headings_by_keyboard(shown):
    page = shown("open")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    assert page.url.endswith("#the-question")
    missing = page.evaluate("""() => [...document.querySelectorAll("nav a")]
        .filter((a) => !document.querySelector(a.getAttribute("href"))).map((a) => a.textContent)""")
    assert missing == []


def test_values_are_shown_at_the_pointer_and_by_the_arrow_keys(shown, runs):
    """The values agree with bound.csv at the frequency that is shown, to the digits that are shown."""
    table = np.genfromtxt(runs / "open" / "bound.csv", delimiter=",", names=True)
    w, r_u = table[table.dtype.names[0]], table["r_u"]
    page = shown("open")
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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "parts", "figure"),
    [
        ("sweep", ["number of samples N (100|50) ", "cost: order = 1 [0-9.]+; floor"], 0),
        (
            "robust",
            [
                "frequency",
                "r_u / r_adm: largest of 5 plants [0-9.e-]+; plant of the spec .*; decides, plant [0-9]",
            ],
            1,
        ),
        ("loop", ["frequency ω .rad/s. ", "C G, nominal: real part", "distance of the disc from −1 "], 1),
        ("lines", ["frequency", "power [0-9.e-]+"], 1),
        ("assessed", ["time", "predicted one step ahead"], 0),
    ],
)
def test_every_kind_of_curve_shows_its_values(shown, name, parts, figure):
    page = shown(name)
    plot = page.locator("figure").nth(figure).locator("[role=slider]")
    answer = plot.locator("xpath=following-sibling::p")
    box = plot.bounding_box()
    plot.hover(position={"x": 0.4 * box["width"], "y": 0.6 * box["height"]})
    pointed = answer.inner_text()
    plot.press("End")
    plot.press("ArrowLeft")
    for text in (pointed, answer.inner_text()):
        for part in parts:
            assert re.search(part, text), (part, text)
    assert plot.get_attribute("aria-valuetext") == answer.inner_text()
    assert violations(page) == []


@pytest.mark.slow
def test_the_point_of_a_nyquist_plot_is_on_its_curve(shown, place):
    """The values at the ring are C G of nyquist.csv at the frequency that is shown."""
    table = np.genfromtxt(place("loop") / "nyquist.csv", delimiter=",", names=True)
    w, loop = table[table.dtype.names[0]], table["CG_re"] + 1j * table["CG_im"]
    page = shown("loop")
    plot = page.locator("figure").nth(1).locator("[role=slider]")
    box = plot.bounding_box()
    for across, down in ((0.5, 0.5), (0.6, 0.7), (0.4, 0.6)):
        plot.hover(position={"x": across * box["width"], "y": down * box["height"]})
        text = plot.get_attribute("aria-valuetext")
        at, real, imaginary = (
            float(re.search(rf"{name} (-?[0-9.e-]+)", text)[1])
            for name in (r"\)", "real part", "imaginary part")
        )
        assert complex(real, imaginary) == pytest.approx(loop[np.abs(w - at).argmin()], abs=0.02)


def test_a_page_without_scripts_shows_the_same_pictures(address, browser):
    page = browser.new_context(java_script_enabled=False).new_page()
    page.goto(address("open"))
    assert page.locator("figure img").count() >= 4
    assert page.locator("[role=slider]").count() == 0


def test_all_numbers_are_folded_until_they_are_asked_for(shown):
    page = shown("open")
    cell = page.get_by_text("objective.lower_bound", exact=True)
    assert not cell.is_visible()
    page.locator("summary").click()
    assert cell.is_visible()
