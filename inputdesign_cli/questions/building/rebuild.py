"""Build a question again at an estimate: the one object that keeps the sections of a spec after building."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

from inputdesign_cli.arrays import Array
from inputdesign_cli.plant import Model
from inputdesign_cli.specification import Spec, parse_spec
from inputdesign_cli.specification.models.uncertainty import SOURCES

Built = TypeVar("Built")
_SOURCE = "plan"
# Keys that say how well the plant is known before any data.
_PRIOR = {*SOURCES, "parameters"}


@dataclass(frozen=True)
class Change:
    """How the design of a part differs from the design of the whole experiment.

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
        words: returns `plant` and `noise` of a model.
    """

    sections: Spec
    build: Callable[[Spec], Built]
    words: Callable[[Model], Mapping[str, object]]

    def at(self, model: Model | None, change: Change | None = None) -> Built:
        """Return the object at a model; None is the plant of the spec.

        Raises:
            IdesignError: it cannot be built of this model.
        """
        values = {} if model is None else dict(self.words(model))
        if change is not None:
            values |= self._changed(change, model)
        spec = parse_spec(
            self.sections.to_yaml(),
            file=_SOURCE,
            overrides=[f"{key}={json.dumps(value)}" for key, value in values.items()],
            folder=self.sections.resolve_path("."),
            design=change is not None,
        )
        return self.build(spec)

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
            known = {"parameters": list(model.names), "information": change.information.tolist()}
            yield "experiment.prior", known
        if change.uncertainty == "data":
            own = {} if stated is None else stated.model_dump(mode="json", exclude_unset=True, exclude=_PRIOR)
            yield "uncertainty", {**own, **known}
        elif change.uncertainty == "none":
            yield "uncertainty", None
