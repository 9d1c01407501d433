"""All outputs: the structure of each found by itself, then one model of all of them on the whole record."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.identification.checks import check_varying, signal_name
from inputdesign_cli.identification.estimate import Estimate
from inputdesign_cli.identification.estimators import identify
from inputdesign_cli.identification.explore.busiest import busiest
from inputdesign_cli.identification.explore.candidates import Candidate, Chosen, Ranges
from inputdesign_cli.identification.explore.fits import (
    NOT_COMPUTED,
    Fits,
    Parts,
    beside,
    fits,
    is_steady,
    output_error_form,
)
from inputdesign_cli.identification.explore.processes import process_models
from inputdesign_cli.identification.explore.search import explore_structure
from inputdesign_cli.plant import Model, PolynomialModel
from inputdesign_cli.plant.polynomial import Array

Split = Literal["the first 60 % and the rest", "blocks in turn", "none"]

_SHARE = 0.6
# Where an input steps in blocks of one kind only, fewer or more of them may part its steps.
_BLOCKS = (10, 9, 11, 8, 12, 7, 13, 6, 14)
# An input whose rms about its level is less than this share of that in all records rests.
_STILL = 0.2
_FEWEST = 30
_MOST_SAMPLES = 20_000
_UNKNOWN = ("gain and dynamics",)
_TOO_SIMPLE = "the input moves too little or too simply: apply steps of several lengths, or a PRBS"
# So many structures, the best first, are tried for all outputs together where those that were chosen fail.
_MOST_TRIED = 4


@dataclass(frozen=True)
class Found:
    """What a record tells.

    Attributes:
        outputs: what was found for each; `taken` is the candidate that the model is made of, `ranges` has of
            each input the delays that 95 % of confidence leaves it.
        model: of all channels, estimated on the whole record; inputs that never move have no part in it.
        estimate: its estimate; `used` are the records that it was made from, and `samples` (n,) where these
            stand in all.
        validation: the fits of the same structures, estimated on one part, to the other.
        split: which part estimates and which judges; of none the whole record does both.
        still: inputs (from zero) that never move.
        slopes: (p,), of the lines that were taken away from the outputs, a sample; None: of none.
    """

    outputs: tuple[Chosen, ...]
    taken: tuple[Candidate, ...]
    ranges: tuple[Ranges, ...]
    model: Model
    estimate: Estimate
    used: Parts
    samples: NDArray[np.int64]
    validation: Fits
    split: Split
    still: tuple[int, ...]
    slopes: Array | None = None

    @property
    def moving(self) -> list[int]:
        """The other inputs."""
        return [j for j in range(self.model.inputs) if j not in self.still]

    @property
    def steady(self) -> bool:
        """Whether the plant is stable, as far as the record tells."""
        return is_steady(self.model, sum(len(y) for _, y in self.used))


def explored(parts: Parts, *, feedback: bool, step: float, ramp: bool) -> Found:
    """The model that records u (n, r), y (n, p) speak for, samples `step` apart.

    Args:
        feedback: whether u(t) may answer y(t).
        ramp: whether a line of each output is estimated along, in every record, from the whole of it.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output` or `no-structure`.
    """
    still, moved = moving_in(parts)
    moving = [j for j in range(parts[0][0].shape[1]) if j not in still]
    first, second, split = divided(moved)
    found = _structures(first, second, feedback, step, physical=not still)
    used = busiest(moved, _MOST_SAMPLES)
    taken, estimate, model = _estimated(found, used, feedback, ramp)
    validation = beside(
        [fits(c.model, [(u, y[:, i : i + 1]) for u, y in second]) for i, c in enumerate(taken)]
    )
    whole = joined(taken, parts[0][0].shape[1], moving).at(model.theta, model.covariance)
    return Found(
        tuple(found),
        taken,
        tuple(chosen.ranges(own) for chosen, own in zip(found, taken, strict=True)),
        whole,
        replace(estimate, names=whole.names),
        busiest(parts, _MOST_SAMPLES),
        _busiest_samples(moved),
        validation,
        split,
        still,
    )


def _structures(first: Parts, second: Parts, feedback: bool, step: float, *, physical: bool) -> list[Chosen]:
    """What is found for each output.

    Raises:
        SpecError: `no-structure`.
    """
    found, outputs = [], first[0][1].shape[1]
    for i in range(outputs):
        own = [[(part_u, part_y[:, i : i + 1]) for part_u, part_y in some] for some in (first, second)]
        chosen = explore_structure(own[0], own[1], feedback=feedback, step=step, physical=physical)
        if chosen is None:
            name = signal_name("y", i, outputs)
            raise bad_spec(
                "no-structure",
                f"no model of {name} could be estimated: the record does not tell its parameters",
                hint=_TOO_SIMPLE,
                key=name,
            )
        found.append(chosen)
    return found


def moving_in(parts: Parts) -> tuple[tuple[int, ...], list[tuple[Array, Array]]]:
    """The inputs that never move, and the records without them.

    Raises:
        SpecError: `too-few-samples`, `constant-input` or `constant-output`.
    """
    u, y = (np.concatenate(signals) for signals in zip(*parts, strict=True))
    still = tuple(int(j) for j in np.flatnonzero(np.ptp(u, axis=0) <= 1e-12 * np.abs(u).max(axis=0)))
    if len(still) == u.shape[1]:
        check_varying(_UNKNOWN, u, y)
    moving = [j for j in range(u.shape[1]) if j not in still]
    check_varying(_UNKNOWN, u[:, moving], y)
    needed = _FEWEST * (len(moving) + 1) // 2
    if len(y) < needed:
        raise bad_spec(
            "too-few-samples",
            f"{len(y)} samples are too few to choose a structure and to judge it: take {needed} at least",
            hint="record more; or identify a structure that you know: idesign identify DATA --spec SPEC",
            key="u",
        )
    return still, [(part_u[:, moving], part_y) for part_u, part_y in parts]


def _busiest_samples(parts: Parts) -> NDArray[np.int64]:
    lengths = [len(y) for _, y in parts]
    every = np.split(np.arange(sum(lengths), dtype=float)[:, None], np.cumsum(lengths)[:-1])
    counted = [(u, at) for (u, _), at in zip(parts, every, strict=True)]
    return np.concatenate([at[:, 0] for _, at in busiest(counted, _MOST_SAMPLES)]).astype(np.int64)


def _estimated(
    found: Sequence[Chosen], used: Parts, feedback: bool, ramp: bool
) -> tuple[tuple[Candidate, ...], Estimate, Model]:
    """The best structures on the whole record; simpler ones where these cannot be estimated there.

    Where all of them stand on the limit of stability, the first that is stable: it is like an integrator.
    """
    inputs, samples = used[0][0].shape[1], sum(len(y) for _, y in used)
    reason: SpecError | None = None
    edge: tuple[tuple[Candidate, ...], Estimate, Model] | None = None
    for taken in _combinations(found):
        try:
            begun = taken
            if len(taken) > 1:
                # Where one output has several minima, a search for all of them seldom leaves a wrong one.
                begun = tuple(_alone(own, used, i, feedback, ramp) for i, own in enumerate(taken))
            structure = joined(begun, inputs, range(inputs))
            near = len(taken) > 1 or _near(taken[0], inputs)
            start = taken[0].starts if near and len(taken) == 1 else structure.theta
            estimate = _identified(structure, used, feedback, start, near=near, ramp=ramp)
        except SpecError as error:
            reason = error
            continue
        except NOT_COMPUTED:
            continue
        model = structure.at(estimate.theta, estimate.noise)
        if is_steady(model, samples):
            return taken, estimate, model
        if edge is None and output_error_form(model).radius < 1.0:
            edge = (taken, estimate, model)
    if edge is not None:
        return edge
    raise reason or bad_spec(
        "no-structure",
        "no stable model explains the record",
        hint="record it in a loop, or remove the drift: --detrend linear",
        key="y",
    )


def _alone(candidate: Candidate, used: Parts, output: int, feedback: bool, ramp: bool) -> Candidate:
    """The structure of one output, estimated from the whole record without the others."""
    own = [(u, y[:, output : output + 1]) for u, y in used]
    near = _near(candidate, used[0][0].shape[1])
    start = candidate.starts if near else candidate.theta
    estimate = _identified(candidate.model, own, feedback, start, near=near, ramp=ramp)
    return replace(candidate, model=candidate.model.at(estimate.theta, estimate.noise))


def _near(candidate: Candidate, inputs: int) -> bool:
    """Whether a search from where the first part has led is enough.

    Of plants in s other starts cost more than the search. Of several inputs that move much together what they
    do may be exchanged between them, which leaves another minimum.
    """
    return candidate.orders.physical and inputs == 1


def _identified(
    structure: Model, used: Parts, feedback: bool, start: Array, *, near: bool, ramp: bool
) -> Estimate:
    u, y = (np.concatenate(signals) for signals in zip(*used, strict=True))
    return identify(
        structure,
        u,
        y,
        start=start,
        feedback=feedback,
        lengths=[len(part) for _, part in used],
        rest=False,
        near=near,
        ramp=ramp,
    )


def _combinations(found: Sequence[Chosen]) -> Iterator[tuple[Candidate, ...]]:
    """What may be taken for all outputs together: all in s by their names, or all polynomials in q^-1.

    The kind that is best for the first output where both will do; then those that judge next best, and at
    last the simplest.
    """
    kinds = (found[0].best.orders.physical, not found[0].best.orders.physical)
    for choices in ([chosen.best_of(physical=kind) for chosen in found] for kind in kinds):
        taken = tuple(choice for choice in choices if choice is not None)
        if len(taken) == len(found):
            yield taken
    plain = [
        [c for c in chosen.ranked if not c.orders.physical and np.isfinite(c.validation)] for chosen in found
    ]
    if all(plain):
        for rank in range(_MOST_TRIED):
            yield tuple(own[min(rank, len(own) - 1)] for own in plain)
        yield tuple(min(own, key=lambda c: c.orders.size) for own in plain)


def divided(parts: Parts) -> tuple[Parts, Parts, Split]:
    """What estimates and what judges: beginning and end of the records.

    Blocks in turn where an input rests in one of these; the whole twice where it does so in any blocks.
    """
    for first, second, split in _divisions(parts):
        if _moves(first, parts) and _moves(second, parts):
            return first, second, split
    return parts, parts, "none"


def _divisions(parts: Parts) -> Iterator[tuple[Parts, Parts, Split]]:
    total = sum(len(y) for _, y in parts)
    first: list[tuple[Array, Array]] = []
    second: list[tuple[Array, Array]] = []
    left = int(_SHARE * total)
    for u, y in parts:
        at = min(max(left, 0), len(y))
        left -= len(y)
        for some, piece in ((first, slice(0, at)), (second, slice(at, None))):
            if len(y[piece]):
                some.append((u[piece], y[piece]))
    yield first, second, "the first 60 % and the rest"
    for count in _BLOCKS:
        length = max(total // count, 1)
        blocks = [
            (u[begin : begin + length], y[begin : begin + length])
            for u, y in parts
            for begin in range(0, len(y), length)
            if len(y) - begin >= length // 2
        ]
        yield blocks[::2], blocks[1::2], "blocks in turn"


def _moves(some: Parts, whole: Parts) -> bool:
    """Whether all inputs move in a part, as they do in the whole, beside its level in every record."""
    if not some:
        return False
    spread, of_all = (
        np.concatenate([u - u.mean(axis=0) for u, _ in records]).std(axis=0) for records in (some, whole)
    )
    return bool(np.all(spread > _STILL * of_all))


def joined(taken: Sequence[Candidate], inputs: int, moving: Sequence[int]) -> Model:
    """The models of single outputs, of structures of one kind, as one model.

    Args:
        inputs: of the whole; those that are `moving` are those of the single models. Plants in s have all.
    """
    processes = [(c.orders, c.theta) for c in taken if c.orders.physical is True]
    if processes:
        shapes, thetas = zip(*processes, strict=True)
        return process_models(shapes, thetas, np.eye(len(shapes)))
    single = rows([c.orders.model().at(c.theta) for c in taken if c.orders.physical is False])
    return embedded(single, inputs, moving)


def rows(models: Sequence[PolynomialModel]) -> PolynomialModel:
    """Models of one output each, of the same inputs, as one model."""
    return PolynomialModel(
        tuple(model.B[0] for model in models),
        tuple(model.A[0] for model in models),
        tuple(model.F[0] for model in models),
        tuple(model.C[0] for model in models),
        tuple(model.D[0] for model in models),
        np.diag([float(model.covariance[0, 0]) for model in models]),
    )


def embedded(model: PolynomialModel, inputs: int, moving: Sequence[int]) -> PolynomialModel:
    """The same model among `inputs` inputs, of which those that are not `moving` have no effect."""
    if len(moving) == inputs:
        return model
    B = [[np.zeros(1)] * inputs for _ in range(model.outputs)]
    F = [[np.ones(1)] * inputs for _ in range(model.outputs)]
    delays = [[1] * inputs for _ in range(model.outputs)]  # of what is absent, the length of B
    for i in range(model.outputs):
        for k, j in enumerate(moving):
            B[i][j], F[i][j], delays[i][j] = model.B[i][k], model.F[i][k], model.first[i][k]
    return replace(model, B=tuple(map(tuple, B)), F=tuple(map(tuple, F)), delays=tuple(map(tuple, delays)))
