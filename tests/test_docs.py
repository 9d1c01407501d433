"""Links lead somewhere, and the spec that the README shows is valid."""

import re
from pathlib import Path

import pytest

from inputdesign_cli import load_spec, parse_spec, validate

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8"))
    missing = [link for link in links if "://" not in link and not (page.parent / link).exists()]
    assert missing == []


def test_the_spec_of_the_readme_is_the_shipped_one():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```yaml\n(.*?)```", text, flags=re.DOTALL)
    spec = parse_spec(block)
    validate(spec)
    assert spec.sha256 == load_spec(ROOT / "specs" / "first_order.yaml").sha256
