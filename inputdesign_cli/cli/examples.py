"""`idesign examples`: the specs that come with the package."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Annotated

import typer

from inputdesign_cli.cli.options import path_option
from inputdesign_cli.cli.terminal import aligned
from inputdesign_cli.errors import DataError, OutputError

_PACKAGE = Path(__file__).parents[1]


def shipped() -> Path:
    """The folder with `specs` and `golden`: in the package, or around it in a checkout."""
    inside = _PACKAGE / "examples"
    return inside if inside.is_dir() else _PACKAGE.parent


def examples(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="The example to copy; without it, all are listed.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="Where to copy it. The default is the current folder.",
            parser=path_option,
        ),
    ] = None,
) -> None:
    """List the specs that come with idesign, or copy one.

    They are the examples of the documentation; `idesign check` compares their results with golden values.
    """
    from inputdesign_cli.outcome.run_directory import output_errors, write_text
    from inputdesign_cli.specification.template import read_template

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
