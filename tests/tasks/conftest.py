"""What tests of several tasks share."""

import pytest

from inputdesign_cli.runs.results import Table
from inputdesign_cli.runs.text_formats import csv_text


@pytest.fixture
def write(tmp_path):
    """Writes columns as a CSV file and returns its path."""

    def written(columns, name="data.csv"):
        path = tmp_path / name
        path.write_text(csv_text(Table(columns)), encoding="utf-8")
        return path

    return written
