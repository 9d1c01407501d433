"""The verbs: spec in, results out. A spec becomes a task once; nothing after that knows the spec."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.compute.time_limit import time_limit
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.runs.results import Results
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.arithmetic import finite, most_extreme, sound_arithmetic
from inputdesign_cli.tasks.assessment import Assessment, assess as assess_record
from inputdesign_cli.tasks.build.given import build_given
from inputdesign_cli.tasks.build.identification import build_identification
from inputdesign_cli.tasks.build.task import build_task
from inputdesign_cli.tasks.identification import identify as identify_record


def solve(spec: Spec) -> Results:
    """Design the experiment that the spec asks for; a given excitation is analysed.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
        InfeasibleError: no excitation meets what is asked.
        InaccurateError: the proof did not close to the accuracy that is asked.
    """
    with _placed(spec), time_limit(spec.solver.time_limit):
        return finite(build_task(spec).solve(), most_extreme(spec.content))


def analyse(spec: Spec) -> Results:
    """What a given excitation buys, without designing anything.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
    """
    with _placed(spec), time_limit(spec.solver.time_limit):
        return finite(build_given(spec).solve(), most_extreme(spec.content))


def validate(spec: Spec) -> None:
    """Read, check and set up, but compute nothing."""
    with _placed(spec):
        build_task(spec).check()


def simulate(spec: Spec, *, executor: Executor | None = None) -> Results:
    """Design the experiment, or take the given one, and try it many times on a simulated true system.

    Args:
        executor: where batches of runs are computed (default: in this process); the result does not depend
            on it.

    Raises:
        SpecError: what this version does not simulate, and all that `solve` raises.
    """
    with _placed(spec):
        return finite(build_task(spec).simulate(executor), most_extreme(spec.content))


def identify(spec: Spec, data: str | Path, *, remove_means: bool = False) -> Results:
    """Estimate the model whose structure `plant` and `noise` give from a recorded experiment.

    Raises:
        SpecError: the plant is not supported.
        DataError: the file cannot be used, or the data do not determine the parameters.
    """
    with _placed(spec):
        found = identify_record(build_identification(spec), Path(data), remove_means=remove_means)
        return finite(found, most_extreme(spec.content))


def assess(spec: Spec, data: str | Path, *, remove_means: bool = False) -> Assessment:
    """Identify the model from a real experiment, compare what the data buy with what is asked, and top up.

    Raises:
        SpecError: nothing is asked that data could meet; see `identify` and `solve`.
        DataError: the file cannot be used.
        InfeasibleError, InaccurateError: of the top-up.
    """
    with _placed(spec):
        return assess_record(build_identification(spec), Path(data), remove_means=remove_means)


@contextmanager
def _placed(spec: Spec) -> Iterator[None]:
    """Errors with the lines of the spec that they concern, those of arithmetic too."""
    try:
        with sound_arithmetic(most_extreme(spec.content)):
            yield
    except IdesignError as error:
        raise spec.place(error) from error
