"""The verbs take a spec and return results. A spec becomes a task once; the task does not know the spec.

The modules of a question are imported when it is asked, so that no command waits for others. Numbers beyond
double precision become errors here, for every task.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import singledispatch
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
import yaml
from threadpoolctl import threadpool_limits

from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.compute.time_limit import time_limit
from inputdesign_cli.errors import DataError, Diagnostic, IdesignError, InaccurateError, InfeasibleError
from inputdesign_cli.findings import with_added
from inputdesign_cli.findings.explored_logs import written_spec_refused
from inputdesign_cli.outcome.results import Result, Results
from inputdesign_cli.specification import Spec, load_spec, parse_spec

if TYPE_CHECKING:
    import control

    from inputdesign_cli.explore.search import Family
    from inputdesign_cli.outcome.golden import Golden, GoldenRun
    from inputdesign_cli.questions.assessment.assess import Assessment
    from inputdesign_cli.questions.campaign.directory import Rounds
    from inputdesign_cli.questions.exploration.explore import Exploration
    from inputdesign_cli.records import Preparation

Files = str | Path | Sequence[str | Path]
Stated = Spec | str | Path | Mapping[str, object]
"""A spec, the name of its file, or its content as `Spec.from_dict` takes it."""
Verb = Literal["solve", "analyse", "simulate"]
"""The verbs that make results of a spec, by their names in commands, sweeps and golden files."""
# A number farther from one than this, in powers of ten, may be the cause of an overflow.
_EXTREME = 6.0


def solve(spec: Stated) -> Results:
    """Design the experiment that the spec asks for; a given excitation is analysed.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
        InfeasibleError: no excitation meets what is asked.
        InaccurateError: the proof did not close to the accuracy that is asked.
    """
    known = _known(spec)
    return _in_time(known, lambda: build_task(known).solve())


def analyse(spec: Stated) -> Results:
    """Return the accuracy that a given excitation gives, without any design. It raises as `solve` does."""
    known = _known(spec)
    return _in_time(known, lambda: build_analysis(known).solve())


def validate(spec: Stated) -> None:
    """Read, check and set up, but compute nothing: the design, or the estimation where none is asked for."""
    from inputdesign_cli.questions.assessment.build import build_identification

    known = _known(spec, design=None)
    with _placed(known):
        build_task(known) if known.asks_for_design else build_identification(known)


def simulate(spec: Stated, *, executor: Executor | None = None) -> Results:
    """Design the experiment, or take the given one, and try it many times on a simulated true system.

    Args:
        executor: where batches of runs are computed (default: in this process); the result does not depend
            on it.
    """
    known = _known(spec)
    return _in_time(known, lambda: build_task(known).simulate(executor))


def run_verb(verb: Verb, spec: Spec, executor: Executor | None = None) -> Results:
    """Return the results of `idesign VERB`; it raises as the verb does."""
    if verb == "simulate":
        return simulate(spec, executor=executor)
    return solve(spec) if verb == "solve" else analyse(spec)


def execute(golden: Golden, run: GoldenRun) -> Result | IdesignError:
    """Return the result of one run of a golden file, or the error that says why there is no design.

    Raises:
        SpecError, DataError: the spec that the golden file names cannot be used: nothing can be compared.
    """
    spec = load_spec(golden.spec_of(run), list(run.overrides))
    try:
        return run_verb(run.command, spec).result
    except (InfeasibleError, InaccurateError) as error:
        return error


def identify(
    spec: Stated,
    data: Files,
    *,
    remove_means: bool = False,
    operating_point: Mapping[str, float] | None = None,
    preparation: Preparation | None = None,
    frequency_response: bool = False,
) -> Results:
    """Estimate the model whose structure `plant` and `noise` give from recorded experiments.

    Args:
        spec: its plant and noise; it need not ask for a design (`load_spec(.., design=False)`).
        data: a data file, or several, which are estimated jointly.
        remove_means: whether to remove the means of u and y, file by file.
        operating_point: levels to remove from channels, by name: {"u1": 40, "y1": 52.3}.
        preparation: further preparation of the records.
        frequency_response: whether to measure the frequency response without a model instead, at the lines of
            `accuracy.frequency_response` where the spec has it.

    Raises:
        SpecError: the plant is not supported.
        DataError: the file cannot be used, or the data do not determine the parameters.
    """
    from inputdesign_cli.questions.assessment.build import build_identification
    from inputdesign_cli.questions.assessment.identify import identify as identify_records
    from inputdesign_cli.questions.frequency_response.build import build_measurement
    from inputdesign_cli.questions.frequency_response.measure import measure

    prepared, files = _prepared(preparation, operating_point, remove_means), _paths(data)
    known = _known(spec, design=False)
    with _placed(known):
        if frequency_response:
            found = measure(build_measurement(known), files, prepared)
        else:
            found = identify_records(build_identification(known), files, prepared)
        return with_added(finite(found, most_extreme(known.content)))


def assess(
    spec: Stated,
    data: Files,
    *,
    remove_means: bool = False,
    operating_point: Mapping[str, float] | None = None,
    preparation: Preparation | None = None,
) -> Assessment:
    """Identify the model from real experiments, compare its accuracy with the one asked, and top up.

    It takes data as `identify` does, and raises `SpecError` where nothing is asked that data could meet.
    """
    from inputdesign_cli.questions.assessment.assess import Assessment, assess as assess_records
    from inputdesign_cli.questions.assessment.build import build_identification
    from inputdesign_cli.questions.frequency_response.build import build_measurement
    from inputdesign_cli.questions.frequency_response.measure import measure

    known, prepared = _known(spec), _prepared(preparation, operating_point, remove_means)
    with _placed(known):
        if known.accuracy.frequency_response is not None:
            results = measure(build_measurement(known), _paths(data), prepared, assess=True)
            found = results.outcome.assessment
            assert found is not None  # the spec has lines
            judged = Assessment(found.verdict, finite(results, most_extreme(known.content)))
        else:
            judged = assess_records(build_identification(known), _paths(data), prepared)
        return replace(judged, results=with_added(judged.results))


def next_round(spec: Spec, decide: Callable[[Rounds], Results], *, begins: bool = False) -> Results:
    """Return the results of a decision of a campaign, which may be its first: the next part, or the end.

    Raises:
        SpecError: the spec has no campaign, or one that this version cannot do.
        DataError: a record cannot be used.
        InfeasibleError, InaccurateError: nothing can be planned.
    """
    from inputdesign_cli.questions.campaign.build import build_rounds

    with _placed(spec), time_limit(spec.solver.time_limit):
        return with_added(decide(build_rounds(spec, begins=begins)))


def explore(
    data: Files,
    preparation: Preparation | None = None,
    *,
    model: Spec | None = None,
    structure: Family | None = None,
    asked: Spec | None = None,
) -> Exploration:
    """Find a model in a log, without a spec; or judge a given model by it.

    Args:
        data: a data file, or several of the same experiment.
        preparation: the roles of the columns, and the preparation of the record.
        model: the model to judge, as a spec (`load_spec(.., design=False)`).
        structure: the structure to take; None: the simplest that explains the log as well as any.
        asked: a spec (`load_spec`); the next spec takes over its sections on the design.

    Raises:
        SpecError: the model cannot be judged, or cannot be asked for this.
        DataError: the log cannot be used, or determines no model at all.
        InaccurateError: the numbers of the log leave the range of double precision.
    """
    from inputdesign_cli.questions.building.header import build_header
    from inputdesign_cli.questions.exploration.build import Asked, model_to_judge
    from inputdesign_cli.questions.exploration.explore import explore as explore_log, judge
    from inputdesign_cli.records import Preparation

    prepared = preparation or Preparation()
    if model is None:
        with sound_arithmetic(most_extreme({})):
            found = explore_log(_paths(data), prepared, structure, Asked.of(asked) if asked else None)
            results = found.results
            if asked is not None:
                refusal = _refusal(results.resolved_spec, asked.resolve_path("."))
                results = results.saying(written_spec_refused(refusal))
            return replace(found, results=with_added(results))
    with _placed(model):
        found = judge(model_to_judge(model), build_header(model), _paths(data), prepared)
        return replace(found, results=with_added(found.results))


@singledispatch
def to_control(model: Spec | Results) -> control.lti.LTI:
    """Return G of a spec or of an identified model for python-control; if sampled, in discrete time.

    Raises:
        SpecError: `not-supported` for dead times of a plant that is not sampled.
    """
    raise TypeError("to_control takes a spec, or the results of identify")


@to_control.register(Spec)
def _(model: Spec) -> control.lti.LTI:
    from inputdesign_cli.questions.building.system import build_model
    from inputdesign_cli.questions.control_systems import system_of

    with _placed(model):
        return system_of(build_model(model), model.sample_time)


@to_control.register(Results)
def _(model: Results) -> control.lti.LTI:
    spec = parse_spec(model.resolved_spec, design=False)
    found = model.files.get("model.yaml")
    blocks = {} if found is None else yaml.safe_load(found)
    return to_control(spec.with_(**{key: blocks[key] for key in ("plant", "noise") if key in blocks}))


def _refusal(text: str, folder: Path) -> Diagnostic | None:
    """Return the first reason why `solve` would refuse a spec with files in a folder, or None."""
    try:
        build_task(parse_spec(text, "spec.yaml", folder=folder))
    except IdesignError as error:
        return error.diagnostics[0]
    return None


def _known(spec: Stated, design: bool | None = True) -> Spec:
    """Return a spec as it is, or read it from the file that is named or from a mapping; see `load_spec`."""
    if isinstance(spec, Spec):  # a spec read for `identify` alone has not passed the checks of designs
        return spec.revised({}, design=True) if design and not spec.asks_for_design else spec
    if isinstance(spec, Mapping):
        return Spec.from_dict(spec, design=design)
    return load_spec(Path(spec), design=design)


def _paths(data: Files) -> list[Path]:
    paths = [Path(data)] if isinstance(data, str | Path) else [Path(one) for one in data]
    if not paths:
        raise DataError.because("data-unreadable", "no data file is given", "name one file at least")
    return paths


def _prepared(
    preparation: Preparation | None, operating_point: Mapping[str, float] | None, remove_means: bool
) -> Preparation:
    from inputdesign_cli.records import Preparation

    given = preparation or Preparation()
    point = {**given.operating_point, **(operating_point or {})}
    detrend = "constant" if remove_means and given.detrend == "none" else given.detrend
    return replace(given, operating_point=point, detrend=detrend)


def _in_time(spec: Spec, found: Callable[[], Results]) -> Results:
    """Return finite results that are found within the time limit of the spec."""
    with _placed(spec), time_limit(spec.solver.time_limit):
        return with_added(finite(found(), most_extreme(spec.content)))


@contextmanager
def _placed(spec: Spec) -> Iterator[None]:
    """Add the lines of the spec to errors that concern them; errors of arithmetic are among these."""
    try:
        with sound_arithmetic(most_extreme(spec.content)):
            yield
    except IdesignError as error:
        raise spec.place(error) from error


class Task(Protocol):
    """Holds a question that was built and checked.

    Errors of all verbs name the key of the spec that they concern (`errors.bad_spec` with `key`). The verbs
    add its place in a file (`Spec.place`).
    """

    def solve(self) -> Results:
        """Return a design with its proof, or the accuracy that a given excitation gives."""

    def simulate(self, executor: Executor | None = None) -> Results:
        """Return the answer of `solve`, with the experiment tried many times on the true system.

        Args:
            executor: where batches of runs are computed (default: in this process).
        """


def build_analysis(spec: Spec) -> Task:
    """Return the task of a given excitation, whatever is asked of it.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
    """
    if spec.accuracy.frequency_response is not None and not spec.designs:
        return _response(spec)
    from inputdesign_cli.questions.given.build import build_given

    return build_given(spec)


def build_task(spec: Spec) -> Task:
    """Return the task of a spec; everything that can be wrong with the spec is reported here.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used.
    """
    if spec.campaign is not None:
        from inputdesign_cli.questions.campaign.build import build_campaign

        return build_campaign(spec)
    if not spec.designs:
        return build_analysis(spec)
    if spec.accuracy.frequency_response is not None:
        return _response(spec)
    if spec.plant.kind == "regression":
        from inputdesign_cli.questions.regression.build import build_regression_task

        return build_regression_task(spec)
    if spec.accuracy.closed_loop_error is not None:
        from inputdesign_cli.questions.loop_error.build import build_loop_error_task

        return build_loop_error_task(spec)
    from inputdesign_cli.questions.least_cost.build import build_convex

    return build_convex(spec)


def _response(spec: Spec) -> Task:
    from inputdesign_cli.questions.frequency_response.build import build_response_task

    return build_response_task(spec)


_ALONE = RLock()


@contextmanager
def sound_arithmetic(extreme: tuple[str, float]) -> Iterator[None]:
    """Turn overflow, division by zero and singular matrices into errors of the spec.

    Args:
        extreme: the key of the spec whose number is farthest from one, and how many powers of ten that is.

    Raises:
        InaccurateError: `beyond-precision`, `numerically-singular`.
    """
    # All threads share the filters of warnings, so that one computes at a time. Matrices are small, so that
    # threads of BLAS would only wait for each other.
    strict = np.errstate(over="raise", divide="raise", invalid="raise")
    with _ALONE, strict, threadpool_limits(1, "blas"), warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            yield
        except np.linalg.LinAlgError as error:
            raise InaccurateError.because(
                "numerically-singular",
                "the information matrix is singular to working precision: parameters are nearly alike",
                "lower the orders, or look for poles and zeros that nearly cancel",
                "plant",
            ) from error
        except (ArithmeticError, RuntimeWarning) as error:
            raise _beyond(extreme, str(error)) from error


def finite(results: Results, extreme: tuple[str, float]) -> Results:
    """Return the results if every number of them is finite.

    Raises:
        InaccurateError: `beyond-precision`.
    """
    try:
        _ = results.result
    except ValueError as error:
        raise _beyond(extreme, str(error)) from error
    for name, table in results.tables.items():
        for column, values in table.columns.items():
            if not np.all(np.isfinite(values)):
                raise _beyond(extreme, f"{column} of {name}.csv has values that are not finite")
    return results


def most_extreme(data: object) -> tuple[str, float]:
    """Return the key of the number in plain data that is farthest from one, and its powers of ten."""

    def walk(node: object, key: str) -> Iterator[tuple[str, float]]:
        if isinstance(node, dict):
            for name, value in node.items():
                yield from walk(value, f"{key}.{name}" if key else str(name))
        elif isinstance(node, list | tuple):
            for index, value in enumerate(node):
                yield from walk(value, f"{key}[{index}]")
        elif isinstance(node, int | float) and not isinstance(node, bool) and node:
            yield key, abs(math.log10(abs(node)))

    return max(walk(data, ""), key=lambda found: found[1], default=("", 0.0))


def _beyond(extreme: tuple[str, float], why: str) -> InaccurateError:
    key, far = extreme
    hint = "choose units in which the signals and the parameters are of the order of one"
    if far > _EXTREME:
        hint = f"{key} is the most extreme number of the spec: {hint}"
    message = f"the numbers of this question leave the range of double precision: {why}"
    return InaccurateError.because("beyond-precision", message, hint, key if far > _EXTREME else "")
