"""Structures in s, behind a hold: gain, dead time, and one to three time constants, by these names.

They are estimated as coefficients of a transfer matrix that follow from named parameters, which is how a spec
states them too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.explore.orders import NOISE_ORDERS
from inputdesign_cli.explore.regression import SharedDenominator, numerators
from inputdesign_cli.expressions import Expression
from inputdesign_cli.plant import (
    Coloured,
    ContinuousModel,
    Parametrisation,
    Reparametrised,
    SampledModel,
    Words,
)
from inputdesign_cli.plant.model import DELAY, Parameter

_NAMES = {1: "FOPDT", 2: "SOPDT", 3: "TOPDT"}
# Numerators and denominators in s by their parameters, descending.
_BELOW = {
    1: ("{T}", "1"),
    2: ("{T}**2", "2*{zeta}*{T}", "1"),
    3: ("{T}**2*{T3}", "{T}**2 + 2*{zeta}*{T}*{T3}", "2*{zeta}*{T} + {T3}", "1"),
}
_OF_ORDER = {1: ("K", "T"), 2: ("K", "T", "zeta"), 3: ("K", "T", "zeta", "T3")}
# Where dead times are begun, in samples beside that of the quick estimate.
_BESIDE = (-0.75, -0.25, 0.25)
# A pole in z below this answers within a sample.
_FASTEST = 1e-3
_SLOWEST = 1.0 - 1e-4
_ZERO = 0.5
_LEAST = 0.05
# A dead time this near below a whole number of samples is that number.
_ROUNDED = 0.01
# Below this damping a pair of poles rings.
_RINGING = 0.7
LONGER = 10.0
"""What lasts so many longest records is a line in each."""
_NORMAL = 1.96  # 95 % of a Gaussian estimate
_LONGEST = 1e6


@dataclass(frozen=True)
class Process:
    """One output: of each input a gain K, a dead time L, and poles by T and zeta (and T3, all in s).

    Attributes:
        delays: the lag of the first sample that each input moves.
        order: the number of poles, one to three.
        step: the sample time.
        zero: whether the numerator is K (Tz s + 1).
        noise: the order of C and D, none for white noise.
    """

    delays: tuple[int, ...]
    order: int
    step: float
    zero: bool = False
    noise: int = 0

    # Plant and noise have no poles in common, and the parameters have names.
    shared: ClassVar[bool] = False
    physical: ClassVar[Literal[True]] = True

    @property
    def family(self) -> str:
        """What the field calls it: first, second, third order plus dead time."""
        return _NAMES[self.order]

    @property
    def numbers(self) -> dict[str, int]:
        """How many poles and zeros, and the orders of the noise."""
        every = {"poles": self.order, "zeros": int(self.zero), "C": self.noise, "D": self.noise}
        return {word: number for word, number in every.items() if number}

    @property
    def coloured(self) -> bool:
        """Whether the noise is filtered."""
        return self.noise > 0

    @property
    def letters(self) -> tuple[str, ...]:
        """The parameters of an input."""
        return (*_OF_ORDER[self.order], *(("Tz",) if self.zero else ()), "L")

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.delays) * len(self.letters) + 2 * self.noise

    @property
    def unknowns(self) -> int:
        """What the input must tell: coefficients and dead time of one input."""
        return len(self.letters)

    def at(self, theta: Array) -> Process:
        """The same, its delays those of the dead times among its parameters (k,)."""
        return replace(self, delays=self._first(self._late(theta)))

    def ranges(self, theta: Array, deviations: Array) -> tuple[tuple[int, int], ...]:
        """Of each input the delays that 95 % of confidence leaves, by parameters and deviations (k,)."""
        late, width = self._late(theta), _NORMAL * self._late(deviations)
        low, high = (self._first(np.maximum(x, 0.0)) for x in (late - width, late + width))
        return tuple(zip(low, high, strict=True))

    def beyond(self, theta: Array, longest: int) -> list[tuple[str, float]]:
        """Letters and values, of parameters (k,), of poles that a record of so many samples cannot show.

        A resonance beyond the Nyquist frequency is one that sampling has folded, and what is as slow as many
        records is a line in each of them.
        """
        found = list[tuple[str, float]]()
        for named in self._by_input(theta):
            fast = named["T"] * np.pi < self.step and named.get("zeta", 1.0) < _RINGING
            slow = max(named["T"], named.get("T3", 0.0)) > LONGER * longest * self.step
            found += [("T", named["T"])] * (fast or slow)
        return found

    def slowest(self, theta: Array) -> float:
        """The longest time constant, also where zeta is beyond one, of parameters (k,)."""
        found = []
        for named in self._by_input(theta):
            damped = max(named.get("zeta", 1.0), 1.0)
            found += [named["T"] * (damped + np.sqrt(damped**2 - 1.0)), named.get("T3", 0.0)]
        return float(max(found))

    def _by_input(self, theta: Array) -> list[dict[str, float]]:
        """The parameters (k,) of every input by their letters."""
        width = len(self.letters)
        rows = theta[: width * len(self.delays)].reshape(-1, width).tolist()
        return [dict(zip(self.letters, row, strict=True)) for row in rows]

    def _late(self, theta: Array) -> Array:
        """(r,): the dead times."""
        width = len(self.letters)
        return theta[width - 1 : width * len(self.delays) : width]

    def _first(self, late: Array) -> tuple[int, ...]:
        """The lags of the first samples that inputs move after dead times (r,)."""
        return tuple(int(np.floor(min(x, _LONGEST))) + 1 for x in late / self.step + _ROUNDED)

    def with_coloured_noise(self) -> list[Process]:
        """The same plant, the noise filtered."""
        return [replace(self, noise=n) for n in NOISE_ORDERS]

    def model(self) -> Reparametrised:
        """The structure, with numbers that mean nothing."""
        own = [2.0 if letter == "zeta" else self.step for letter in self.letters] * len(self.delays)
        return process_models([self], [np.concatenate([own, np.zeros(2 * self.noise)])], np.eye(1))

    def starts(self, parts: Parts, quick: SharedDenominator, b: int) -> Array:
        """(n, k): where to begin, by a quick estimate of as many poles from records at rest."""
        poles = np.roots(quick.F)
        size = np.clip(np.abs(poles), _FASTEST, _SLOWEST)
        angle = np.where(poles.real > 0.0, np.abs(np.angle(poles)), 0.0)
        s = np.sort_complex(-(np.log(size) + 1j * angle * (poles.imag >= 0) - 1j * angle * (poles.imag < 0)))
        s = np.resize(s, self.order) / self.step
        gains = numerators(parts, quick, b).sum(axis=1) / max(float(np.sum(quick.F)), 1e-300)
        below = self._below(s)
        found = []
        for beside in _BESIDE:
            theta: list[float] = []
            for gain, delay in zip(gains, quick.delays, strict=True):
                late = max(delay - 1 + beside, _LEAST) * self.step
                theta += [gain, *below, *([_ZERO * below[0]] if self.zero else []), late]
            found.append([*theta, *np.zeros(2 * self.noise)])
        return np.array(found)

    def _below(self, s: Array) -> list[float]:
        """T, zeta and T3 of poles -s: the two slowest, or those of a pair, make T and zeta."""
        if self.order == 1:
            return [1.0 / max(float(np.abs(s[0])), 1e-300)]
        real = [x for x in s if abs(x.imag) < 1e-9 * abs(x)]
        pair = [x for x in s if abs(x.imag) >= 1e-9 * abs(x)][:2]
        both = pair if len(pair) == 2 else s[:2]
        product = abs(float(np.real(both[0] * both[1])))
        T = product**-0.5
        zeta = max(0.5 * float(np.real(both[0] + both[1])) * T, 0.02)
        rest = [x for x in real if not any(x is one for one in both)] or [s[-1]]
        return [T, zeta, 1.0 / abs(rest[-1])][: self.order]


def processes(order: int, delays: tuple[int, ...], step: float) -> list[Process]:
    """The structures with so many poles; with two also one with a zero."""
    if order not in _NAMES:
        return []
    plain = Process(delays, order, step)
    return [plain, replace(plain, zero=True)] if order == 2 else [plain]


@dataclass(frozen=True)
class _Texts:
    """The entries of a transfer matrix as a spec writes them, and the values (by name) of its parameters."""

    numerator: list[list[list[str]]]
    denominator: list[list[list[str]]]
    delay: list[list[str]]
    values: dict[str, float]

    @classmethod
    def of(cls, rows: Sequence[Process], thetas: Sequence[Array]) -> _Texts:
        inputs = len(rows[0].delays)
        single = len(rows) == inputs == 1
        above, below, late, values = [], [], [], dict[str, float]()
        for i, (row, theta) in enumerate(zip(rows, thetas, strict=True), start=1):
            own = [
                {letter: letter if single else f"{letter}_{i}{j + 1}" for letter in row.letters}
                for j in range(inputs)
            ]
            every = [name for names in own for name in names.values()]
            values |= dict(zip(every, theta.tolist(), strict=False))  # those of the noise follow
            top = ("{K}*{Tz}", "{K}") if row.zero else ("{K}",)
            above.append([[text.format(**names) for text in top] for names in own])
            below.append([[text.format(**names) for text in _BELOW[row.order]] for names in own])
            late.append([names["L"] for names in own])
        return cls(above, below, late, values)

    def continuous(self, covariance: Array) -> ContinuousModel:
        """What they are worth."""
        names, at = tuple(self.values), np.array(list(self.values.values()))

        def ascending(rows: list[list[list[str]]]) -> tuple[tuple[Array, ...], ...]:
            return tuple(
                tuple(np.array([Expression(text).at(names, at)[0] for text in entry[::-1]]) for entry in row)
                for row in rows
            )

        late = tuple(tuple(np.array([self.values[name]]) for name in row) for row in self.delay)
        return ContinuousModel.monic(
            ascending(self.numerator), ascending(self.denominator), covariance, delay=late
        )

    def term(self, parameter: Parameter) -> str:
        """A coefficient of the monic matrix."""
        i, j = parameter.places[0]
        if parameter.letter == DELAY:
            return self.delay[i][j]
        entry = (self.numerator if parameter.letter == "b" else self.denominator)[i][j]
        return f"({entry[-1 - parameter.power]})/({self.denominator[i][j][0]})"

    def words(self) -> Words:
        """As a spec states them; a single entry without brackets."""
        single = len(self.delay) == len(self.delay[0]) == 1
        above, below, late = self.numerator, self.denominator, self.delay
        plant = {
            "parameters": dict(self.values),
            "continuous": {
                "numerator": above[0][0] if single else above,
                "denominator": below[0][0] if single else below,
                "delay": late[0][0] if single else late,
            },
            "sample": "zoh",
        }
        return Words(plant, {name: ("parameters", name) for name in self.values})


def process_models(rows: Sequence[Process], thetas: Sequence[Array], covariance: Array) -> Reparametrised:
    """Structures of one output each, of the same inputs, as one model, each with its parameters (k,)."""
    texts = _Texts.of(rows, thetas)
    plant = SampledModel(texts.continuous(covariance), rows[0].step)
    C, D = (
        tuple(
            np.concatenate([[1.0], theta[theta.size - (2 - k) * row.noise :][: row.noise]])
            for row, theta in zip(rows, thetas, strict=True)
        )
        for k in (0, 1)
    )
    coloured = any(row.noise for row in rows)
    model = Coloured(plant, C, D, (False,) * len(rows), (False,) * len(rows)) if coloured else plant
    noise = model.parameters[len(plant.parameters) :]
    symbols = (*texts.values, *(f"noise_{k}" for k in range(len(noise))))
    terms = (*map(texts.term, plant.parameters), *symbols[len(texts.values) :])
    parametrisation = Parametrisation(
        (*texts.values, *(parameter.name for parameter in noise)),
        symbols,
        np.array([*texts.values.values(), *(parameter.value for parameter in noise)]),
        np.ones(len(symbols), dtype=bool),
        tuple(map(Expression, terms)),
    )
    return Reparametrised(model, parametrisation, texts.words())
