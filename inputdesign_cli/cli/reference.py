"""Material that comes with idesign: examples, starter specs, golden values, the schema of a spec, codes."""

from __future__ import annotations

import difflib
import json
import time
from collections.abc import Mapping, Sequence
from importlib import resources
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Literal
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import typer

from inputdesign_cli.cli.options import refuse_existing
from inputdesign_cli.cli.terminal import aligned, status
from inputdesign_cli.errors import EXIT_MISSED, DataError, IdesignError, OutputError

if TYPE_CHECKING:
    from inputdesign_cli.outcome.golden import Row

_PACKAGE = Path(__file__).parents[1]
SCHEMA = "idesign.schema.json"
Kind = Literal["open-loop", "closed-loop", "sweep", "criterion", "control", "regression"]
"""The starter specs, named as their files in `starters/`."""
Seconds = Mapping[tuple[str, str], float]
HEADER = ("", "run", "quantity", "computed", "expected", "deviation", "tolerance", "source")


def shipped() -> Path:
    """Return the folder with `specs` and `golden`: in the package, or around it in a checkout."""
    inside = _PACKAGE / "examples"
    return inside if inside.is_dir() else _PACKAGE.parent


def examples(name: str | None = None, *, output: Path | None = None) -> None:
    """List the specs that come with idesign, or copy one.

    They are the examples of the documentation; `idesign check` compares their results with golden values.
    """
    from inputdesign_cli.outcome.run_directory import output_errors, write_text
    from inputdesign_cli.specification.loading import read_template

    found = {path.stem: path for path in sorted((shipped() / "specs").glob("*.yaml"))}
    if name is None:
        lines = [(stem, str(read_template(path).data.get("title", ""))) for stem, path in found.items()]
        typer.echo("\n".join(aligned(lines, gap=3, wrap=True)) if lines else "this installation has none")
        return
    source = found.get(name.removesuffix(".yaml"))
    if source is None:
        near = difflib.get_close_matches(name, found, n=1)
        hint = f'did you mean "{near[0]}"?' if near else "`idesign examples` lists them"
        raise DataError.because("unknown-example", f"there is no example {name!r}", hint)
    folder = output or Path()
    target = folder / source.name
    if target.exists():
        hint = "choose another folder with -o"
        raise OutputError.because("output-exists", f"{target} exists already", hint)
    with output_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    write_text(target, source.read_text(encoding="utf-8"))
    typer.echo(target)


def init(file: Path | None = None, *, kind: Kind = "open-loop", force: bool = False) -> None:
    """Write a commented starter spec.

    It is complete: `idesign solve` runs it as it is. Beside FILE stands idesign.schema.json afterwards, from
    which editors complete and check the spec.
    """
    text = f"# yaml-language-server: $schema={SCHEMA}\n" + (
        resources.files(__package__) / "starters" / f"{kind}.yaml"
    ).read_text(encoding="utf-8")
    if file is None:
        typer.echo(text, nl=False)
        return
    refuse_existing(file, force, "--force")
    from inputdesign_cli.outcome.run_directory import write_text

    write_text(file, text)
    if not (file.parent / SCHEMA).exists():
        write_text(file.parent / SCHEMA, schema_text())


def explain(code: str | None = None, *, every: bool = False) -> None:
    """Explain the code of an error or of a finding.

    Says what it means and what to do about it.
    """
    from inputdesign_cli.diagnostics import explanation
    from inputdesign_cli.findings import explanations

    if every and code is None:
        typer.echo("\n\n".join(explanation(name, explanations()) for name in sorted(explanations())))
    elif code is None:
        known = sorted(explanations().items())
        typer.echo("\n".join(aligned([(name, entry.title) for name, entry in known], wrap=True)))
    else:
        typer.echo(explanation(code, explanations()))


def schema() -> None:
    """Print the JSON schema of a spec.

    Editors use it for completion and for checks while you type.
    """
    typer.echo(schema_text(), nl=False)


def schema_text() -> str:
    """Return the JSON schema of a spec as the text of a file."""
    from inputdesign_cli.specification import json_schema

    return json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n"


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
        from inputdesign_cli.outcome.golden import compare, load_golden
        from inputdesign_cli.questions import execute

        named = [_found(path) for path in files or ()] or _default_files()
        for golden in [load_golden(path) for path in named]:
            results = {}
            for run in golden.runs:
                started = time.perf_counter()
                with status(f"{golden.file}: {run.name} ...", quiet=quiet):
                    results[run.name] = execute(golden, run)
                seconds[golden.file.stem, run.name] = time.perf_counter() - started
            rows += compare(golden, results)
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


def _found(path: Path) -> Path:
    """Return the file of this name, or the golden file of the package, or raise `golden-missing`."""
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
        error: the error that ended the comparison, if any; it has a suite of its own.
    """
    root = Element("testsuites", name="idesign check")
    for golden, of_file in groupby(rows, lambda row: row.golden):
        suite, timed = SubElement(root, "testsuite", name=golden), set()
        for row in of_file:
            taken = 0.0 if row.run in timed else seconds.get((golden, row.run), 0.0)
            timed.add(row.run)
            quantity = row.quantity
            name = f"{row.run}: {quantity.name} ({quantity.source})"
            case = SubElement(suite, "testcase", classname=golden, name=name, time=f"{taken:.3f}")
            if not row.passed:
                message = row.note or f"computed {row.computed:.10g}, expected {quantity.expected:.10g}"
                failure = SubElement(case, "failure", message=message)
                why = f"tolerance {quantity.tolerance:.3g} ({quantity.why})"
                failure.text = f"{quantity.path}: {message}; {why}"
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
