"""`idesign validate`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from inputdesign_cli.cli.options import Confine, Json, Overrides, Quiet
from inputdesign_cli.cli.reading import read_spec
from inputdesign_cli.errors import IdesignError


def validate(
    specs: Annotated[list[Path], typer.Argument(metavar="SPEC...", help="The specs to check, YAML files.")],
    overrides: Overrides = None,
    confine: Confine = None,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Check specs without computing a design.

    A valid spec can be read and is well posed. One that states nothing of a design (accuracy, limits,
    spectrum, ..) is checked for what `identify` needs. All problems of all files are reported at once.
    """
    from inputdesign_cli.questions import validate as check

    errors: list[IdesignError] = []
    estimated: list[Path] = []
    for path in specs:
        try:
            spec = read_spec(path, overrides, confine, design=None)
            check(spec)
        except IdesignError as error:
            errors.append(error)
        else:
            estimated += [] if spec.asks_for_design else [path]
            if not quiet and not json_output:
                typer.echo(
                    f"{path}: valid" + ("" if spec.asks_for_design else " for identify; no design is asked")
                )
    if errors:
        worst = max(errors, key=lambda error: error.exit_code)
        raise type(worst)([diagnostic for error in errors for diagnostic in error.diagnostics])
    if json_output:
        found = {"valid": [str(path) for path in specs]}
        if estimated:
            found["for_identify_only"] = [str(path) for path in estimated]
        typer.echo(json.dumps(found, indent=1, ensure_ascii=False))
