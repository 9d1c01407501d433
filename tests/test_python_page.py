"""The code of docs/python.md runs, in its order."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parent.parent / "docs" / "python.md"


@pytest.mark.slow
def test_the_code_of_the_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert len(blocks) == 6
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)
    cost = list(names["lengths"]["cost"])
    assert cost[1] / cost[0] == pytest.approx(0.5, rel=1e-3)  # all information comes from the input
    assert names["outcome"].parameters == ("K", "T", "L")
