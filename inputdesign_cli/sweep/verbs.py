"""The verbs that make results of a spec, by the names that commands, sweeps and golden files give them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from inputdesign_cli.compute.executor import Executor
    from inputdesign_cli.runs.results import Results
    from inputdesign_cli.specification import Spec

Verb = Literal["solve", "analyse", "simulate"]


def run_verb(verb: Verb, spec: Spec, executor: Executor | None = None) -> Results:
    """What `idesign VERB` computes; the numerical libraries are imported now.

    Args:
        verb: what to do.
        spec: on what.
        executor: where to `simulate` (default: in this process); the other verbs need none.

    Raises:
        IdesignError: as the verb does.
    """
    from inputdesign_cli import tasks

    match verb:
        case "solve":
            return tasks.solve(spec)
        case "analyse":
            return tasks.analyse(spec)
        case "simulate":
            return tasks.simulate(spec, executor=executor)
