"""Pages of reports: the spec of most pages, a strict parser, and the words of a page."""

import re

import html5lib
import numpy as np
import scipy.signal

from inputdesign_cli.report.render import script

SPEC = """\
title: "Heat <script>alert(1)</script> & flow"
plant: {B: [0, 1], F: [1, -0.5]}
noise: {variance: 1}
experiment: {samples: 100%s}
accuracy: {model_error: {relative: 0.1, confidence: 0.9}}
spectrum: {type: fir, order: 2}
signal: {type: multisine, candidates: 1, seed: 5}
"""
LOOP = ", controller: {numerator: [0.1], denominator: [1]}"
XHTML = "{http://www.w3.org/1999/xhtml}"


def recorded(path):
    """Write a record of the plant of SPEC, as a logger does."""
    u, e = np.random.default_rng(1).standard_normal((2, 400))
    y = scipy.signal.lfilter([0, 1], [1, -0.5], u) + e
    np.savetxt(path, np.c_[np.arange(400.0), u, y], delimiter=",", header="time,u,y", comments="")
    return path


def parse(text):
    """The page, which must be valid HTML; a reference to anything outside of it is an error."""
    page = html5lib.HTMLParser(strict=True).parse(text)
    assert [one.text for one in page.findall(f".//{XHTML}script")] == [script("hover.js")]
    for element in page.iter():
        for name, value in element.attrib.items():
            assert not name.startswith("on"), "a script"
            if name == "href":
                assert value.startswith("#"), value
            if name == "src":
                assert value.startswith("data:image/"), value[:80]
    assert "url(" not in text
    assert "@import" not in text
    return page


def words(page):
    return re.sub(r"\s+", " ", "".join(page.itertext()))


def rows(page):
    """The cells of all tables, row by row."""
    return [
        [re.sub(r"\s+", " ", "".join(cell.itertext())).strip() for cell in row]
        for row in page.iter(f"{XHTML}tr")
    ]
