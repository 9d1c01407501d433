"""Links lead somewhere, sources that are cited have an entry, and the spec that the README shows is valid."""

import re
from pathlib import Path

import pytest

from inputdesign_cli import load_spec, parse_spec, validate

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
REFERENCES = ROOT / "docs" / "references.md"
FILES = sorted((ROOT / "inputdesign_cli").rglob("*.py"))
CITATION = re.compile(r"(?<!ignore)\[([a-z]{3,}(?:-[a-z]+)*-(?:[0-9]{4}|[a-z]{3,}))\]")


def anchors(page):
    """What a link to a heading of this page ends with."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading).strip().lower().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8"))
    missing = [link for link in links if "://" not in link and not (page.parent / link).exists()]
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_to_headings_lead_to_one(page):
    links = re.findall(r"\]\(([^)#:]*\.md)?#([^)]+)\)", page.read_text(encoding="utf-8"))
    missing = [
        (file, anchor) for file, anchor in links if anchor not in anchors(page.parent / (file or page.name))
    ]
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_table_has_a_header(page):
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    tables = re.findall(r"(?:^\|.*\n)+", text, flags=re.MULTILINE)
    assert [table for table in tables if not re.match(r".*\n\|[-|]+\n", table)] == []


def test_every_source_cited_by_key_has_an_entry():
    cited = {key for file in FILES for key in CITATION.findall(file.read_text(encoding="utf-8"))}
    assert cited <= anchors(REFERENCES)


def test_every_source_is_cited():
    pages = [page for page in PAGES if page != REFERENCES]
    specs = sorted((ROOT / "specs").glob("*.yaml"))
    text = "\n".join(file.read_text(encoding="utf-8") for file in [*FILES, *pages, *specs])
    keys = re.findall(r"^### (.*)$", REFERENCES.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert [key for key in keys if key not in text] == []


def test_the_spec_of_the_readme_is_the_shipped_one():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```yaml\n(.*?)```", text, flags=re.DOTALL)
    spec = parse_spec(block)
    validate(spec)
    assert spec.sha256 == load_spec(ROOT / "specs" / "first_order.yaml").sha256
