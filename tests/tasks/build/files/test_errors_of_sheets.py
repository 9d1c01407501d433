"""What sheets write in place of a number is a missing sample, also where it looks like a comment."""

import numpy as np
import pytest

from inputdesign_cli.tasks.build.files.layout import COMMENT, COMMENTED, rows_of, within

ROWS = [f"{0.5 * k},{-1.2 * k}" for k in range(1, 9)]


def passed(line, separator=","):
    rows = [row.replace(",", separator or " ") for row in ROWS]
    body, others = rows_of("\n".join([*rows[:4], line, *rows[4:]]), separator)
    assert len(body) == len(ROWS)
    return [kind for _, kind in within(body, others, separator)[1]]


@pytest.mark.parametrize(
    "line",
    [
        "#N/A,-1.2",
        '"#N/A",-1.2',
        "#DIV/0!,2",
        "########,2",
        "#VALUE!,#VALUE!",
        "#bad,0.5",
        "# BAD 0.5,-1.2",
        "#0.5;-1.2",
        "%,0.5",
        "#NAME?,text",
        "# 0.5, -1.2",
        "// 3,4",
    ],
)
def test_it_cuts_the_record(line):
    assert passed(line) == [COMMENTED]


@pytest.mark.parametrize("line", ["# the pump is on", "# pump on, valve shut", "# 12", "#", "% 2024"])
def test_words_do_not(line):
    assert passed(line) == [COMMENT]


def test_in_every_layout():
    for separator in (",", ";", "\t", None):
        assert passed(f"#N/A{separator or ' '}3", separator) == [COMMENTED]


def test_one_column():
    body, others = rows_of("\n".join([*map(str, np.arange(5.0)), "#N/A", *map(str, np.arange(5.0))]), ",")
    assert [kind for _, kind in within(body, others, ",")[1]] == [COMMENTED]
