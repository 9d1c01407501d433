"""docs/papers.md says what the shipped specs compute."""

import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")
MAKER = runpy.run_path(str(ROOT / "docs" / "make_papers_page.py"))
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def rows_of(name):
    """The comparison of a golden file with nothing computed."""
    golden = MAKER["load_golden"](MAKER["golden_file"](name))
    return MAKER["compare"](golden, {})


def cells_of(line):
    return [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


@pytest.mark.parametrize("name", MAKER["sections"]())
def test_the_page_is_up_to_date(name):
    """Words and tables agree, except computed numbers, which the golden files hold to their tolerances."""
    section = MAKER["sections"]()[name]
    table = MAKER["table"](rows_of(name)).splitlines()
    for part in MAKER["LINE"].split(section)[::4]:
        assert part.strip() in PAGE, "run `make papers`"
    for line in table[2:]:
        quantity, paper, _, _, independent, reason = cells_of(line)
        found = [
            cells
            for cells in map(cells_of, PAGE.splitlines())
            if len(cells) == 6
            and (cells[0], cells[1], cells[4], cells[5]) == (quantity, paper, independent, reason)
        ]
        assert found, f"{quantity}: run `make papers`"


@pytest.mark.parametrize("name", MAKER["sections"]())
def test_computed_numbers_on_the_page_lie_within_their_tolerances(name):
    computed = {}
    for cells in map(cells_of, PAGE.splitlines()):
        if len(cells) == 6 and NUMBER.fullmatch(cells[2]):
            computed.setdefault(cells[0], []).append(float(cells[2]))
    for row in rows_of(name):
        quantity = row.quantity
        if quantity.name in computed:
            nearest = min(computed[quantity.name], key=lambda value: abs(value - quantity.expected))
            assert abs(nearest - quantity.expected) <= quantity.tolerance + 1e-6 * abs(quantity.expected)


def test_the_page_has_every_figure_and_printed_number_and_no_missed_tolerance():
    assert "**misses**" not in PAGE
    images = set(re.findall(r"\]\((images/papers/[^)]+)\)", PAGE))
    shipped = {f"images/papers/{path.name}" for path in (ROOT / "docs/images/papers").iterdir()}
    assert images == shipped
    for name in MAKER["sections"]():
        for row in rows_of(name):
            if row.quantity.source.startswith("paper"):
                assert f"| {row.quantity.name} |" in PAGE
