"""Records -> an estimate of `plant` and `noise`, ready to paste, and the accuracy that the data give."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from inputdesign_cli.accuracy import ModelError, Requirement, model_errors
from inputdesign_cli.accuracy.model_error import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, Diagnostic, IdesignError, Location, SpecError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.estimates import (
    band_limited,
    larger_noise,
    near_zero,
    noise_probability,
    on_the_circle,
    started,
    stopped_at_ends,
    unasked,
    unsettled,
)
from inputdesign_cli.findings.faults import faults, loop_faults, shifted_levels
from inputdesign_cli.findings.other_systems import differences, prior_notes
from inputdesign_cli.findings.refuted_structure import refutations
from inputdesign_cli.findings.rivals import other_minima, ruled_out
from inputdesign_cli.findings.unrelated_inputs import answering, hardly_explained, idle
from inputdesign_cli.identification import (
    Earlier,
    Estimate,
    Noise,
    Rival,
    identify as estimate_model,
    with_larger_noise,
)
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.plant import Model, TransferMatrix
from inputdesign_cli.questions.assessment.outcome import (
    bound_of_data,
    data_curves,
    identification_entry,
    information_entry,
    model_text,
)
from inputdesign_cli.questions.assessment.spread import as_simulated
from inputdesign_cli.questions.common.confidence import Confidence
from inputdesign_cli.questions.common.foresight import Foreseen, Knowledge, that_agrees
from inputdesign_cli.records import Preparation, Record, read_data


@dataclass(frozen=True)
class ModelQuestion:
    """Holds the requirements of a spec at one model.

    Attributes:
        experiment: on that model, in its loop, in coordinates where the information of the data is I.
        confidence: the size of the confidence region of r_u.
        requirements: all that is asked, in these coordinates.
        entries: the model errors of every entry of G, for r_u if no requirement bounds one.
        top_up: designs the experiment that the model still needs, with a record about these levels of the
            inputs, by name; None if the spec designs nothing.
    """

    experiment: Experiment
    confidence: Confidence
    requirements: Sequence[Requirement]
    entries: Sequence[ModelError]
    top_up: Callable[[Mapping[str, float]], Results] | None

    @property
    def information(self) -> Array:
        """Return the information (k, k) of the data, which is I in these coordinates."""
        return np.eye(self.experiment.size)

    @property
    def asked(self) -> Sequence[OnModelError]:
        """Return the requirements on the model error."""
        return model_errors(self.requirements)

    @property
    def errors(self) -> Sequence[OnModelError]:
        """Return the model errors that r_u is computed for: those required, or else every entry of G."""
        return self.asked or self.entries

    def ratio(self, information: Array) -> float:
        """Return the largest ratio to the admitted error at an information (k, k) in these coordinates."""
        return max(requirement.worst(information).ratio for requirement in self.requirements)


@dataclass(frozen=True)
class Identification:
    """States what is to be estimated from data, and the accuracy required of the estimate.

    Attributes:
        nominal: the structure; its parameters are one of the starts.
        nominal_covariance: (k, k), covariance of its parameters, zero where the spec states none.
        assessable: whether any accuracy is asked for that data could meet or miss.
        operating_point: the levels in the spec that signals vary about, by channel.
        earlier: the prior as an estimate, combined with the data; None if it has no values.
        has_prior: whether the spec states prior information.
        hold: the samples for which a designed record holds each value.
        controller: C of the loop u = r - C y that the data come from; None: there is none, or not in q^-1.
        knowledge: further knowledge of the parameters in the spec; None if there is none.
        foreseen: the plants that the design was made for; None if it was made for the plant of the spec.
        at: returns the question of the spec at another model, for a number of samples. The factor (k, k) of
            their information sets the coordinates, and the text names the model in diagnostics.
        with_noise: returns this task with the noise of a model and further factors of C and D.
    """

    header: Header
    nominal: Model
    nominal_covariance: Array
    assessable: bool
    operating_point: Mapping[str, float]
    earlier: Earlier | None
    has_prior: bool
    hold: int
    controller: TransferMatrix | None
    knowledge: Knowledge | None
    foreseen: Foreseen | None
    at: Callable[[Model, int, Array, str], ModelQuestion]
    with_noise: Callable[[Model, Sequence[Noise]], Identification]


@dataclass(frozen=True)
class Identified:
    """Holds an estimate, its data, and the accuracy asked of it.

    Attributes:
        question: None if the requirement cannot be evaluated at this estimate; `unasked` says why.
        ruled_out: other minima, which knowledge of the plant rules out.
        loop_noted: whether a note says already that inputs answer the outputs.
        noise_refuted: the probability of residuals as coloured under the noise model of the spec; None
            unless a larger noise model replaced it.
        scatter: the findings of simulated records on the errors of the estimate.
    """

    estimate: Estimate
    model: Model
    data: Record
    preparation: Preparation
    question: ModelQuestion | None = None
    unasked: str = ""
    ruled_out: tuple[Rival, ...] = ()
    loop_noted: bool = False
    noise_refuted: float | None = None
    scatter: tuple[Finding, ...] = ()

    def asked_by(self, task: Identification, source: str) -> Identified:
        """Return the estimate with the question that the spec asks at it, where it can be asked.

        Raises:
            DataError: a file that the spec names cannot be used.
        """
        samples, factor = len(self.data.y), self.estimate.factor
        try:
            return replace(self, question=task.at(self.model, samples, factor, source))
        except DataError:
            raise
        except IdesignError as error:
            return replace(self, unasked=sentence_of(error))


def identified(
    task: Identification, paths: Sequence[Path], preparation: Preparation
) -> tuple[Identification, Identified]:
    """Return the estimate from the data in `paths`, jointly, and the question that it answers.

    The nominal parameters are one of the starts. Where the residuals refute the noise of the spec, further
    factors of C and D, of small orders, are estimated too. One short record in open loop is simulated many
    times, which shows the errors of its estimate.

    Raises:
        DataError: a file cannot be used, or the data do not determine the parameters.
    """
    task, found = _with_enough_noise(task, paths, preparation)
    units, data = task.header.units, found.data
    if units.closed_loop or found.estimate.prior is not None or len(data.lengths) > 1:
        return task, found
    estimate, scatter = as_simulated(found.model, found.estimate, data.u, units.step)
    if not scatter:
        return task, found
    found = replace(found, estimate=estimate, scatter=tuple(scatter))
    return task, found.asked_by(task, f"{paths[0].name} (estimate)")


def _with_enough_noise(
    task: Identification, paths: Sequence[Path], preparation: Preparation
) -> tuple[Identification, Identified]:
    """Return the estimate with the noise of the spec, or with the larger one that the residuals ask for."""
    known = {**task.operating_point, **preparation.operating_point}
    taken = replace(preparation, operating_point=known)
    found = estimated(task, read_data(paths, task.header.units, taken), paths[0], taken)
    estimate = found.estimate
    plant = dict(zip(estimate.names, estimate.theta.tolist(), strict=True))

    def larger(noises: list[Noise]) -> tuple[Estimate, tuple[Identification, Identified]] | None:
        try:
            asked = replace(task.with_noise(found.model, noises), header=task.header)
            start = asked.nominal.theta.copy()
            for k in np.flatnonzero(asked.nominal.in_plant):
                start[k] = plant[asked.nominal.names[k]]
            other = estimated(asked, found.data, paths[0], taken, start=start)
        except IdesignError:  # this plant cannot have this noise, or it cannot be estimated
            return None
        return other.estimate, (asked, replace(other, noise_refuted=noise_probability(estimate)))

    return with_larger_noise(estimate, larger) or (task, found)


def estimated(
    task: Identification, data: Record, first: Path, taken: Preparation, *, start: Array | None = None
) -> Identified:
    """Return the estimate, and the question that it answers, from data that have been read.

    Args:
        first: the file that errors about the data name.
        taken: the preparation of the data.
        start: an estimate (k,) of these data with another noise; None: there is none.

    Raises:
        DataError: the data do not determine the parameters.
    """
    units, nominal = task.header.units, task.nominal

    def from_start(start: Array, near: bool) -> Estimate:
        return estimate_model(
            nominal,
            data.u,
            data.y,
            units.step,
            start=start,
            feedback=units.closed_loop,
            lengths=data.lengths,
            rest=False if len(data.lengths) > len(data.files) else None,  # after a cut it is not at rest
            earlier=task.earlier,
            experiments=[samples for _, samples in data.files],
            near=near,
            ramp=data.lined,
        )

    with blaming_columns(first, data):
        likeliest = from_start(nominal.theta if start is None else start, start is not None)
        estimate, ruled_out = that_agrees(task.knowledge, likeliest, partial(from_start, near=True))
    if task.earlier is not None and task.earlier.is_of_these_data(estimate.theta, estimate.factor):
        raise DataError.because(
            "data-repeated",
            f"experiment.prior is the estimate from {first.name} itself: its information would count twice",
            "leave the prior out, or give only records that it was not made of",
            "experiment.prior",
        )
    model = nominal.at(estimate.theta, estimate.noise)
    found = Identified(estimate, model, data, taken, ruled_out=ruled_out)
    return found.asked_by(task, f"{first.name} (estimate)")


def sentence_of(error: IdesignError) -> str:
    """Return the messages and hints of an error as one sentence."""
    return "; ".join(f"{d.message}{f' ({d.hint})' if d.hint else ''}" for d in error.diagnostics)


def findings_of(task: Identification, found: Identified) -> list[Finding]:
    """Return all findings for or against the data and the estimate."""
    units, model, estimate, question = task.header.units, found.model, found.estimate, found.question
    # At the end of the domain of an expression, G may vanish whatever the inputs are.
    at_ends = stopped_at_ends(model, estimate)
    rivals = (
        other_minima(units, model, estimate, question.asked, question.entries, question.information)
        if question is not None
        else []
    )
    return [
        *unsettled(model, estimate),
        *larger_noise(model, found.noise_refuted),
        *found.scatter,
        *started(estimate, levels=any(name.startswith("y") for name in found.preparation.operating_point)),
        *on_the_circle(model, estimate),
        # Faults of measurement stand alone, as they upset other tests.
        *(
            mismeasured(task, found)
            or [
                *([] if at_ends else idle(units, task.nominal, model, estimate)),
                *shifted_levels(estimate, found.data, units.time_unit),
                *refutations(model, estimate),
                *([] if found.loop_noted else answering(units, estimate)),
                *found.data.repeated,
            ]
        ),
        *([] if at_ends else hardly_explained(units, model, estimate)),
        *near_zero(estimate),
        *band_limited(model, estimate),
        *differences(estimate, [name for name, _ in found.data.files]),
        *prior_notes(estimate, stated=task.has_prior),
        *ruled_out(estimate, found.ruled_out),
        *unasked(found.unasked),
        *rivals,
    ]


def mismeasured(task: Identification, found: Identified) -> list[Finding]:
    """Return faults of measurement."""
    own = faults(task.header.units, found.estimate, found.data)
    return [*own, *loop_faults(task.controller, found.data)]


def identification_results(task: Identification, found: Identified, began: float) -> Results:
    """Return the results that `idesign identify` writes; `began` is `time.perf_counter()` at the start."""
    header, question, estimate = task.header, found.question, found.estimate
    tables, curves = data_curves(header.units, found.data, estimate)
    bound = None
    if question is not None:
        tables["bound"], curves["bound"], bound = bound_of_data(
            header.units,
            question.confidence,
            question.errors,
            asked=bool(question.asked),
            information=question.information,
        )
    outcome = Outcome(
        title=header.title,
        status="identified" if estimate.search.converged else "not_converged",
        samples=len(estimate.errors),
        identification=identification_entry(estimate, found.preparation, found.ruled_out),
        information=information_entry(estimate),
        model_error=bound,
    ).with_findings([*found.data.findings, *findings_of(task, found)])
    outcome = replace(outcome, timing_s={"identification": time.perf_counter() - began})
    files = {"model.yaml": model_text(header.units, found.model, estimate).encode()}
    return Results(outcome, header.resolved_spec, header.units.time_unit, tables, curves, files)


def identify(task: Identification, paths: Sequence[Path], preparation: Preparation) -> Results:
    """Estimate the model whose structure `plant` and `noise` give from records; see `identified`."""
    began = time.perf_counter()
    return identification_results(*identified(task, paths, preparation), began)


@contextmanager
def blaming_columns(path: Path, record: Record) -> Iterator[None]:
    """Locate errors of an estimator at the column of the first file that they concern.

    Raises:
        DataError: in place of the estimator's `SpecError`.
    """
    try:
        yield
    except SpecError as error:
        header = list(record.header)

        def placed(diagnostic: Diagnostic) -> Diagnostic:
            named = [name for name in header if name.startswith(diagnostic.key or "u")]
            before = header[: header.index(named[0])] if named else []
            column = 1 + sum(len(name) + 1 for name in before)
            return replace(diagnostic, location=Location(str(path), 1, column, ",".join(header)))

        raise DataError([placed(diagnostic) for diagnostic in error.diagnostics]) from error
