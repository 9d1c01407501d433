"""All outputs: the structure of each found by itself, then one model of all of them on the whole record."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.explore.busiest import busiest
from inputdesign_cli.explore.candidates import Candidate, Chosen, Ranges
from inputdesign_cli.explore.division import Division, Split, divided, known_before
from inputdesign_cli.explore.fits import (
    NOT_COMPUTED,
    Fits,
    Parts,
    beside,
    fits,
    is_steady,
    output_error_form,
    percent,
)
from inputdesign_cli.explore.integrated import integrating
from inputdesign_cli.explore.moving import moving_in
from inputdesign_cli.explore.orders import NOISE_ORDERS
from inputdesign_cli.explore.search import explore_structure
from inputdesign_cli.explore.together import joined
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.estimate import Estimate
from inputdesign_cli.identification.estimators import identify
from inputdesign_cli.plant import Model

_MOST_SAMPLES = 20_000
_TOO_SIMPLE = "the input moves too little or too simply: apply steps of several lengths, or a PRBS"
# Structures of the kind of the first output's best (in s or in q^-1), then of the other.
_KINDS = (True, False)
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
        helped: (p,), per cent by which what inputs do makes the prediction errors of that part smaller.
        split: which part estimates and which judges; of none the whole record does both.
        still: inputs (from zero) that never move.
        wanders: (p,), the outputs whose noise integrates.
        slopes: (p,), of the lines that were taken away from the outputs, a sample; None: of none.
        rival: where noise integrates, a model with noise about a level that is somewhat likelier.
    """

    outputs: tuple[Chosen, ...]
    taken: tuple[Candidate, ...]
    ranges: tuple[Ranges, ...]
    model: Model
    estimate: Estimate
    used: Parts
    samples: NDArray[np.int64]
    validation: Fits
    helped: tuple[float, ...]
    split: Split
    still: tuple[int, ...]
    wanders: tuple[bool, ...]
    slopes: Array | None = None
    rival: Model | None = None

    @property
    def moving(self) -> list[int]:
        """The other inputs."""
        return [j for j in range(self.model.inputs) if j not in self.still]

    @property
    def steady(self) -> bool:
        """Whether the plant is stable, as far as the record tells."""
        return is_steady(self.model, sum(len(y) for _, y in self.used))


def explored(
    parts: Parts, *, feedback: bool, step: float, ramp: bool, wanders: Sequence[bool] | None = None
) -> Found:
    """The model that records u (n, r), y (n, p) speak for, samples `step` apart.

    Args:
        feedback: whether u(t) may answer y(t).
        ramp: whether a line of each output is estimated along, in every record, from the whole of it.
        wanders: (p,), the outputs whose noise integrates; None: of none.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output` or `no-structure`.
    """
    still, moved = moving_in(parts)
    moving = [j for j in range(parts[0][0].shape[1]) if j not in still]
    division = divided(moved)
    walks = (False,) * parts[0][1].shape[1] if wanders is None else tuple(wanders)
    found = _structures(division, feedback, step, walks, physical=not still)
    used = busiest(moved, _MOST_SAMPLES)
    taken, estimate, model = _estimated(found, used, feedback, ramp, walks)
    late = max(max(candidate.orders.delays) for candidate in taken)
    before = known_before(division.second, division.before, late)
    own = [(_output(division.second, i), _output(before, i)) for i in range(len(taken))]
    judged = [fits(c.model, second, before=past) for c, (second, past) in zip(taken, own, strict=True)]
    idle = [
        fits(c.model, _without_inputs(second), before=_without_inputs(past))
        for c, (second, past) in zip(taken, own, strict=True)
    ]
    whole = integrating(joined(taken, parts[0][0].shape[1], moving), walks)
    whole = whole.at(model.theta, model.covariance)
    return Found(
        tuple(found),
        taken,
        tuple(chosen.ranges(own) for chosen, own in zip(found, taken, strict=True)),
        whole,
        replace(estimate, names=whole.names),
        busiest(parts, _MOST_SAMPLES),
        _busiest_samples(moved),
        beside(judged),
        tuple(percent(own.errors, none.errors)[0] for own, none in zip(judged, idle, strict=True)),
        division.split,
        still,
        walks,
    )


def _structures(
    division: Division, feedback: bool, step: float, wanders: Sequence[bool], *, physical: bool
) -> list[Chosen]:
    """What is found for each output.

    Raises:
        SpecError: `no-structure`.
    """
    found, outputs = [], division.first[0][1].shape[1]
    for i in range(outputs):
        chosen = explore_structure(
            _output(division.first, i),
            _output(division.second, i),
            feedback=feedback,
            step=step,
            physical=physical,
            wanders=wanders[i],
            before=_output(division.before, i),
        )
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


def _output(parts: Parts, output: int) -> list[tuple[Array, Array]]:
    return [(u, y[:, output : output + 1]) for u, y in parts]


def _without_inputs(parts: Parts) -> list[tuple[Array, Array]]:
    return [(0.0 * u, y) for u, y in parts]


