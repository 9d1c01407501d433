"""Models with one parameter more than the one that was estimated: what a directed test holds against it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from inputdesign_cli.arrays import Array, Rows
from inputdesign_cli.identification.directed import Alternative
from inputdesign_cli.identification.gauss_newton import minimise
from inputdesign_cli.identification.noise_first import late_echo
from inputdesign_cli.identification.record_problem import RecordProblem, evaluate
from inputdesign_cli.identification.records import Record, Records
from inputdesign_cli.identification.white import Echo
from inputdesign_cli.plant import ContinuousModel, Model, PolynomialModel
from inputdesign_cli.plant.model import DELAY, Listed

_LAGS = ("a", "f", DELAY)


@dataclass(frozen=True)
class Extension:
    """An additional parameter, to be tested against records.

    Attributes:
        model: the larger model, whose new parameter is zero. If the model has other parameters than its
            coefficients, this is the model of the coefficients.
        name: of the new parameter; `what` it is.
        record: makes the record of samples u (N, r), y (N, p) that the larger structure is to explain.
        nested: whether that structure has no further freedom than the one parameter.
        through: made for the lengths of records, what past errors (N, p) add to the gradient; None if
            they add nothing.
    """

    model: Listed
    name: str
    what: str
    record: Callable[[Array, Array], Record]
    nested: bool = True
    through: Callable[[Sequence[int]], Echo | None] | None = None

    @property
    def index(self) -> int:
        """Return where the new parameter stands in theta of the larger model."""
        return self.model.names.index(self.name)

    def against(self, records: Records) -> Alternative:
        """Return the parameter as a regressor of the prediction errors of records."""
        parts = tuple(self.record(part.u, part.y) for part in records.parts)
        larger = Records(parts, weights=records.weights, ramp=records.ramp)
        larger = larger.begun_freely(records.late) if records.free else larger
        return Alternative(
            self.name,
            f"one more {self.what} ({self.name})",
            "plant" if self.model.in_plant[self.index] else "noise",
            larger.gradient(self.model.theta, self.index),
            lambda model, w: self.model.plant_gradient(w)[None, :, self.index],
            lag=self.model.parameters[self.index].letter in _LAGS,
            echo=None if self.through is None else self.through(records.lengths),
            estimated=partial(self._estimated, larger) if self.nested and records.earlier is None else None,
        )

    def _estimated(self, records: Records) -> tuple[Model, float]:
        """Return the larger model that a search from here finds, and -2 log of the likelihood ratio.

        Both costs are with the unknown starts of the larger structure; that without the parameter is by one
        step of Gauss and Newton from here.
        """
        theta = self.model.theta
        found = minimise(RecordProblem((records,)), theta[None])
        point, others = evaluate(records, theta), np.arange(theta.size) != self.index
        slope, hessian = point.slope[others], point.hessian[np.ix_(others, others)]
        cost = point.cost - float(slope @ np.linalg.lstsq(hessian, slope, rcond=1e-12)[0])
        less = float(found.cost[0])
        known = records.weights is not None
        ratio = cost - less if known else float(point.near.freedom * np.log(cost / max(less, 1e-300)))
        return self.model.at(found.theta[0]), ratio


def echo_of(larger: PolynomialModel, name: str, lengths: Sequence[int]) -> Echo | None:
    """What past errors add to the gradient of a coefficient of A, C or D; None for others.

    epsilon = (D/C)(A y - ..): -d epsilon / d theta is epsilon(t - k) through 1/C for a c_k, through -1/D for
    a d_k and, by the noise in y, through -1/A for an a_k. Where that grows nothing is known of it: what holds
    the plant is not 1/A.
    """
    rows = {"a": (larger.A, -1.0), "c": (larger.C, 1.0), "d": (larger.D, -1.0)}
    parameter = next(one for one in larger.parameters if one.name == name)
    if parameter.letter not in rows:
        return None
    polynomials, sign = rows[parameter.letter]
    outputs = {output for output, _ in parameter.places}
    below = {i: (polynomials[0 if len(polynomials) == 1 else i], sign) for i in outputs}
    if any(np.any(np.abs(np.roots(polynomial)) >= 1.0) for polynomial, _ in below.values()):
        return None
    return late_echo(below, parameter.power, lengths)


def new_name(larger: Model, model: Model) -> str:
    """Return the name of the one parameter that only the larger model has."""
    (name,) = set(larger.names) - set(model.names)
    return name


def larger_polynomials(model: PolynomialModel, *, feedback: bool) -> Iterator[tuple[PolynomialModel, str]]:
    """Yield models with a further coefficient in B, F (or A), C or D, or a shorter delay, and its name.

    Args:
        feedback: whether u(t) depends on y(t), so that it cannot act at once.
    """
    for i, j in model.active:
        B, F = model.B[i][j], model.F[i][j]
        yield replace(model, B=_with(model.B, i, j, np.append(B, 0.0))), "coefficient in B"
        if model.A[0 if len(model.A) == 1 else i].size == 1 or F.size > 1:
            yield replace(model, F=_with(model.F, i, j, np.append(F, 0.0))), "pole in F"
        if model.first[i][j] > int(feedback):
            earlier = tuple(
                tuple(first - ((o, n) == (i, j)) for n, first in enumerate(row))
                for o, row in enumerate(model.first)
            )
            yield replace(model, delays=earlier), "coefficient in B before the others"
    for i, A in enumerate(model.A):
        if A.size > 1:
            yield replace(model, A=_longer(model.A, i)), "pole in A"
    for i in range(len(model.C)):
        yield replace(model, C=_longer(model.C, i)), "coefficient in C"
    for i in range(len(model.D)):
        yield replace(model, D=_longer(model.D, i)), "coefficient in D"


def larger_transfer_matrices(
    model: ContinuousModel, *, feedback: bool
) -> Iterator[tuple[ContinuousModel, str]]:
    """Yield models with a zero more in a proper entry, or a dead time if it has none, and its name.

    Args:
        feedback: whether u(t) depends on y(t), so that it cannot act at once.
    """
    none = tuple((np.zeros(0),) * model.inputs for _ in range(model.outputs))
    model = replace(model, delay=model.delay or none)
    for i, j in model.active:
        above = model.numerator[i][j]
        if above.size + int(feedback) < model.denominator[i][j].size:
            more = _with(model.numerator, i, j, np.append(above, 0.0))
            yield replace(model, numerator=more), "coefficient in the numerator"
        shared = model.active if model.common_delay else [(i, j)]
        if not any(model.delay[o][n].size for o, n in shared):
            yield replace(model, delay=_with(model.delay, i, j, np.zeros(1))), "dead time or fast pole"


def _with(rows: Rows, i: int, j: int, entry: Array) -> Rows:
    """Return the table with another entry."""
    return tuple(
        tuple(entry if (o, n) == (i, j) else p for n, p in enumerate(row)) for o, row in enumerate(rows)
    )


def _longer(rows: tuple[Array, ...], i: int) -> tuple[Array, ...]:
    return tuple(np.append(p, 0.0) if o == i else p for o, p in enumerate(rows))
