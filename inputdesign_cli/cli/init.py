"""`idesign init`."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated

import typer

from inputdesign_cli.cli.options import one_of
from inputdesign_cli.errors import OutputError

SCHEMA = "idesign.schema.json"

KINDS = ("open-loop", "closed-loop", "sweep", "criterion", "control", "regression")
"""The starter specs, named as their files in `starters/`."""


def init(
    file: Annotated[
        Path | None, typer.Argument(metavar="[FILE]", help="Where to write it, if not to standard output.")
    ] = None,
    kind: Annotated[str, one_of(KINDS, "The experiment to start from")] = "open-loop",
    force: Annotated[bool, typer.Option("--force", help="Overwrite FILE if it exists.")] = False,
) -> None:
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
    if file.exists() and not force:
        hint = "choose another name, or overwrite it with --force"
        raise OutputError.because("output-exists", f"{file} exists already", hint)
    from inputdesign_cli.cli.reference import schema_text
    from inputdesign_cli.outcome.run_directory import write_text

    write_text(file, text)
    if not (file.parent / SCHEMA).exists():
        write_text(file.parent / SCHEMA, schema_text())
