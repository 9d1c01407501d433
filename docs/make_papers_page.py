"""Writes docs/papers.md: what the papers print beside what the shipped specs compute.

    python docs/make_papers_page.py

See docs/papers/README.md for what a section is made of.
"""

from __future__ import annotations

import re
import sys
import tempfile
from itertools import zip_longest
from pathlib import Path

from inputdesign_cli.outcome.golden import Golden, Row, compare, load_golden
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.questions import run_verb
from inputdesign_cli.specification import load_spec
from inputdesign_cli.sweeps.notebook import sweep

DOCS = Path(__file__).parent
PAGE = DOCS / "papers.md"
IMAGES = DOCS / "images" / "papers"
LINE = re.compile(r"<!-- (table|figure|sweep)(?:: ([^|>]+) \| ([^>]+))? -->")

INTRODUCTION = """\
# What the papers print, and what is computed here

<!-- Written by `make papers` from docs/papers/ and golden/: change those, not this page. -->

Every figure of a paper that a shipped spec reproduces: the printed value, the value that `idesign` computes,
and one from an independent solution or a closed form. The last column explains a difference from the print,
or its tolerance. `idesign check` compares these and further quantities.
"""


def sections() -> dict[str, str]:
    """Name of the golden file -> text of its section, in the order of the page.

    A section whose golden file is not there is left out.
    """
    found = {path.stem.partition("-")[2]: path for path in sorted(DOCS.glob("papers/[0-9]*.md"))}
    return {
        name: path.read_text(encoding="utf-8") for name, path in found.items() if golden_file(name).is_file()
    }


def golden_file(name: str) -> Path:
    """The golden file of a section."""
    return DOCS.parent / "golden" / f"{name}.yaml"


def results_of(golden: Golden) -> dict[str, Results]:
    """Every run of a golden file."""
    found = {}
    for run in golden.runs:
        found[run.name] = run_verb(run.command, load_spec(golden.spec_of(run), list(run.overrides)))
    return found


def table(rows: list[Row]) -> str:
    """Return the figures that a paper prints as Markdown, with independent solutions in the same line."""
    lines = [
        "| quantity | paper | computed | difference | independent | reason |",
        "|---|---|---|---|---|---|",
    ]
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.run, row.quantity.path), []).append(row)
    said = ""
    for group in groups.values():
        printed = [row for row in group if row.quantity.source.startswith("paper")]
        others = [row for row in group if row not in printed]
        for paper, other in zip_longest(printed, others) if printed else ():
            why = paper.quantity.why if paper else ""
            lines.append(line(paper, other, "as above" if why and why == said else why))
            said = why
    return "\n".join(lines)


def line(paper: Row | None, other: Row | None, why: str) -> str:
    """Return the line of one quantity, with the reason for a difference."""
    first = paper or other
    assert first is not None
    computed = "-" if first.computed is None else f"{first.computed:.7g}"
    misses = "" if all(row.passed for row in (paper, other) if row) else " **misses**"
    cells = [
        first.quantity.name,
        f"{paper.quantity.expected:g} ({paper.quantity.source.removeprefix('paper, ')})" if paper else "",
        computed + misses,
        percent(paper.computed, paper.quantity.expected) if paper else "",
        f"{other.quantity.expected:.7g}" if other else "",
        why,
    ]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def percent(computed: float | None, printed: float) -> str:
    """The difference from the printed value."""
    if computed is None or printed == 0.0:
        return ""
    return f"{100 * (computed - printed) / printed:+.2f} %"


def page(*, images: bool) -> str:
    """The whole page; `images` draws the figures too."""
    parts = [INTRODUCTION]
    for name, text in sections().items():
        golden = load_golden(golden_file(name))
        found = results_of(golden)
        rows = compare(golden, {run: results.result for run, results in found.items()})

        def fill(match: re.Match[str], name=name, golden=golden, found=found, rows=rows) -> str:
            kind, run, what = match.groups()
            if kind == "table":
                return table(rows)
            file = IMAGES / f"{name}_{slug(run)}_{slug(what.partition('=')[0])}.png"
            if images:
                IMAGES.mkdir(parents=True, exist_ok=True)
                if kind == "figure":
                    draw_figure(found[run], what, file)
                else:
                    draw_sweep(golden, run, what, file)
            return f"![{run}: {what}]({file.relative_to(DOCS).as_posix()})\n"

        parts.append(LINE.sub(fill, text))
    return "\n".join(parts)


def slug(text: str) -> str:
    """A text as a part of a file name."""
    return re.sub(r"[^a-z0-9]+", "-", text.strip().lower()).strip("-")


def draw_figure(results: Results, stem: str, file: Path) -> None:
    """A figure of a run."""
    from inputdesign_cli.figures.plots import draw

    file.write_bytes(draw(results.curves[stem], results.time_unit))


def draw_sweep(golden: Golden, name: str, setting: str, file: Path) -> None:
    """The curve of a sweep that starts from a run."""
    run = next(run for run in golden.runs if run.name == name)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "sweep"
        sweep(golden.spec_of(run), [*run.overrides, setting], directory=out)
        file.write_bytes((out / "curves.png").read_bytes())


if __name__ == "__main__":
    PAGE.write_text(page(images=True), encoding="utf-8")
    print(f"wrote {PAGE}", file=sys.stderr)
