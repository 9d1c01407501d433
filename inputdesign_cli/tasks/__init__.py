"""The verbs: spec in, results out. A spec becomes a task once; nothing after that knows the spec."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from inputdesign_cli.errors import IdesignError
from inputdesign_cli.runs.results import Results
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.given import build_given
from inputdesign_cli.tasks.build.task import build_task


def solve(spec: Spec) -> Results:
    """Design the experiment that the spec asks for; a given excitation is analysed.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
        InfeasibleError: no excitation meets what is asked.
        InaccurateError: the proof did not close to the accuracy that is asked.
    """
    with _placed(spec):
        return build_task(spec).solve()


def analyse(spec: Spec) -> Results:
    """What a given excitation buys, without designing anything.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
    """
    with _placed(spec):
        return build_given(spec).solve()


def validate(spec: Spec) -> None:
    """Read, check and set up, but compute nothing."""
    with _placed(spec):
        build_task(spec).check()


@contextmanager
def _placed(spec: Spec) -> Iterator[None]:
    """Errors with the lines of the spec that they concern."""
    try:
        yield
    except IdesignError as error:
        raise spec.place(error) from error
