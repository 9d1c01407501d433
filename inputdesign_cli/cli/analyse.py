"""`idesign analyse`."""

from __future__ import annotations

from inputdesign_cli.cli.options import Figures, Json, Output, Overrides, Quiet, SpecFile
from inputdesign_cli.cli.run import produce


def analyse(
    spec: SpecFile,
    overrides: Overrides = None,
    output: Output = None,
    figures: Figures = True,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Tell what accuracy a given excitation buys.

    Nothing is optimised: the excitation stands in the spec under `spectrum.given`. Writes a run
    directory and prints a summary.
    """
    produce("analyse", spec, overrides, output, figures=figures, json_output=json_output, quiet=quiet)
