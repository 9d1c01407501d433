"""An estimate from records, whatever the kind of model: what a kind answers, and the road from data to it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.watching import Counted, tell
from inputdesign_cli.identification.checks import check_length, check_varying
from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.identification.estimate import (
    BatchEstimate,
    Estimate,
    concluded,
    information_of,
    noise_of,
)
from inputdesign_cli.identification.extensions import Extension
from inputdesign_cli.identification.gauss_newton import minimise
from inputdesign_cli.identification.record_problem import RecordProblem, evaluate
from inputdesign_cli.identification.records import Record, Records, centred, longest, split
from inputdesign_cli.identification.search import Search, from_rest_or_free, search
from inputdesign_cli.identification.variations import variations
from inputdesign_cli.identification.white import Echoes

Part = tuple[Array, Array]
"""u (N, r) and y (N, p) of one record."""


class Starts(NamedTuple):
    """Where a search begins: points (n, k), the steps (n,) made to each, and how many points were tried."""

    points: Array
    steps: NDArray[np.int64]
    tried: int


class Kind(Protocol):
    """A structure of k parameters and p outputs that records are to determine."""

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names (k,) of the parameters."""

    @property
    def outputs(self) -> int:
        """Return the number of outputs p."""

    @property
    def continuous(self) -> bool:
        """Return whether frequencies of the model are in rad per time unit."""

    @property
    def recent(self) -> int:
        """Return the lag up to which the structure looks at the inputs."""

    @property
    def explaining(self) -> NDArray[np.bool_]:
        """Return the mask (k,) of the parameters that take directions of past inputs away from residuals."""

    @property
    def whitening(self) -> NDArray[np.bool_]:
        """Return the mask (k,) of the parameters that make residuals look whiter."""

    def own(self) -> Array:
        """Return the number of parameters of each output (p,); one that n outputs share counts as 1/n."""

    def record(self, u: Array, y: Array) -> Record:
        """Return the record of samples u (N, r), y (N, p) that the structure is to explain."""

    def starts(self, parts: Sequence[Part], given: Array | None) -> Starts:
        """Return starting points: made from records at rest about zero, and the `given` one (k,)."""

    def holding(self, known: NDArray[np.bool_]) -> Self:
        """Return the kind with starts that keep `known` parameters (k,), if its starts can do that."""

    def extensions(self, theta: Array, *, feedback: bool) -> tuple[Extension, ...]:
        """Return the extensions of the structure at theta (k,) by one parameter.

        Args:
            feedback: whether u(t) depends on y(t).
        """

    def echoes(self, theta: Array, lengths: Sequence[int]) -> Echoes | None:
        """Return what past errors add to gradients at theta (k,), in records of `lengths`; None: unknown."""

    def simulated(
        self, found: Search, y: Array, lengths: Sequence[int] | None
    ) -> tuple[Array, Sequence[bool]]:
        """Return the effect of inputs and starts (N, p), and which outputs can be simulated."""


def identify_records(
    kind: Kind,
    u: Array,
    y: Array,
    *,
    start: Array | None,
    feedback: bool,
    lengths: Sequence[int] | None,
    rest: bool | None,
    earlier: Earlier | None,
    experiments: Sequence[int] | None = None,
    weights: Array | None = None,
    near: bool = False,
    ramp: bool = False,
) -> Estimate:
    """Return the maximum-likelihood estimate of a structure from one record, or jointly from several.

    Args:
        kind: gives names, orders and delays; its numbers are not used.
        u, y: (N, r), (N, p).
        start: (k,), tried besides starts that are made from the data.
        feedback: whether u(t) depends on y(t); the tests of the residuals account for it.
        lengths: of the records that follow each other in u and y; None for one.
        rest: whether each begins at rest about zero; None: as the data say.
        earlier: an estimate from other data, which counts along.
        experiments: the samples of each experiment, of one or several records; None: all are of one.
        weights: W (p, p) of the errors if the covariance of the noise is known.
        near: whether `start` is an estimate of such data already, so that no others are made.
        ramp: whether outputs may drift along a line in every record, whose slope is estimated along; no
            record then begins at rest.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output`, `noise-free-data` or
            `not-exciting`.
    """
    check_length(len(y), len(kind.names), kind.recent, outputs=kind.outputs)
    check_varying(kind.names, u, y)
    parts = split(u, y, lengths)

    def records_of(signals: Sequence[Part]) -> Records:
        made = tuple(kind.record(*part) for part in signals)
        return Records(made, weights=weights, earlier=earlier, ramp=ramp)

    def searched(records: Records, known: Array | None) -> Search:
        chosen = longest(parts)
        if near and start is not None:
            begin = Starts(start[None], np.zeros(1, dtype=np.int64), 1)
        else:
            begin = kind.starts(centred(chosen) if records.free else chosen, start)
        others = [theta for theta in (known, None if earlier is None else earlier.theta) if theta is not None]
        points = np.concatenate([begin.points, *(theta[None] for theta in others)])
        steps = np.append(begin.steps.astype(float), np.zeros(len(others)))
        tell(Counted("starting points followed to a minimum", 0, len(points)))
        return search(records, points, starts=begin.tried + (earlier is not None), before=steps)

    known_rest = False if ramp else rest
    best = from_rest_or_free(records_of(parts), records_of(centred(parts)), known_rest, searched, start)
    simulated, stable = kind.simulated(best, y, lengths)
    moved = None if kind.continuous or not all(stable) else simulated
    return concluded(
        kind.names,
        best,
        y,
        simulated,
        stable,
        own=kind.own(),
        in_noise=int(np.sum(kind.whitening)),
        in_plant=int(np.sum(kind.explaining)),
        recent=kind.recent,
        alternatives=(
            *(one.against(best.records) for one in kind.extensions(best.point.theta, feedback=feedback)),
            *variations(best.records, kind.record, best.point.theta, moved),
        ),
        experiments=experiments or (len(y),),
        feedback=feedback,
        echoes=kind.echoes(best.point.theta, best.records.lengths),
    )


def fit_records(records: Sequence[Records], start: Array, steps: Array, own: Array) -> BatchEstimate:
    """Return the estimates of many runs, each from its one start (k,), without checks.

    Args:
        records: one a run.
        start: (runs, k), and the steps (runs,) made to each.
        own: see `Kind`.
    """
    found = minimise(RecordProblem(tuple(records)), start)
    points = [evaluate(record, theta) for record, theta in zip(records, found.theta, strict=True)]
    noise = np.array([noise_of(point, own) for point in points])
    return BatchEstimate(
        theta=found.theta,
        noise=noise,
        information=np.array([information_of(*each) for each in zip(records, points, noise, strict=True)]),
        converged=found.converged,
        steps=found.steps + steps.astype(np.int64),
    )


def fit_batches(kind: Kind, u: ArrayLike, y: ArrayLike, start: ArrayLike) -> BatchEstimate:
    """Estimate many records, given as arrays, each from a single start and without checks.

    Args:
        kind: gives the structure.
        u: (N, r) common to all runs, or (runs, N, r).
        y: (runs, N, p).
        start: (k,) for all runs, or (runs, k).
    """
    outputs, given = np.asarray(y, dtype=float), np.asarray(u, dtype=float)
    inputs = np.broadcast_to(given, (*outputs.shape[:2], given.shape[-1]))
    begin = np.broadcast_to(np.asarray(start, dtype=float), (len(outputs), len(kind.names)))
    records = [Records((kind.record(*run),)) for run in zip(inputs, outputs, strict=True)]
    return fit_records(records, np.array(begin), np.zeros(len(outputs), dtype=np.int64), kind.own())
