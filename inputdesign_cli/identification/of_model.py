"""What structures and records share, whatever the kind of model: see `Kind` and `Record`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.records import Record, split
from inputdesign_cli.identification.search import Search
from inputdesign_cli.identification.white import Echoes
from inputdesign_cli.plant import Model


@dataclass(frozen=True)
class OfModel:
    """The structure of `model`; its numbers mean nothing."""

    model: Model

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names (k,) of the parameters."""
        return self.model.names

    @property
    def outputs(self) -> int:
        """Return the number of outputs p."""
        return self.model.outputs

    @property
    def continuous(self) -> bool:
        """Return whether frequencies of the model are in rad per time unit."""
        return self.model.continuous

    @property
    def recent(self) -> int:
        """Return lag 0: inputs of all other lags act through poles."""
        return 0

    def holding(self, known: NDArray[np.bool_]) -> Self:
        """Return the kind unchanged."""
        return self

    def echoes(self, theta: Array, lengths: Sequence[int]) -> Echoes | None:
        """Return no echoes: the noise is white, and gradients are of inputs alone."""
        return ()

    def caused(self, found: Search, y: Array, lengths: Sequence[int] | None) -> Array:
        """Return the response (N, p) to the inputs, and the part that unknown starts explain."""
        fitted = self.model.at(found.point.theta)
        records, begun = found.records, found.point.near.begun
        with np.errstate(over="ignore", invalid="ignore"):  # outputs of an unstable plant are not shown
            caused = [sum(fitted.simulate(*part, 1.0)) for part in split(records.u, begun, lengths)]
        return np.concatenate(caused) + y - records.y


@dataclass(frozen=True)
class OverRecord:
    """The samples of another `record`, against other parameters."""

    record: Record

    @property
    def u(self) -> Array:
        """(N, r)."""
        return self.record.u

    @property
    def y(self) -> Array:
        """(N, p)."""
        return self.record.y

    @property
    def dead_times(self) -> NDArray[np.int64]:
        """Return the dead times of the inner record, whose parameters come first."""
        return self.record.dead_times

    def crossings(self, theta: Array) -> Array:
        """Return the crossings of the inner record, with zeros for further parameters."""
        own = self.record.crossings(theta[: self.record.size])
        return np.pad(own, ((0, 0), (0, 0), (0, theta.size - self.record.size)))

    def remembering(self, late: int) -> Self:
        """Return the record with free responses of its inner record, which last `late` samples."""
        return replace(self, record=self.record.remembering(late))
