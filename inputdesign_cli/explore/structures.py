"""Structures of one output: polynomials by their orders, and plants in s behind a hold by gain and lags."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.sweep import Regression
from inputdesign_cli.expressions import Expression
from inputdesign_cli.plant import (
    Coloured,
    ContinuousModel,
    Parametrisation,
    PolynomialModel,
    Reparametrised,
    SampledModel,
    Words,
)
from inputdesign_cli.plant.model import DELAY, Parameter


@dataclass(frozen=True)
class Orders:
    """Orders of A y = sum_j (B_j / F_j) u_j + (C / D) e; B_j has `b` coefficients from lag `delays[j]` on."""

    family: str
    delays: tuple[int, ...]
    b: int
    a: int = 0
    c: int = 0
    d: int = 0
    f: int = 0

    # Whether the parameters have names that mean something: gains, time constants, dead times.
    physical: ClassVar[Literal[False]] = False
    integrates: ClassVar[bool] = False

    @property
    def size(self) -> int:
        """Return the number of parameters."""
        return self.a + self.c + self.d + len(self.delays) * (self.b + self.f)

    @property
    def shared(self) -> bool:
        """Return whether plant and noise share poles."""
        return self.a > 0

    @property
    def order(self) -> int:
        """Return the order of the plant of each input."""
        return self.a + self.f

    @property
    def unknowns(self) -> int:
        """Return the number of coefficients of one input."""
        return self.b + self.order

    @property
    def numbers(self) -> dict[str, int]:
        """Return the orders of the polynomials that the family has."""
        every = {"A": self.a, "B": self.b, "C": self.c, "D": self.d, "F": self.f}
        return {letter: order for letter, order in every.items() if order}

    def start(self, near: Regression) -> Array:
        """Return the start of the search (k,), by a regression; ARMAX begins as an output error."""
        rows = [np.resize(np.append(row, np.zeros(self.b)), self.b) for row in near.B]
        F = np.resize(np.append(near.F, np.zeros(self.order)), self.order + 1)
        A, below = (F, _monic(0)) if self.a else (_monic(0), F)
        C = np.resize(np.append(F if self.a and self.c else _monic(0), np.zeros(self.c)), self.c + 1)
        return self._with(rows, A, below, C, _monic(self.d)).theta

    def model(self) -> PolynomialModel:
        """Return the structure as a model; its numbers have no meaning."""
        ones = [np.ones(self.b)] * len(self.delays)
        return self._with(ones, _monic(self.a), _monic(self.f), _monic(self.c), _monic(self.d))

    def coloured(self, C: Array, D: Array) -> Orders:
        """Return a plant of the same orders with Box and Jenkins's noise."""
        c, d = C.size - 1, D.size - 1
        return self if self.shared else replace(self, family="BJ" if c + d else self.family, c=c, d=d)

    def noisy(self, theta: Array, C: Array, D: Array) -> PolynomialModel:
        """Return the model with these parameters (k,) of the plant, and C and D where it has none."""
        own = self.model().at(theta)
        return own if self.shared else replace(own, C=(C,), D=(D,))

    def _with(self, rows: list[Array], A: Array, F: Array, C: Array, D: Array) -> PolynomialModel:
        B = tuple(np.concatenate([np.zeros(d), row]) for d, row in zip(self.delays, rows, strict=True))
        ends = (F,) * len(B)
        return PolynomialModel((B,), (A,), (ends,), (C,), (D,), np.eye(1), delays=(self.delays,))


def _monic(order: int) -> Array:
    return np.eye(1, order + 1)[0]


_NAMES = {0: "integrator", 1: "FOPDT", 2: "SOPDT"}
_LAGGING = "integrator with a lag"
# Denominators in s by their parameters, in descending powers.
_BELOW = {0: ("1", "0"), 1: ("{T}", "1"), 2: ("{T}**2", "2*{zeta}*{T}", "1")}
# Moduli of poles in z from which a search starts lie between these.
_FASTEST, _SLOWEST = 1e-3, 1.0 - 1e-4
_LEAST = 0.05  # the shortest dead time of a start, in samples
_ZERO = 0.5  # Tz of a start, relative to T
# A dead time this near below a whole number of samples is that number.
_ROUNDED = 0.01
_NORMAL = 1.96  # 95 % of a Gaussian estimate
_LONGEST = 1e6  # the longest delay, in samples


