"""The runs that a golden file names."""

from __future__ import annotations

from inputdesign_cli.errors import IdesignError, InaccurateError, InfeasibleError
from inputdesign_cli.runs.golden_file import Golden, GoldenRun
from inputdesign_cli.runs.results import Result
from inputdesign_cli.specification import load_spec
from inputdesign_cli.sweep.verbs import run_verb


def execute(golden: Golden, run: GoldenRun) -> Result | IdesignError:
    """The result of one run of a golden file, or the error that stands for it if there is no design.

    Raises:
        SpecError, DataError: the spec that the golden file names is not good: nothing can be compared.
    """
    spec = load_spec(golden.spec_of(run), list(run.overrides))
    try:
        return run_verb(run.command, spec).result
    except (InfeasibleError, InaccurateError) as error:
        return error
