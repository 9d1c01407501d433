"""`idesign solve`."""

from __future__ import annotations

from inputdesign_cli.cli.options import Figures, Json, Output, Overrides, Quiet, SpecFile
from inputdesign_cli.cli.run import produce


def solve(
    spec: SpecFile,
    overrides: Overrides = None,
    output: Output = None,
    figures: Figures = True,
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Design the experiment that a spec asks for.

    Writes a run directory with the spectrum, the signal to apply, the model error that it buys, and the
    proof of optimality; prints a summary.
    """
    produce("solve", spec, overrides, output, figures=figures, json_output=json_output, quiet=quiet)
