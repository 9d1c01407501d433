"""What is to be estimated of a polynomial model: one row an output, and which parameters the rows share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.orders import InputOrders, OutputOrders
from inputdesign_cli.identification.problem import PredictionErrors
from inputdesign_cli.plant import PolynomialModel


@dataclass(frozen=True)
class Structure:
    """Orders of A_i y_i = sum_j (B_ij / F_ij) u_j + (C_i / D_i) e_i.

    Attributes:
        names: (k,) parameters, in the order of `PolynomialModel`.
        in_plant, in_noise: numbers of parameters of B and F, and of A, C and D.
        rows: one an output; `places` of each row, where its parameters stand in theta.
    """

    names: tuple[str, ...]
    in_plant: int
    in_noise: int
    rows: tuple[OutputOrders, ...]
    places: tuple[NDArray[np.int64], ...]

    @classmethod
    def of(cls, model: PolynomialModel) -> Structure:
        """The structure of a model: its orders and delays, its zero entries, and what outputs share."""
        where = {
            (parameter.letter, parameter.power, place): index
            for index, parameter in enumerate(model.parameters)
            for place in parameter.places
        }
        rows, places = [], []
        for i in range(model.outputs):
            entries = tuple(
                InputOrders(j, B.size - 1, F.size - 1, model.first[i][j])
                for j, (B, F) in enumerate(zip(model.B[i], model.F[i], strict=True))
                if (i, j) in model.active
            )
            a, c, d = (rows_[0 if len(rows_) == 1 else i].size - 1 for rows_ in (model.A, model.C, model.D))
            row = OutputOrders(a, c, d, entries)
            rows.append(row)
            place = [
                where[block.letter, lag, _place(block.letter, i, entries, block.entry)]
                for block in row.blocks
                for lag in block.lags
            ]
            places.append(np.array(place, dtype=np.int64))
        letters = [parameter.letter for parameter in model.parameters]
        in_plant = sum(letter in "bf" for letter in letters)
        return cls(model.names, in_plant, len(letters) - in_plant, tuple(rows), tuple(places))

    @property
    def size(self) -> int:
        """Return the number of parameters k."""
        return len(self.names)

    @property
    def memory(self) -> int:
        """Return how far back the regressions look, recursions aside."""
        return max(row.memory for row in self.rows)

    def own(self) -> Array:
        """Return the number of parameters of each output (p,); one that n outputs share counts as 1/n."""
        shared = np.bincount(np.concatenate(self.places), minlength=self.size)
        return np.array([float(np.sum(1.0 / shared[place])) for place in self.places])

    def problem(self, u: Array, y: Array, noise: Array | None = None) -> PredictionErrors:
        """Return the problem of fitting records u (runs, samples, r) and y (runs, samples, p).

        Args:
            noise: the covariance of e (p, p) if it is known.
        """
        weights = None if noise is None else np.asarray(np.linalg.inv(noise), dtype=float)
        return PredictionErrors(self.rows, self.places, _signals(u), _signals(y), weights)


def _signals(x: Array) -> tuple[Array, ...]:
    """(runs, samples, channels) as a signal (samples, runs) of each channel."""
    return tuple(np.ascontiguousarray(np.moveaxis(x, -1, 0).swapaxes(1, 2)))


def _place(letter: str, output: int, entries: tuple[InputOrders, ...], entry: int) -> tuple[int, int]:
    """Output and input where a parameter acts, as `Parameter.places` have them."""
    if letter in "bf":
        return output, entries[entry].input
    return (output, 0) if letter == "a" else (output, output)
