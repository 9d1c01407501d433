"""What comes with idesign: examples, starter specs, the schema of a spec, and what codes mean."""

from __future__ import annotations

import difflib
import json
from importlib import resources
from pathlib import Path
from typing import Literal

import typer

from inputdesign_cli.cli.options import refuse_existing
from inputdesign_cli.cli.terminal import aligned
from inputdesign_cli.errors import DataError, OutputError

_PACKAGE = Path(__file__).parents[1]
SCHEMA = "idesign.schema.json"
Kind = Literal["open-loop", "closed-loop", "sweep", "criterion", "control", "regression"]
"""The starter specs, named as their files in `starters/`."""


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