@dataclass(frozen=True)
class Process:
    """A process model of one output: for each input a gain K, a dead time L, and poles by T and zeta.

    Attributes:
        delays: the lag of the first sample that each input moves.
        lags: the number of poles with a time constant, zero to two; zero: K / s.
        rising: whether an integrator follows a first-order lag.
        step: the sample time.
        zero: whether the numerator is K (Tz s + 1).
        noise: the order of C and D, zero for white noise.
    """

    delays: tuple[int, ...]
    lags: int
    step: float
    zero: bool = False
    noise: int = 0
    rising: bool = False

    # Plant and noise have no poles in common, and the parameters have names.
    shared: ClassVar[bool] = False
    physical: ClassVar[Literal[True]] = True

    @property
    def family(self) -> str:
        """Return the usual name: first or second order plus dead time, or integrator."""
        return _LAGGING if self.rising else _NAMES[self.lags]

    @property
    def numbers(self) -> dict[str, int]:
        """Return the numbers of poles and zeros, and the orders of the noise."""
        every = {"poles": self.lags, "zeros": int(self.zero), "C": self.noise, "D": self.noise}
        return {word: number for word, number in every.items() if number}

    @property
    def integrates(self) -> bool:
        """Return whether the structure is an integrator."""
        return self.rising or not self.lags

    @property
    def order(self) -> int:
        """Return the number of poles, also of an integrator behind a lag."""
        return self.lags + self.rising

    @property
    def letters(self) -> tuple[str, ...]:
        """Return the letters of the parameters of an input."""
        return (*("K", "T", "zeta")[: self.lags + 1], *(("Tz",) if self.zero else ()), "L")

    @property
    def size(self) -> int:
        """Return the number of parameters."""
        return len(self.delays) * len(self.letters) + 2 * self.noise

    @property
    def unknowns(self) -> int:
        """Return the number of parameters of one input."""
        return len(self.letters)

    def at(self, theta: Array) -> Process:
        """Return the structure with the delays that the dead times among parameters (k,) have."""
        return replace(self, delays=self._first(self._late(theta)))

    def ranges(self, theta: Array, deviations: Array) -> tuple[tuple[int, int], ...]:
        """Return the 95 % interval of each delay, by parameters and deviations (k,)."""
        late, width = self._late(theta), _NORMAL * self._late(deviations)
        low, high = (self._first(np.maximum(x, 0.0)) for x in (late - width, late + width))
        return tuple(zip(low, high, strict=True))

    def _late(self, theta: Array) -> Array:
        """Return the dead times (r,)."""
        width = len(self.letters)
        return theta[width - 1 : width * len(self.delays) : width]

    def _first(self, late: Array) -> tuple[int, ...]:
        """Return the lag of the first sample that each input moves after its dead time (r,)."""
        return tuple(int(np.floor(min(x, _LONGEST))) + 1 for x in late / self.step + _ROUNDED)

    def model(self) -> Reparametrised:
        """Return the structure as a model; its numbers have no meaning."""
        own = [2.0 if letter == "zeta" else self.step for letter in self.letters] * len(self.delays)
        return process_models([self], [np.concatenate([own, np.zeros(2 * self.noise)])], np.eye(1))

    def coloured(self, C: Array, D: Array) -> Process:
        """Return the same plant with C and D of these orders."""
        return replace(self, noise=C.size - 1)

    def noisy(self, theta: Array, C: Array, D: Array) -> Reparametrised:
        """Return the model with these parameters (k,) of the plant, and with C and D of one order."""
        every = np.concatenate([theta, C[1:], D[1:]])
        return process_models([self.coloured(C, D)], [every], np.eye(1))

    def start(self, near: Regression) -> Array:
        """Return the start of the search (k,), by a regression with as many poles or more."""
        poles = np.roots(near.F)
        size = np.clip(np.abs(poles), _FASTEST, _SLOWEST)
        angle = np.where(poles.real > 0.0, np.angle(poles), 0.0)
        s = np.resize(np.sort_complex(-(np.log(size) + 1j * angle)), max(self.order, 1)) / self.step
        gains = near.B.sum(axis=1) / max(float(np.sum(near.F)), 1e-300)
        if self.integrates:  # the slowest pole is that of the integrator
            s, gains = (s[1:] if self.rising else s), gains * abs(s[0])
        below = self._below(s) if self.lags else []
        found: list[float] = []
        for gain, row, delay in zip(gains, near.B, near.delays, strict=True):
            # A first-order lag that begins between two samples divides its gain between two coefficients.
            shares = self.order == 1 == self.lags and row[0] * row[1] > 0.0
            late = max(delay - 1 + (row[1] / (row[0] + row[1]) if shares else 0.0), _LEAST) * self.step
            found += [float(gain), *below, *([_ZERO * below[0]] if self.zero else []), late]
        return np.array([*found, *np.zeros(2 * self.noise)])

    def _below(self, s: NDArray) -> list[float]:
        """Return T and zeta of poles -s: the two slowest, or a complex pair, make them."""
        if self.lags == 1:
            return [1.0 / max(float(np.abs(s[0])), 1e-300)]
        rings = np.abs(s.imag) >= 1e-9 * np.abs(s)
        pair = s[rings][:2] if np.sum(rings) > 1 else s[:2]
        T = abs(float(np.real(pair[0] * pair[1]))) ** -0.5
        return [T, max(0.5 * float(np.real(pair.sum())) * T, 0.02)]


