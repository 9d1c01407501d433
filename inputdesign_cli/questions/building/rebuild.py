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


def restated(spec: Spec, model: Model, source: str) -> Spec:
    """Return the spec with a model in place of its nominal plant and noise; no design need be asked for.

    Args:
        source: what diagnostics about the model name as its file.

    Raises:
        SpecError: the spec does not go with this model.
    """
    return spec.revised(blocks_of(model), file=source, design=False)


@dataclass(frozen=True)
class Change:
    """Describes how the design of a part differs from the design of the whole experiment.

    Attributes:
        samples: of the experiment that is planned; `seed`: of its record.
        information: (k, k) of the data so far, raw parameters; None: as the spec states it.
        uncertainty: the plants that the design must suffice for: the estimate alone, the plants of the spec,
            or all plants that the data leave open.
        white: whether the spectrum is flat.
        goes_on: whether another part follows, in which effects of this one remain. Its record has the power
            of the design then, and does not make up for its own end.
        best: whether limits leave no experiment that suffices, so that the best one within them is sought.
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
    """Builds an object of a question again, at another model and with a change.

    Attributes:
        sections: of the spec; nothing else may read them after building.
        build: makes the object.
    """

    sections: Spec
    build: Callable[[Spec], Built]

    def at(self, model: Model | None, change: Change | None = None) -> Built:
        """Return the object at a model; None is the plant of the spec.

        Raises `IdesignError`: it cannot be built of this model.
        """
        values: dict[str, object] = {} if model is None else {**blocks_of(model)}
        if change is not None:
            values |= self._changed(change, model)
        return self.build(self.sections.revised(values, file="plan", design=change is not None))

    def _changed(self, change: Change, model: Model | None) -> Iterator[tuple[str, object]]:
        stated, signal = self.sections.uncertainty, self.sections.signal
        yield from (("campaign", None), ("simulation", None), ("solver.any_spectrum", False))
        yield from (("experiment.samples", change.samples), ("signal.samples", None))
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
