"""`idesign check`."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import typer

from inputdesign_cli.cli.reference import shipped
from inputdesign_cli.cli.terminal import aligned, status
from inputdesign_cli.errors import EXIT_MISSED, DataError, IdesignError

if TYPE_CHECKING:
    from inputdesign_cli.outcome.golden import Row

Seconds = Mapping[tuple[str, str], float]
HEADER = ("", "run", "quantity", "computed", "expected", "deviation", "tolerance", "source")


def check(
    files: list[Path] | None = None,
    *,
    junit: Path | None = None,
    json_output: bool = False,
    quiet: bool = False,
) -> None:
    """Compare results with golden values.

    Runs the specs that the golden files name. Prints computed and expected values with their deviation,
    tolerance and source; exits with 1 if a value lies outside its tolerance.
    """
    rows: list[Row] = []
    seconds: dict[tuple[str, str], float] = {}
    stopped: IdesignError | None = None
    try:
        named = [_found(path) for path in files or ()]
        _compare(named or _default_files(), rows, seconds, quiet=quiet)
    except IdesignError as error:
        stopped = error
    if junit is not None:
        from inputdesign_cli.outcome.run_directory import write_text

        write_text(junit, junit_text(rows, seconds, stopped))
    if stopped is not None:
        raise stopped
    failed = sum(not row.passed for row in rows)
    if json_output:
        content = {"passed": failed == 0, "rows": [row.as_dict() for row in rows]}
        typer.echo(json.dumps(content, indent=1, ensure_ascii=False))
    elif not quiet:
        typer.echo(table(rows))
        typer.echo(f"\n{len(rows) - failed} of {len(rows)} quantities agree")
    if failed:
        raise typer.Exit(EXIT_MISSED)


def _compare(
    files: Sequence[Path], rows: list[Row], seconds: dict[tuple[str, str], float], *, quiet: bool
) -> None:
    """Run what the golden files name; rows and times are added file by file.

    Raises:
        IdesignError: a file, or a spec that it names, is not good.
    """
    from inputdesign_cli.outcome.golden import compare, load_golden
    from inputdesign_cli.questions import execute

    for golden in [load_golden(path) for path in files]:
        results = {}
        for run in golden.runs:
            started = time.perf_counter()
            with status(f"{golden.file}: {run.name} ...", quiet=quiet):
                results[run.name] = execute(golden, run)
            seconds[golden.file.stem, run.name] = time.perf_counter() - started
        rows += compare(golden, results)


def _found(path: Path) -> Path:
    """Return the file of this name, or else the golden file of the package, with or without its ending.

    Raises:
        DataError: `golden-missing`, there is neither.
    """
    if path.exists():
        return path
    own = {one.stem: one for one in sorted((shipped() / "golden").glob("*.yaml"))}
    found = own.get(path.name.removesuffix(".yaml")) if path.parent == Path() else None
    if found is None:
        hint = f"check the name and the folder; the package has {', '.join(own)}" if own else "check the name"
        raise DataError.because("golden-missing", f"there is no golden file {path}", hint)
    return found


def _default_files() -> list[Path]:
    """Return the golden files of the current folder, or else of the package."""
    found = sorted(Path("golden").glob("*.yaml")) or sorted((shipped() / "golden").glob("*.yaml"))
    if not found:
        message = "there is no golden/*.yaml in the current folder, and this installation has none"
        raise DataError.because("golden-missing", message, "name golden files")
    return found


def table(rows: Sequence[Row]) -> str:
    """Return the comparison as aligned text; where a number is missing, the reason follows its line."""
    from rich.text import Text

    cells: list[tuple[str | Text, ...]] = [tuple(Text(name, "bold") for name in HEADER)]
    for row in rows:
        quantity = row.quantity
        cells.append(
            (
                Text("ok", "green") if row.passed else Text("FAILS", "bold red"),
                f"{row.golden}: {row.run}",
                quantity.name,
                "-" if row.computed is None else f"{row.computed:.8g}",
                f"{quantity.expected:.8g}",
                "-" if row.deviation is None else f"{row.deviation:+.1e}",
                f"{quantity.tolerance:.1e}",
                quantity.source,
            )
        )
    header, *lines = aligned(cells, right=(3, 4, 5, 6))
    for i, row in enumerate(rows):
        if row.note:
            lines[i] += f"\n       {row.note}"
    return "\n".join([header, *lines])


def junit_text(rows: Sequence[Row], seconds: Seconds, error: IdesignError | None = None) -> str:
    """Return JUnit XML with a suite for each golden file and a test case for each of its quantities.

    Args:
        rows: the comparison, file by file.
        seconds: (golden file, run) -> how long the run took; its first quantity carries it.
        error: what ended the comparison, if anything did; it has a suite of its own.
    """
    root = Element("testsuites", name="idesign check")
    for golden, of_file in groupby(rows, lambda row: row.golden):
        suite, timed = SubElement(root, "testsuite", name=golden), set()
        for row in of_file:
            taken = 0.0 if row.run in timed else seconds.get((golden, row.run), 0.0)
            timed.add(row.run)
            _add(suite, golden, row, taken)
    if error is not None:
        suite = SubElement(root, "testsuite", name="idesign check")
        case = SubElement(suite, "testcase", classname="idesign check", name="golden files", time="0")
        for found in error.diagnostics:
            SubElement(case, "error", type=found.code, message=found.message).text = found.hint
    for part in (root, *root):
        cases = list(part.iter("testcase"))
        time = sum(float(one.get("time", 0.0)) for one in cases)
        part.attrib.update({"tests": str(len(cases)), "time": f"{time:.3f}"})
        for kind in ("failure", "error"):
            part.set(f"{kind}s", str(sum(one.find(kind) is not None for one in cases)))
    indent(root)
    return tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _add(suite: Element, golden: str, row: Row, taken: float) -> None:
    quantity = row.quantity
    name = f"{row.run}: {quantity.name} ({quantity.source})"
    case = SubElement(suite, "testcase", classname=golden, name=name, time=f"{taken:.3f}")
    if not row.passed:
        message = row.note or f"computed {row.computed:.10g}, expected {quantity.expected:.10g}"
        failure = SubElement(case, "failure", message=message)
        failure.text = f"{quantity.path}: {message}; tolerance {quantity.tolerance:.3g} ({quantity.why})"