def _busiest_samples(parts: Parts) -> NDArray[np.int64]:
    lengths = [len(y) for _, y in parts]
    every = np.split(np.arange(sum(lengths), dtype=float)[:, None], np.cumsum(lengths)[:-1])
    counted = [(u, at) for (u, _), at in zip(parts, every, strict=True)]
    return np.concatenate([at[:, 0] for _, at in busiest(counted, _MOST_SAMPLES)]).astype(np.int64)


_Together = tuple[tuple[Candidate, ...], Estimate, Model]
"""Structures of all outputs, and what the whole record makes of them."""


def _estimated(
    found: Sequence[Chosen], used: Parts, feedback: bool, ramp: bool, wanders: Sequence[bool]
) -> _Together:
    """The best structures on the whole record; simpler ones where these cannot be estimated there.

    Where all of them stand on the limit of stability, the first that is stable: it is like an integrator.
    """
    samples = sum(len(y) for _, y in used)
    reason: SpecError | None = None
    steady, edge = list[_Together](), list[_Together]()
    # Prediction errors need no unseen data to judge: the whole record tells more than its first part.
    enough = len(_KINDS) if any(wanders) else 1
    for taken in _combinations(found):
        try:
            made = _together(taken, used, feedback, ramp, wanders)
        except SpecError as error:
            reason = error
            continue
        except NOT_COMPUTED:
            continue
        if is_steady(made[2], samples):
            steady.append(made)
            if len(steady) == enough:
                break
        elif output_error_form(made[2]).radius < 1.0:
            edge.append(made)
    if steady:
        best = min(steady, key=lambda made: criterion(*made[:2]))
        return best if feedback or any(wanders) else _with_noise(found, best, used, ramp)
    if edge:
        return edge[0]
    raise reason or bad_spec(
        "no-structure",
        "no stable model explains the record",
        hint="record it in a loop, or remove the drift: --detrend linear",
        key="y",
    )


def _with_noise(found: Sequence[Chosen], made: _Together, used: Parts, ramp: bool) -> _Together:
    """The same plants with filtered noise where the whole record refuses the noise, and that is likelier.

    A part of the record may be too short to tell the colour of the noise.
    """
    taken, estimate, model = made
    refused = {test.output for test in estimate.failed if test.fault == "noise"}
    tried = [made]
    for order in range(len(NOISE_ORDERS)):
        filtered = tuple(
            chosen.with_filtered_noise(own, order) if i in refused else own
            for i, (chosen, own) in enumerate(zip(found, taken, strict=True))
        )
        if all(one is own for one, own in zip(filtered, taken, strict=True)):
            continue
        try:
            other = _together(filtered, used, False, ramp, (False,) * model.outputs)
        except NOT_COMPUTED:
            continue
        if other[1].converged and is_steady(other[2], len(estimate.errors)):
            tried.append(other)
    return min(tried, key=lambda one: criterion(*one[:2]))


def _together(
    taken: tuple[Candidate, ...], used: Parts, feedback: bool, ramp: bool, wanders: Sequence[bool]
) -> _Together:
    inputs, begun = used[0][0].shape[1], taken
    if len(taken) > 1:
        # Where one output has several minima, a search for all of them seldom leaves a wrong one.
        begun = tuple(_alone(own, used, i, feedback, ramp) for i, own in enumerate(taken))
    structure = integrating(joined(begun, inputs, range(inputs)), wanders)
    near = len(taken) > 1 or _near(taken[0], inputs)
    estimate = _identified(structure, used, feedback, structure.theta, near=near, ramp=ramp)
    return taken, estimate, structure.at(estimate.theta, estimate.noise)


def criterion(taken: Sequence[Candidate], estimate: Estimate, *, lines: int = 0) -> float:
    """BIC of an estimate from the whole record, delays counted, and so many lines besides."""
    samples, _ = estimate.errors.shape
    unknowns = sum(candidate.unknowns for candidate in taken) + lines
    return float(samples * np.linalg.slogdet(estimate.noise)[1] + unknowns * np.log(samples))


def _alone(candidate: Candidate, used: Parts, output: int, feedback: bool, ramp: bool) -> Candidate:
    """The structure of one output, estimated from the whole record without the others.

    Raises:
        ArithmeticError: a dead time has run off.
    """
    own = _output(used, output)
    near = _near(candidate, used[0][0].shape[1])
    estimate = _identified(candidate.model, own, feedback, candidate.theta, near=near, ramp=ramp)
    return candidate.estimated(estimate.theta, estimate.noise)


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
    last the simplest; none of them twice.
    """
    tried = set[tuple[int, ...]]()
    for taken in _in_order(found):
        which = tuple(map(id, taken))
        if which not in tried:
            tried.add(which)
            yield taken


def _in_order(found: Sequence[Chosen]) -> Iterator[tuple[Candidate, ...]]:
    first = found[0].best.orders.physical
    for choices in ([chosen.best_of(physical=kind == first) for chosen in found] for kind in _KINDS):
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
