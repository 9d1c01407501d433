"""A real browser for pages: Chromium of the system, driven by playwright; axe-core judges what it shows."""

import shutil
from contextlib import contextmanager
from importlib.util import find_spec

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")


def reason_for_none():
    """Why there is no browser; None where there is one."""
    if not (find_spec("playwright") and find_spec("axe_playwright_python")):
        return "playwright and axe-playwright-python are not installed (make browser)"
    if not any(shutil.which(name) for name in NAMES):
        return f"none of {', '.join(NAMES)} is installed"
    return None


needs_browser = pytest.mark.skipif(reason_for_none() is not None, reason=str(reason_for_none()))


@contextmanager
def started():
    """The browser."""
    from playwright.sync_api import sync_playwright

    path = next(found for found in map(shutil.which, NAMES) if found)
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


def violations(page):
    """The violations that axe-core finds on a page: rules and places."""
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(page).response["violations"]
    return [(rule["id"], [node["html"][:120] for node in rule["nodes"]]) for rule in found]


def clipped(page):
    """Elements that reach over the right edge of the window and cannot be scrolled to."""
    return page.evaluate("""() => document.documentElement.scrollWidth > window.innerWidth
        ? [...document.querySelectorAll("main *")]
            .filter((e) => e.getBoundingClientRect().right > window.innerWidth + 1)
            .map((e) => e.outerHTML.slice(0, 120)) : []""")
