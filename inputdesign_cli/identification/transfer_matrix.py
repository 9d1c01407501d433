"""Transfer matrices in s from sampled records: one estimate, or many."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.watching import Counted, tell
from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.identification.estimate import BatchEstimate, Estimate
from inputdesign_cli.identification.extensions import Extension, larger_transfer_matrices, new_name
from inputdesign_cli.identification.kind import Part, Starts, fit_records, identify_records
from inputdesign_cli.identification.of_model import OfModel
from inputdesign_cli.identification.record_problem import evaluate
from inputdesign_cli.identification.records import Records
from inputdesign_cli.identification.refined_iv import refine
from inputdesign_cli.identification.rivals import spread_out
from inputdesign_cli.identification.search import Search
from inputdesign_cli.identification.transfer_record import TransferRecord
from inputdesign_cli.identification.transfer_starts import starting_points
from inputdesign_cli.plant import ContinuousModel, Intersample, SampledModel
from inputdesign_cli.plant.model import DELAY

# Of the starts made from the data, as many are followed to the end: the likeliest after the instruments that
# are not beside each other.
_FOLLOWED = 3


@dataclass(frozen=True)
class TransferKind(OfModel):
    """A transfer matrix in s; see `Kind`."""

    model: ContinuousModel
    between: Intersample
    held: Mapping[tuple[int, int], float] = field(default_factory=dict)

    @property
    def continuous(self) -> bool:
        """Return whether frequencies of the model are in rad per time unit: not behind a hold."""
        return not self.between.hold

    @property
    def explaining(self) -> NDArray[np.bool_]:
        """(k,): all."""
        return np.ones(len(self.names), dtype=bool)

    @property
    def whitening(self) -> NDArray[np.bool_]:
        """(k,): none."""
        return np.zeros(len(self.names), dtype=bool)

    def own(self) -> Array:
        """Return the number of parameters of each output (p,); one that n outputs share counts as 1/n."""
        taken = np.zeros(self.outputs)
        for parameter in self.model.parameters:
            rows = sorted({i for i, _ in parameter.places})
            taken[rows] += 1.0 / len(rows)
        return taken

    def record(self, u: Array, y: Array) -> TransferRecord:
        """Samples u (N, r), y (N, p) that the structure is to explain."""
        return TransferRecord(self.model, u, y, self.between)

    def starts(self, parts: Sequence[Part], given: Array | None) -> Starts:
        """The likeliest after refined instrumental variables, from rest, and those from the `given` one."""
        singles = tuple(self.record(*part) for part in parts)
        about = Records(singles)
        begun = [theta for single in singles for theta in starting_points(single, self.held)]
        made = []
        for number, theta in enumerate(begun):
            tell(Counted("starting points tried", number, len(begun)))
            made.append(refine(about, evaluate(about, theta)))
        refined = [made[number] for number in spread_out(about, [point for point, _ in made], _FOLLOWED)]
        if given is not None:
            refined.append(refine(about, evaluate(about, about.stabilised(np.array(given)))))
        return Starts(
            np.array([point.theta for point, _ in refined]),
            np.array([steps for _, steps in refined], dtype=np.int64),
            len(made) + (given is not None),
        )

    def holding(self, known: NDArray[np.bool_]) -> TransferKind:
        """Return the kind with starts that keep known dead times."""
        held = {
            place: parameter.value
            for parameter, fixed in zip(self.model.parameters, known, strict=True)
            for place in parameter.places
            if fixed and parameter.letter == DELAY
        }
        return replace(self, held=held)

    def extensions(self, theta: Array, *, feedback: bool) -> tuple[Extension, ...]:
        """Return the extensions by a further zero or a dead time."""
        hold, step = self.between.hold, self.between.sample_time
        return tuple(
            Extension(
                SampledModel(larger, step) if hold else larger,
                new_name(larger, self.model),
                what,
                partial(TransferRecord, larger, intersample=self.between),
            )
            for larger, what in larger_transfer_matrices(self.model.at(theta), feedback=feedback)
        )

    def simulated(
        self, found: Search, y: Array, lengths: Sequence[int] | None
    ) -> tuple[Array, Sequence[bool]]:
        """Return the outputs less the prediction errors, since the noise is white."""
        return y - found.point.errors, (True,) * self.outputs


def identify_transfer_matrix(
    model: ContinuousModel,
    u: ArrayLike,
    y: ArrayLike,
    between: Intersample,
    *,
    start: ArrayLike | None = None,
    feedback: bool = False,
    lengths: Sequence[int] | None = None,
    rest: bool | None = None,
    earlier: Earlier | None = None,
) -> Estimate:
    """Return the maximum-likelihood estimate of a transfer matrix in s, with white noise on the outputs.

    The noise of the samples has an unknown full covariance. From each start refined instrumental variables
    iterate first, then Gauss and Newton with damping on the same equations; poles are kept in the left
    half plane. `refined_iv.py` explains why both have the same solutions.

    Args:
        model: the structure, and with it the names and the order of theta; its numbers are not used.
        u, y: (N, r), (N, p).
        between: the time between samples, and whether u is held there.
        start: (k,), tried besides starts made from the data.
        feedback: whether u(t) depends on y(t); the tests of the residuals account for it.
        lengths: of the records that follow each other in u and y; None for one.
        rest: whether each begins at rest about zero; None: as the data say.
        earlier: an estimate from other data, which counts along.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output`, `noise-free-data` or
            `not-exciting`.
    """
    return identify_records(
        TransferKind(model, between),
        np.asarray(u, dtype=float),
        np.asarray(y, dtype=float),
        start=None if start is None else np.asarray(start, dtype=float),
        feedback=feedback,
        lengths=lengths,
        rest=rest,
        earlier=earlier,
    )


def fit_transfer_matrices(
    model: ContinuousModel, u: ArrayLike, y: ArrayLike, between: Intersample, *, start: ArrayLike
) -> BatchEstimate:
    """The estimates of `identify_transfer_matrix` for many records, each from its one start, without checks.

    Args:
        model, between: see `identify_transfer_matrix`.
        u: (N, r) common to all runs, or (runs, N, r).
        y: (runs, N, p).
        start: (k,) for all runs, or (runs, k).
    """
    outputs = np.asarray(y, dtype=float)
    inputs = np.broadcast_to(np.asarray(u, dtype=float), (*outputs.shape[:2], model.inputs))
    begin = np.broadcast_to(np.asarray(start, dtype=float), (len(outputs), len(model.names)))
    kind = TransferKind(model, between)
    records = [Records((kind.record(*run),)) for run in zip(inputs, outputs, strict=True)]
    refined = [
        refine(record, evaluate(record, record.stabilised(row)))
        for record, row in zip(records, begin, strict=True)
    ]
    theta = np.array([point.theta for point, _ in refined])
    return fit_records(records, theta, np.array([steps for _, steps in refined]), kind.own())
