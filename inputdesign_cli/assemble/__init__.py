"""Spec -> problem -> outcome: the only room that knows the words of the YAML and the mathematics."""

from __future__ import annotations

from inputdesign_cli.assemble.least_cost import build_task, solve_least_cost
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.spec import Spec


def solve(spec: Spec) -> Outcome:
    """Design the experiment that the spec asks for.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
        InfeasibleError: no excitation meets what is asked.
        InaccurateError: the proof did not close to the accuracy that is asked.
    """
    try:
        return solve_least_cost(spec)
    except IdesignError as error:
        raise spec.place(error) from error


def analyse(spec: Spec) -> Outcome:
    """What a given excitation buys, without designing anything."""
    raise spec.complain(
        "not-supported",
        "this version does not analyse a given excitation",
        hint="design one: idesign solve SPEC",
        key="spectrum",
    )


def validate(spec: Spec) -> None:
    """Read, check and set up, but compute nothing."""
    try:
        build_task(spec)
    except IdesignError as error:
        raise spec.place(error) from error