def process_models(rows: Sequence[Process], thetas: Sequence[Array], covariance: Array) -> Reparametrised:
    """Return structures of one output each, with their parameters (k,), as one model."""
    above, below, late, values = [], [], [], dict[str, float]()
    for i, (row, theta) in enumerate(zip(rows, thetas, strict=True), start=1):
        single = len(rows) == len(row.delays) == 1
        own = [
            {letter: letter if single else f"{letter}_{i}{j}" for letter in row.letters}
            for j in range(1, len(row.delays) + 1)
        ]
        every = [name for names in own for name in names.values()]
        values |= dict(zip(every, theta.tolist(), strict=False))  # C and D follow
        top = ("{K}*{Tz}", "{K}") if row.zero else ("{K}",)
        above.append([[text.format(**names) for text in top] for names in own])
        texts = (*_BELOW[row.lags], *(("0",) if row.rising else ()))
        below.append([[text.format(**names) for text in texts] for names in own])
        late.append([names["L"] for names in own])
    names, at = tuple(values), np.array(list(values.values()))

    def ascending(texts: list[list[list[str]]]) -> tuple[tuple[Array, ...], ...]:
        return tuple(
            tuple(np.array([Expression(text).at(names, at)[0] for text in entry[::-1]]) for entry in row)
            for row in texts
        )

    def term(parameter: Parameter) -> str:
        """Return the expression of a coefficient of the monic matrix."""
        i, j = parameter.places[0]
        if parameter.letter == DELAY:
            return late[i][j]
        entry = (above if parameter.letter == "b" else below)[i][j]
        return f"({entry[-1 - parameter.power]})/({below[i][j][0]})"

    times = tuple(tuple(np.array([values[name]]) for name in row) for row in late)
    matrix = ContinuousModel.monic(ascending(above), ascending(below), covariance, delay=times)
    plant = SampledModel(matrix, rows[0].step)
    model = _coloured(plant, rows, thetas)
    noise = model.parameters[len(plant.parameters) :]
    symbols = (*names, *(f"noise_{k}" for k in range(len(noise))))
    parametrisation = Parametrisation(
        (*names, *(parameter.name for parameter in noise)),
        symbols,
        np.array([*at, *(parameter.value for parameter in noise)]),
        np.ones(len(symbols), dtype=bool),
        tuple(map(Expression, (*map(term, plant.parameters), *symbols[len(names) :]))),
    )
    one = len(late) == len(late[0]) == 1  # a single entry is written without brackets
    written = {
        "numerator": above[0][0] if one else above,
        "denominator": below[0][0] if one else below,
        "delay": late[0][0] if one else late,
    }
    words = {"parameters": dict(values), "continuous": written, "sample": "zoh"}
    return Reparametrised(
        model, parametrisation, Words(words, {name: ("parameters", name) for name in values})
    )


def _coloured(
    plant: SampledModel, rows: Sequence[Process], thetas: Sequence[Array]
) -> SampledModel | Coloured:
    """Return a plant with the noise of its rows, whose C and D stand last among their parameters."""
    if not any(row.noise for row in rows):
        return plant
    C, D = (
        tuple(
            np.concatenate([[1.0], theta[theta.size - (2 - k) * row.noise :][: row.noise]])
            for row, theta in zip(rows, thetas, strict=True)
        )
        for k in (0, 1)
    )
    return Coloured(plant, C, D, (False,) * len(rows), (False,) * len(rows))
