"""The verbs that make results of a spec, by the names that commands, sweeps and golden files give them."""

from __future__ import annotations

from typing import Literal

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.errors import IdesignError, InaccurateError, InfeasibleError
from inputdesign_cli.outcome.golden import Golden, GoldenRun
from inputdesign_cli.outcome.results import Result, Results
from inputdesign_cli.specification import Spec, load_spec

Verb = Literal["solve", "analyse", "simulate"]


def run_verb(verb: Verb, spec: Spec, executor: Executor | None = None) -> Results:
    """What `idesign VERB` computes; the numerical libraries are imported now.

    Raises:
        IdesignError: as the verb does.
    """
    from inputdesign_cli import questions

    if verb == "simulate":
        return questions.simulate(spec, executor=executor)
    return questions.solve(spec) if verb == "solve" else questions.analyse(spec)


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
