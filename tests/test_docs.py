"""Links and citations of pages are valid, and specs and code on pages and in benchmarks run."""

import ast
import importlib
import re
from pathlib import Path

import pytest

from inputdesign_cli import load_spec, parse_spec, validate

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
REFERENCES = ROOT / "docs" / "references.md"
FILES = sorted((ROOT / "inputdesign_cli").rglob("*.py"))
SCRIPTS = sorted((ROOT / "benchmarks").glob("*.py"))
CITATION = re.compile(r"(?<!ignore)\[([a-z]{3,}(?:-[a-z]+)*-(?:[0-9]{4}|[a-z]{3,}))\]")


def anchors(page):
    """The ends of links to the headings of this page."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading).strip().lower().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_a_file_and_a_heading_and_every_table_has_a_header(page):
    text = page.read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)#]+)\)", text)
    assert [link for link in links if "://" not in link and not (page.parent / link).exists()] == []
    links = re.findall(r"\]\(([^)#:]*\.md)?#([^)]+)\)", text)
    missing = [
        (file, anchor) for file, anchor in links if anchor not in anchors(page.parent / (file or page.name))
    ]
    assert missing == []
    tables = re.findall(r"(?:^\|.*\n)+", re.sub(r"```.*?```", "", text, flags=re.DOTALL), flags=re.MULTILINE)
    assert [table for table in tables if not re.match(r".*\n\|[-|]+\n", table)] == []


@pytest.mark.parametrize("page", [*PAGES, ROOT / "benchmarks" / "README.md"], ids=lambda page: page.stem)
def test_files_that_are_named_as_evidence_exist(page):
    named = re.findall(r"\b(?:tests|benchmarks|specs|golden)/[\w./-]*\w", page.read_text(encoding="utf-8"))
    assert [name for name in named if "NAME" not in name and not (ROOT / name).exists()] == []


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


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_every_name_that_a_benchmark_imports_exists(script):
    taken = [
        (node.module, alias.name)
        for node in ast.walk(ast.parse(script.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(("inputdesign_cli", "tests."))
        for alias in node.names
    ]
    assert taken
    for module, name in taken:
        assert hasattr(importlib.import_module(module), name), f"{module} has no {name}"


@pytest.mark.slow
def test_the_code_of_the_page_about_python_runs(tmp_path, monkeypatch):
    """The blocks of docs/python.md run in their order."""
    page = ROOT / "docs" / "python.md"
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert len(blocks) == 6
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, str(page), "exec"), names)
    cost = list(names["lengths"]["cost"])
    assert cost[1] / cost[0] == pytest.approx(0.5, rel=1e-3)  # all information comes from the input
    assert names["outcome"].parameters == ("K", "T", "L")
