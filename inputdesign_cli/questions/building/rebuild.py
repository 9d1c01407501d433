"""Build a question again at an estimate, from the sections of its spec."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.plant import Model
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.uncertainty import SOURCES

Built = TypeVar("Built")
# Keys that say how well the plant is known before any data.
_PRIOR = {*SOURCES, "parameters"}


@dataclass(frozen=True)
class Change:
    """Describes how the design of a part differs from the design of the whole experiment.

    The part has its own `samples` and `seed`. `information` (k, k) is that of the data so far, in raw
    parameters; None: the prior of the spec. `uncertainty` selects the plants that the design must suffice
    for: the estimate alone, as stated, or all that the data do not rule out. A `white` spectrum is flat. If
    another part follows (`goes_on`), the record has the power of the design and is not scaled to meet the
    accuracy. `best` seeks the most accurate experiment where none within the limits suffices.
    """

    samples: int
    seed: int
    information: Array | None = None
    uncertainty: Literal["none", "stated", "data"] = "none"
    white: bool = False
    goes_on: bool = False
    best: bool = False


@dataclass(frozen=True)
class Rebuild(Generic[Built]):
    """Builds an object of a question again from its `sections`, at another model and with a change."""

    sections: Spec
    build: Callable[[Spec], Built]

    def at(self, model: Model | None, change: Change | None = None) -> Built:
        """Return the object at a model, or the plant of the spec; `IdesignError` if it cannot be built."""
        values: dict[str, object] = {} if model is None else {**blocks_of(model)}
        if change is not None:
            values |= self._changed(change, model)
        return self.build(self.sections.revised(values, file="plan", design=change is not None))

    def _changed(self, change: Change, model: Model | None) -> Iterator[tuple[str, object]]:
        stated, signal = self.sections.uncertainty, self.sections.signal
        yield from (("campaign", None), ("simulation", None), ("solver.any_spectrum", False))
        yield from (("experiment.samples", change.samples), ("signal.samples", None))
        yield "signal.least_move", None  # the part keeps it, not the design
        yield "signal.seed", change.seed
        if self.sections.experiment.duration is not None:
            yield "experiment.duration", None
        if change.goes_on and signal.scale is None and signal.amplitudes is None:
            yield "signal.scale", "design"
        if change.white:
            yield "spectrum", {"type": "white"}
        if change.best:
            yield "objective", "best_accuracy"
        known: dict[str, object] = {}
        if model is not None and change.information is not None:
            known = {"parameters": model.names, "information": change.information}
            yield "experiment.prior", known
        if change.uncertainty == "data":
            own = {} if stated is None else stated.model_dump(mode="json", exclude_unset=True, exclude=_PRIOR)
            yield "uncertainty", {**own, **known}
        elif change.uncertainty == "none":
            yield "uncertainty", None
