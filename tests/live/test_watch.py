"""`idesign watch`: a saved file is a new page, errors stand at their line, the last good design stays."""

import http.client
import re
import subprocess
import sys
import time
from contextlib import closing, contextmanager
from urllib.parse import urlsplit

import pytest

from inputdesign_cli.errors import Location, SpecError
from inputdesign_cli.live.pages import Followed
from tests.support.browser import clipped, needs_browser, started, violations
from tests.support.pages import SPEC
from tests.support.processes import running

PATIENCE = 120.0


@contextmanager
def watching(path, *more, stderr=None):
    """The address of the page; what else is told goes to the file `stderr`."""
    command = [sys.executable, "-m", "inputdesign_cli", "watch", str(path), *map(str, more)]
    with running(command, stdout=subprocess.PIPE, stderr=stderr, text=True, cwd=path.parent) as process:
        yield process.stdout.readline().strip()
        process.terminate()
        process.wait(30)


def page_with(address, part):
    """The page, once it has this part."""
    found, end = urlsplit(address), time.monotonic() + PATIENCE
    text = ""
    while time.monotonic() < end:
        with closing(http.client.HTTPConnection(found.hostname, found.port, timeout=30)) as connection:
            connection.request("GET", found.path)
            text = connection.getresponse().read().decode()
        if part in text:
            return text
        time.sleep(0.1)
    raise AssertionError(f"{part!r} never came; the page says {text[-3000:]}")


@pytest.fixture
def spec(tmp_path):
    path = tmp_path / "spec.yaml"
    path.write_text(SPEC % "")
    return path


def saved(spec, old, new):
    text = spec.read_text()
    assert old in text
    spec.write_text(text.replace(old, new))


def answers(text):
    return re.findall(r'<p class="answer">[^<]*?costs ([0-9.e-]+)', text)


def test_a_saved_file_is_solved_and_stands_beside_what_was_good(spec, tmp_path):
    run = tmp_path / "run"
    with watching(spec, "-o", run, "--no-figures") as address:
        (first,) = answers(page_with(address, "The certificate"))
        assert (run / "result.json").is_file()
        saved(spec, "relative: 0.1", "relative: 0.2")
        text = page_with(address, "The one before")
        assert answers(text)[1] == first
        # Four times the variance is a quarter of the cost.
        assert float(answers(text)[0]) == pytest.approx(float(first) / 4, rel=1e-4)
        saved(spec, "relative: 0.2", "relativ: 0.2")
        text = page_with(address, "What is wrong")
        line = 1 + spec.read_text()[: spec.read_text().index("relativ:")].count("\n")
        assert f"spec.yaml, line {line}, column" in text
        assert re.search(rf"<mark> *{line} \| accuracy", text)
        assert "The last good design" in text
        assert answers(text)[1] == first
        spec.unlink()
        assert "The last good design" in page_with(address, "file-missing")
        spec.write_text(SPEC % "")
        text = page_with(address, "Computed at")
        assert answers(text)[0] == first
        assert "What is wrong" not in text  # what has been mended is wrong no longer


@pytest.mark.slow
def test_the_answer_is_shown_before_the_pictures_are_drawn(spec, tmp_path):
    """Within half a second beside solving, of which the page tells, where nothing else is under way."""
    with watching(spec, "-o", tmp_path / "run", "--no-figures") as address:
        page_with(address, "data:image/svg")
        waited = []
        for old, new in (("0.1,", "0.2,"), ("0.2,", "0.3,"), ("0.3,", "0.4,")):
            before = page_with(address, "Computed at")
            saved(spec, f"relative: {old}", f"relative: {new}")
            started = time.monotonic()
            text = ""
            while answers(text) in ([], answers(before)):
                text = page_with(address, "Computed at")
            waited.append(time.monotonic() - started - float(re.search(r"in ([\d.]+) s", text)[1]))
            page_with(address, " s.</p>")  # the pictures
        assert min(waited) < 0.5


@pytest.mark.slow
def test_the_terminal_keeps_a_line_of_every_round(spec, tmp_path):
    with (
        open(tmp_path / "told.txt", "w") as told,
        watching(spec, "-o", tmp_path / "run", "--no-figures", stderr=told) as address,
    ):
        page_with(address, "data:image/svg")
        saved(spec, "relative: 0.1", "relativ: 0.1")
        page_with(address, "What is wrong")
    lines = (tmp_path / "told.txt").read_text()
    assert lines.index("Ctrl-C ends it") < lines.index("Computed at") < lines.index("[unknown-key]")
    assert "did you mean" in lines


def test_what_the_user_writes_is_text_on_the_page():
    line = "a: '<script>alert(1)</script>'"
    wrong = SpecError.because("unknown-key", line, line, location=Location("s.yaml", 1, 1, line))
    text = Followed("<b>.yaml").failed(wrong, [line], "s.yaml").page
    assert "<script>alert" not in text
    assert text.count("&lt;script&gt;alert") == 3
    assert "&lt;b&gt;.yaml" in text


@needs_browser
@pytest.mark.browser
def test_a_browser_follows_by_itself(spec, tmp_path):
    with watching(spec, "-o", tmp_path / "run", "--no-figures") as address, started() as browser:
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        faults = []
        page.on("console", lambda message: faults.append(message.text))
        page.goto(address)
        page.wait_for_selector(".state.done", timeout=1000 * PATIENCE)
        saved(spec, "relative: 0.1", "relative: 0.2")
        page.wait_for_selector("#design-2", timeout=1000 * PATIENCE)
        saved(spec, "relative: 0.2", "relativ: 0.2")
        page.wait_for_selector("mark", timeout=1000 * PATIENCE)
        assert faults == []
        tops = """() => [...document.querySelectorAll(".level > section")].map(
            (each) => each.querySelector("figure").getBoundingClientRect().top)"""
        before, after = page.evaluate(tops)
        assert before == after
        # What judges a page is a script that the policy of the server would forbid.
        other = browser.new_page(viewport={"width": 400, "height": 900})
        other.set_content(page.content().replace('<script src="follow.js" defer=""></script>', ""))
        assert violations(other) == []
        assert clipped(other) == []
