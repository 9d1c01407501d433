"""What sheets write in place of a number is a missing sample, also where it looks like a comment."""

import numpy as np
import pytest

from inputdesign_cli.tasks.build.files.layout import COMMENT, COMMENTED, rows_of, within
from inputdesign_cli.tasks.build.log import read_log
from inputdesign_cli.tasks.build.preparation import Preparation

ROWS = [f"{0.5 * k},{-1.2 * k}" for k in range(1, 9)]


def passed(line, separator=","):
    rows = [row.replace(",", separator or " ") for row in ROWS]
    body, others = rows_of("\n".join([*rows[:4], line, *rows[4:]]), separator)
    assert len(body) == len(ROWS)
    return [kind for _, kind in within(body, others, separator)[1]]


@pytest.mark.parametrize(
    "line", ["#bad,0.5", "# BAD 0.5,-1.2", "#0.5;-1.2", "%,0.5", "#NAME?,text", "# 0.5, -1.2", "// 3,4"]
)
def test_it_cuts_the_record(line):
    assert passed(line) == [COMMENTED]


@pytest.mark.parametrize("line", ["# the pump is on", "# pump on, valve shut", "# 12", "#", "% 2024"])
def test_words_do_not(line):
    assert passed(line) == [COMMENT]


@pytest.mark.parametrize(
    "cells", [["#N/A", "-1.2"], ["#DIV/0!", "2"], ["########", "2"], ["#VALUE!", "#VALUE!"], ["#REF!", ""]]
)
def test_errors_in_the_first_cell_are_a_row_in_every_layout(cells):
    for separator in (",", ";", "\t", None if all(cells) else ","):
        line = (separator or " ").join(cells)
        body, passed_over = rows_of(
            "\n".join([*ROWS[:4], line, *ROWS[4:]]).replace(",", separator or " "), separator
        )
        assert body[4] == (5, cells)
        assert not passed_over


@pytest.mark.parametrize("ending", ["csv", "xlsx"])
@pytest.mark.parametrize("error", ["#N/A", "#VALUE!", "#DIV/0!", "#REF!", "nan"])
@pytest.mark.parametrize("column", [0, 1, 2])
def test_errors_are_gaps_in_text_and_in_workbooks_as_missing_numbers_are(column, error, ending, tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("openpyxl")
    frame = pandas.DataFrame({"time_s": np.arange(40.0), "u": np.arange(40) % 3, "y": np.arange(40) % 7})
    frame = frame.astype(object)
    frame.iloc[20, column] = error
    path = tmp_path / f"log.{ending}"
    (frame.to_csv if ending == "csv" else frame.to_excel)(path, index=False)
    log = read_log(path, Preparation())
    assert log.lengths == (20, 19)
    assert log.steps[0] == "1 row with a missing number was left out (row 22)"


def test_one_column():
    body, others = rows_of("\n".join([*map(str, np.arange(5.0)), "#N/A", *map(str, np.arange(5.0))]), ",")
    assert [kind for _, kind in within(body, others, ",")[1]] == [COMMENTED]
