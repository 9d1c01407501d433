"""Find the structure of each output alone, then estimate one model of all outputs from the whole record."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import Counted, report_progress
from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.explore.division import busiest, cut, divided
from inputdesign_cli.explore.drift import levelled, slopes_of
from inputdesign_cli.explore.fits import NOT_COMPUTED, Fits, Parts, fits, is_steady, output_error_form
from inputdesign_cli.explore.relation import moving_in
from inputdesign_cli.explore.search import Candidate, Chosen, Family, certain, explore_structure
from inputdesign_cli.explore.structures import process_models
from inputdesign_cli.explore.sweep import lingering
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.estimators import Estimate, identify
from inputdesign_cli.plant import Model, PolynomialModel

_MOST_SAMPLES = 10_000  # samples that give the estimate
# Structures of each output that are tried if the first cannot be estimated from the whole record.
_MOST_TRIED = 3
# Lines are estimated together with the model up to this number of records; beyond it they count as known.
_MOST_LINES = 3


@dataclass(frozen=True)
class Found:
    """Holds the model that a record supports.

    Attributes:
        outputs: the result for each; `taken` is the candidate that the model is made of.
        model: a model of all channels, from the whole record; inputs that never move have no effect in it.
        estimate: its estimate; `used` are the records that it was made from, and `samples` (n,) their
            positions in all records.
        validation: the fits of the same structures, estimated on one part, to the other.
        split: the part that estimates and the part that judges; without one the whole record does both.
        still: inputs (from zero) that never move.
        slopes: (p,), slope per sample of the line through all records that was removed from each output.
    """

    outputs: tuple[Chosen, ...]
    taken: tuple[Candidate, ...]
    model: Model
    estimate: Estimate
    used: Parts
    samples: NDArray[np.int64]
    validation: Fits
    split: str
    still: tuple[int, ...]
    slopes: Array

    @property
    def moving(self) -> list[int]:
        """Return the inputs (from zero) that move."""
        return [j for j in range(self.model.inputs) if j not in self.still]

    @property
    def steady(self) -> bool:
        """Return whether the plant is stable, as far as the record shows, or integrates by its structure."""
        return _steady(self.taken, self.model, self.used)

    @property
    def integrates(self) -> tuple[int, ...]:
        """Return the outputs (from zero) whose plant was taken for an integrator."""
        return tuple(i for i, taken in enumerate(self.taken) if taken.orders.integrates)

    @property
    def wanders(self) -> tuple[bool, ...]:
        """Return for each output whether its noise does not fade within the record, as if it integrated."""
        longest = max(len(y) for _, y in self.used)
        named = dict(zip(self.model.names, self.model.theta.tolist(), strict=True))
        suffixes = [f"[{i + 1}]" for i in range(self.model.outputs)] if self.model.outputs > 1 else [""]
        poles = [[1.0, *(named.get(f"d{k}{suffix}", 0.0) for k in range(1, 9))] for suffix in suffixes]
        return tuple(lingering(np.array(D), longest) > 0 for D in poles)


def _steady(taken: Sequence[Candidate], model: Model, used: Parts) -> bool:
    return is_steady(model, sum(len(y) for _, y in used)) or any(c.orders.integrates for c in taken)


def explore_records(
    parts: Parts, *, feedback: bool = False, step: float = 1.0, ramp: bool = False, only: Family | None = None
) -> Found:
    """Return the model that records u (n, r), y (n, p) support, samples `step` apart.

    Args:
        feedback: whether u(t) may depend on y(t).
        ramp: whether the outputs are known to drift along lines.
        only: the only family of structures to try; None: all.

    Raises:
        SpecError: `too-few-samples`, `constant-input`, `constant-output` or `no-structure`.
    """
    still, moved = moving_in(parts)
    moving = [j for j in range(parts[0][0].shape[1]) if j not in still]
    slopes = slopes_of(moved, known=ramp)
    parts, moved = levelled(parts, slopes), levelled(moved, slopes)
    lines = (ramp or bool(np.any(slopes))) and len(parts) <= _MOST_LINES
    first, second, split = divided(moved)
    found = list[Chosen]()
    for i in range(slopes.size):
        sides = _output(first, i), _output(second, i)
        chosen = explore_structure(*sides, feedback=feedback, step=step, physical=not still, only=only)
        if chosen is None:
            name = signal_name("y", i, slopes.size)
            raise bad_spec(
                "no-structure",
                f"no model of {name} could be estimated: the record does not determine its parameters",
                hint="the input moves too little or too simply: apply steps of several lengths, or a PRBS",
                key=name,
            )
        found.append(chosen)
    at = busiest(moved, _MOST_SAMPLES)
    begins = np.cumsum([0, *(len(y) for _, y in parts)])[:-1].tolist()
    taken, estimate, model = _estimated(found, cut(moved, at), feedback, lines)
    of_first = joined(taken, len(moving), range(len(moving)))
    whole = joined(taken, len(moving) + len(still), moving).at(model.theta, model.covariance)
    return Found(
        tuple(found),
        taken,
        whole,
        replace(estimate, names=whole.names),
        cut(parts, at),
        np.concatenate([np.arange(b + k.start, b + k.stop) for b, k in zip(begins, at, strict=True)]),
        fits(of_first, second),
        split,
        still,
        slopes,
    )


def _output(parts: Parts, output: int) -> list[tuple[Array, Array]]:
    return [(u, y[:, output : output + 1]) for u, y in parts]


def _estimated(
    found: Sequence[Chosen], used: Parts, feedback: bool, ramp: bool
) -> tuple[tuple[Candidate, ...], Estimate, Model]:
    """Return the best structures with a certain and steady estimate from the whole record, and the estimate.

    Without one, the first steady ones are taken, otherwise the first stable ones: they are like integrators.
    """
    reason = bad_spec(
        "no-structure",
        "no stable model explains the record",
        hint="remove a drift (--detrend linear); or is it an integrator: --structure integrator; of an "
        "unstable plant a spec states A and the controller: idesign identify DATA --spec SPEC",
        key="y",
    )
    made = list[tuple[bool, tuple[Candidate, ...], Estimate, Model]]()
    for taken in _combinations(found):
        if made and not all(c in one.good for c, one in zip(taken, found, strict=True)):
            continue
        names = " and ".join(dict.fromkeys(c.orders.family for c in taken))
        report_progress(Counted(f"models of the whole record, now {names}", len(made), len(made) + 1))
        try:
            estimate, model = _together(taken, used, feedback, ramp)
        except SpecError as error:
            reason = error
            continue
        except NOT_COMPUTED:
            continue
        except KeyboardInterrupt:
            if not made:
                raise
            break
        steady = _steady(taken, model, used)
        made.append((not steady, taken, estimate, model))
        step = max(c.orders.step if c.orders.physical else 0.0 for c in taken)
        plant, deviations = model.in_plant, np.sqrt(np.diag(estimate.covariance))
        if steady and certain(model.theta[plant], deviations[plant], model.dead_times[plant], step):
            return made[-1][1:]
    # A spec cannot describe an unstable plant without its loop.
    stable = [one for one in made if output_error_form(one[3]).radius <= 1.0]
    if not stable:
        raise reason
    return min(stable, key=lambda one: one[0])[1:]


def _together(
    taken: tuple[Candidate, ...], used: Parts, feedback: bool, ramp: bool
) -> tuple[Estimate, Model]:
    """Return the estimate of structures of all outputs, which begins at the parameters that they have."""

    def identified(structure: Model, parts: Parts, *, near: bool) -> tuple[Estimate, Model]:
        u, y = (np.concatenate(signals) for signals in zip(*parts, strict=True))
        lengths, start = [len(part) for _, part in parts], structure.theta
        estimate = identify(
            structure, u, y, start=start, feedback=feedback, lengths=lengths, rest=False, near=near, ramp=ramp
        )
        return estimate, structure.at(estimate.theta, estimate.noise)

    if len(taken) > 1:
        # If an output has several minima, a search for all outputs together seldom leaves a wrong one.
        each = [identified(c.model, _output(used, i), near=not feedback)[1] for i, c in enumerate(taken)]
        taken = tuple(replace(c, model=model) for c, model in zip(taken, each, strict=True))
    inputs = used[0][0].shape[1]
    # In a loop one part of the record seldom determines a dead time.
    return identified(joined(taken, inputs, range(inputs)), used, near=len(taken) > 1 or not feedback)


def _combinations(found: Sequence[Chosen]) -> Iterator[tuple[Candidate, ...]]:
    """Yield structures for all outputs together, all in s or all in q^-1, the best first."""
    first = found[0].best.orders.physical
    for kind in (first, not first):
        every = [[c for c in one.candidates if c.orders.physical == kind] for one in found]
        # A structure that is uncertain on one part is seldom certain on the whole: only the best one may be.
        ranked = [
            own[:1] + [c for c in own[1:] if c.certain and c in one.good][: _MOST_TRIED - 1]
            for own, one in zip(every, found, strict=True)
        ]
        for rank in range(max(map(len, ranked)) if all(ranked) else 0):
            yield tuple(own[min(rank, len(own) - 1)] for own in ranked)


def joined(taken: Sequence[Candidate], inputs: int, moving: Sequence[int]) -> Model:
    """Join models of single outputs, of one kind of structure, into one model with all outputs.

    Polynomial models have the `moving` inputs only; others get no effect. Process models have all inputs.
    """
    processes = [(c.orders, c.model.theta) for c in taken if c.orders.physical is True]
    if processes:
        shapes, thetas = zip(*processes, strict=True)
        return process_models(shapes, thetas, np.eye(len(shapes)))
    models = [c.orders.model().at(c.model.theta) for c in taken if c.orders.physical is False]
    at = {j: k for k, j in enumerate(moving)}

    def spread(entries: Sequence[Array], absent: float) -> tuple[Array, ...]:
        return tuple(entries[at[j]] if j in at else np.full(1, absent) for j in range(inputs))

    return PolynomialModel(
        tuple(spread(model.B[0], 0.0) for model in models),
        tuple(model.A[0] for model in models),
        tuple(spread(model.F[0], 1.0) for model in models),
        tuple(model.C[0] for model in models),
        tuple(model.D[0] for model in models),
        np.eye(len(models)),
        delays=tuple(
            tuple(model.first[0][at[j]] if j in at else 1 for j in range(inputs)) for model in models
        ),
    )
