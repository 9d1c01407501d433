"""How often right models are called undecided, and wrong ones met: random systems, one record each.

    python benchmarks/verdicts.py [RUNS] [FIRST_SEED] [--designed | --actuators]

The admissible error is drawn so that r_u reaches 50 to 100 % of it: every model would be called met if no
test spoke against it. It is a constant, or relative to |G| as far as |G| stays above a tenth of its gain.
Wrong models lack a lag or have another delay, or their data drift, have coloured noise that the model takes
for another kind, or come from a plant whose gain changes during the record, or whose actuator saturates or
has a dead zone, or the input was logged late. Half of the records begin in the middle of things, about a
level.

With --designed the records are the cheapest binary ones for a relative error of a first-order plant in a
narrow band, at one to two times the amplitude that they need. Nothing there excites what the model lacks more
than the design has to. Wrong models lack a pole.

With --actuators RUNS plants of each kind have an actuator that is not linear. With --coloured RUNS models are
right but for their noise, which they take for white; and RUNS plants have a gain that rises or falls evenly
by half during the record.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import scipy.signal
import scipy.special

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import SpecError
from inputdesign_cli.identification import Estimate, Moves, Noise, identify, that_matter, with_larger_noise
from inputdesign_cli.plant import PolynomialModel

FAULTS = ("lag", "delay", "drift", "noise", "change", "nonlinear")
LATE, COLOURED, RAMP = "late", "coloured", "ramp"
_FREQUENCIES = np.linspace(1e-3, np.pi, 800)
_BEFORE = 300
_DESIGNS = 30
_DESIGNED = """
plant: {{B: {B}, F: [1, -{pole}]}}
noise: {{C: [1], D: [1, -{colour}], variance: 1}}
experiment: {{samples: {samples}}}
cost: {{input_power: 1}}
accuracy: {{model_error: {{relative: {relative}, band: [0.005, {end}]}}}}
spectrum: {{type: fir, order: 20}}
signal: {{type: binary, seed: {seed}}}
"""


@dataclass(frozen=True)
class Trial:
    """One record and the model that is fitted to it."""

    model: PolynomialModel
    u: Array
    y: Array
    true: tuple[Array, Array]  # B and F of the true plant
    relative: float | None = None  # the admissible error, if it is not drawn
    end: float = np.pi  # of the band


def structure(B: Array, F: Array, *, A: int = 0, C: int = 0, D: int = 0) -> PolynomialModel:
    """A model with these orders; its numbers are a start of the search."""
    one, grow = np.ones(1), lambda n: np.append(1.0, np.full(n, -0.1))
    return PolynomialModel(
        ((B,),), (F if A else grow(0),), ((one if A else F,),), (grow(C),), (grow(D),), np.eye(1)
    )


def excitation(samples: int, rng: np.random.Generator) -> Array:
    """White, binary and held, or slow."""
    kind = rng.integers(3)
    if kind == 0:
        return rng.standard_normal(samples)
    if kind == 1:
        hold = int(rng.integers(2, 9))
        return np.repeat(rng.choice([-1.0, 1.0], samples // hold + 1), hold)[:samples]
    slow = scipy.signal.lfilter([1.0], [1.0, -rng.uniform(0.5, 0.95)], rng.standard_normal(samples))
    return np.asarray(slow / slow.std())


def trial(fault: str | None, rng: np.random.Generator) -> Trial:
    """A random system of first or second order with a delay, of which the model is right but for `fault`."""
    samples = int(rng.integers(300, 1501))
    delay, pole = int(rng.integers(1, 7)), rng.uniform(0.6, 0.985)
    F = np.array([1.0, -pole])
    if rng.random() < 0.5:
        F = np.convolve(F, [1.0, -rng.uniform(0.2, 0.9)])
    B = np.concatenate([np.zeros(delay), rng.uniform(0.3, 1.0, 2)]) * (1.0 - pole)
    C, D = int(rng.integers(2)), int(rng.integers(2))
    arx = fault is None and rng.random() < 0.25
    top = [1.0, rng.uniform(-0.7, 0.7)] if C else [1.0]
    below = F if arx else [1.0, -rng.uniform(0.3, 0.95)] if D else [1.0]
    model = structure(B, F, A=arx, C=C, D=0 if arx else D)
    if fault == "lag":
        lag = np.exp(-1.0 / rng.uniform(0.7, 4.0))
        F, B = np.convolve(F, [1.0, -lag]), B * (1.0 - lag)
    if fault == "delay":
        shift = int(rng.choice([1, 2, 3, -1, -2, -3])) if delay > 3 else int(rng.integers(1, 4))
        B = np.concatenate([np.zeros(shift), B]) if shift > 0 else B[-shift:]
    if fault == "noise":
        below = [1.0, -rng.uniform(0.8, 0.98)]
        model = structure(model.B[0][0], F) if rng.random() < 0.5 else structure(model.B[0][0], F, A=1)
    if fault == COLOURED:
        top, below = [1.0, rng.uniform(-0.7, 0.7)], [1.0, -rng.uniform(0.5, 0.98)]
        model = structure(B, F)
    total = samples + _BEFORE
    u = excitation(total, rng)
    applied = u
    if fault == RAMP:
        inside = np.clip((np.arange(total) - _BEFORE) / samples, 0.0, 1.0)
        applied = (1.0 + rng.choice([-0.5, 0.5]) * (inside - 0.5)) * u
    if fault == "change":
        late = np.arange(total) > _BEFORE + rng.uniform(0.15, 0.85) * samples
        gain = 1.0 + rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-1.5, -0.3)
        applied = np.where(late, gain, 1.0) * u
    if fault == LATE:
        applied = np.roll(u, -int(rng.integers(2, 16)))
    if fault in ACTUATORS:
        while np.unique(u).size <= 2:  # two levels have a gain, whatever lies between
            u = excitation(total, rng)
        applied = ACTUATORS[fault](u, rng)
    clean = scipy.signal.lfilter(B, F, applied)
    noise = scipy.signal.lfilter(top, below, rng.standard_normal(total))
    y = clean + noise * clean.std() / noise.std() * 10 ** rng.uniform(-1.5, -0.3)
    if fault == "drift":
        time = np.linspace(0.0, 1.0, total)
        wander = time if rng.random() < 0.5 else np.sin(np.pi * rng.uniform(0.5, 4.0) * time)
        y = y + (y - clean).std() * rng.uniform(2.0, 20.0) * wander
    if rng.random() < 0.5:
        return Trial(model, u[_BEFORE:], y[_BEFORE:] + rng.uniform(-50.0, 50.0), (B, F))
    begun = np.arange(total) >= _BEFORE
    u, y = np.where(begun, u, 0.0), y - clean + scipy.signal.lfilter(B, F, np.where(begun, applied, 0.0))
    return Trial(model, u[_BEFORE:], y[_BEFORE:], (B, F))


def saturating(u: Array, rng: np.random.Generator) -> Array:
    """Limits at 1 to 2.5 standard deviations."""
    limit = rng.uniform(1.0, 2.5) * u.std()
    return np.clip(u, -limit, limit)


def dead_zone(u: Array, rng: np.random.Generator) -> Array:
    """Nothing happens within 0.05 to 0.5 standard deviations of the middle."""
    zone = _share(rng, -1.3) * u.std()
    return u - np.clip(u, -zone, zone)


def with_play(u: Array, rng: np.random.Generator) -> Array:
    """The actuator follows at a distance of 0.05 to 0.5 standard deviations."""
    width, at, out = _share(rng, -1.3) * u.std(), 0.0, np.empty_like(u)
    for t, now in enumerate(u):
        out[t] = at = min(max(at, now - width), now + width)
    return out


def of_limited_speed(u: Array, rng: np.random.Generator) -> Array:
    """No step is larger than 0.5 to 2.5 times their rms."""
    most, at, out = rng.uniform(0.5, 2.5) * np.std(np.diff(u)), 0.0, np.empty_like(u)
    for t, now in enumerate(u):
        out[t] = at = at + np.clip(now - at, -most, most)
    return out


def of_two_gains(u: Array, rng: np.random.Generator) -> Array:
    """The gain above the middle is another by 5 to 50 %."""
    return np.where(u > 0.0, 1.0 + rng.choice([-1.0, 1.0]) * _share(rng, -1.3), 1.0) * u


def cubic(u: Array, rng: np.random.Generator) -> Array:
    """A cubic term of 1 to 20 % at one standard deviation."""
    return np.asarray(u + rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-2.0, -0.7) * u**3 / u.std() ** 2)


def _share(rng: np.random.Generator, least: float) -> float:
    return float(10 ** rng.uniform(least, -0.3))


def saturating_or_dead(u: Array, rng: np.random.Generator) -> Array:
    """One of the two."""
    return saturating(u, rng) if rng.random() < 0.5 else dead_zone(u, rng)


# The gain is one in the middle, or beyond the zone or the play.
ACTUATORS = {
    "nonlinear": saturating_or_dead,
    "play": with_play,
    "speed": of_limited_speed,
    "two gains": of_two_gains,
    "cubic": cubic,
}


@dataclass(frozen=True)
class Design:
    """An experiment on b q^-d / (1 - pole q^-1) with noise through 1 / (1 - colour q^-1) of variance one."""

    u: Array
    B: Array
    pole: float
    colour: float
    relative: float
    end: float


@cache
def design(number: int) -> Design:
    """One of the designed experiments."""
    rng = np.random.default_rng([number, 991])
    pole, delay, colour = rng.uniform(0.85, 0.97), int(rng.integers(1, 6)), rng.uniform(0.5, 0.9)
    B, end = np.append(np.zeros(delay), 1.0 - pole), rng.uniform(2.0, 5.0) * (1.0 - pole)
    relative, samples = rng.uniform(0.05, 0.2), int(rng.integers(400, 1001))
    text = _DESIGNED.format(
        B=B.tolist(), pole=pole, colour=colour, samples=samples, relative=relative, end=end, seed=number
    )
    record = solve(parse_spec(text)).tables["signal"].columns["u1"]
    return Design(np.asarray(record), B, pole, colour, relative, end)


def designed_trial(seed: int, *, wrong: bool, rng: np.random.Generator) -> Trial:
    """A designed record on the plant that it is for, or on one with a pole of 0.2 to 0.8 more."""
    made = design(seed % _DESIGNS)
    u, B, F = made.u * rng.uniform(1.0, 2.0), made.B, np.array([1.0, -made.pole])
    model = structure(B, F, D=1)
    if wrong:
        more = rng.uniform(0.2, 0.8)
        B, F = B * (1.0 - more), np.convolve(F, [1.0, -more])
    e = rng.standard_normal(u.size + _BEFORE)
    noise = scipy.signal.lfilter([1.0], [1.0, -made.colour], e)[_BEFORE:]
    return Trial(model, u, scipy.signal.lfilter(B, F, u) + noise, (B, F), made.relative, made.end)


@dataclass(frozen=True)
class Judged:
    """The estimate; whether its error is admitted, by r_u and in truth; whether a parameter is missed.

    `answering` tells that the input answers the noise, `noted` that a verdict of met has a note.
    """

    found: Estimate
    met: bool
    beyond: bool
    missed: bool
    answering: bool
    noted: bool

    @property
    def undecided(self) -> bool:
        """Whether the verdict is neither met nor missed."""
        refuted = bool(self.found.tests.failed) or self.answering
        return refuted or not self.found.search.converged or (self.met and self.missed)


def estimated(made: Trial) -> tuple[PolynomialModel, Estimate]:
    """The model and its estimate, with a larger noise where its own is refuted, as `assess` has it."""
    u, y = made.u[:, None], made.y[:, None]
    found = identify(made.model, u, y)
    model = made.model.at(found.theta)

    def larger(noises: list[Noise]) -> tuple[Estimate, tuple[PolynomialModel, Estimate]]:
        ((C, D),) = noises
        structured = replace(model, C=(np.convolve(model.C[0], C),), D=(np.convolve(model.D[0], D),))
        other = identify(structured, u, y, start=structured.theta, near=True)
        return other, (structured, other)

    return with_larger_noise(found, larger) or (made.model, found)


def judged(made: Trial, rng: np.random.Generator) -> Judged:
    """The estimate, and its true error against what is admitted."""
    structured, found = estimated(made)
    model = structured.at(found.theta)
    w = np.linspace(_FREQUENCIES[0], made.end, _FREQUENCIES.size)
    G = model.plant_at(w)[:, 0, 0]
    gradient = model.plant_gradient(w)[:, :, 0, 0]
    T = np.stack([gradient.real, gradient.imag], axis=1)
    spread = np.linalg.eigvalsh(T @ found.covariance @ T.swapaxes(1, 2))[:, -1]
    alpha = np.sqrt(2.0 * scipy.special.gammaincinv(0.5 * np.sum(model.in_plant), 0.95))
    size, asked = np.abs(G), np.ones(G.size, dtype=bool)
    if made.relative is None:
        relative = rng.random() < 0.5
        asked = size > 0.1 * size[0] if relative else asked
        shape = (size if relative else np.ones(size.size))[asked]
        admissible = np.max(alpha * np.sqrt(spread[asked]) / shape) / rng.uniform(0.5, 1.0) * shape
    else:
        admissible = made.relative * size
    _, true = scipy.signal.freqz(*made.true, w)
    known = np.minimum(np.sqrt(spread[asked]) / admissible, 1.0 / alpha)
    moves = []
    for one in found.tests.directed:
        move, slope = (
            np.max(np.abs(G[..., 0, 0]), axis=0) / admissible
            for G in (one.moves(model, w[asked]), one.slope(model, w[asked]))
        )
        moves.append(Moves(move, one.deviation * slope, known))
    return Judged(
        found,
        bool(np.all(alpha * np.sqrt(spread[asked]) <= admissible * (1.0 + 1e-9))),
        bool(np.any(np.abs(G - true)[asked] > admissible)),
        bool(that_matter(found.tests.directed, moves)),
        bool(found.tests.answering),
        any(float(np.max(one.estimated + 2.0 * one.deviation)) > 1.0 for one in moves),
    )


def counted(trials: Iterable[tuple[Trial, np.random.Generator]]) -> Counter[str]:
    """How many were called undecided, failed which test, and were met with too large an error."""
    counts: Counter[str] = Counter()
    for made, rng in trials:
        try:
            one = judged(made, rng)
        except SpecError:  # the data do not determine the parameters
            counts["refused"] += 1
            continue
        counts["undecided"] += one.undecided
        counts["beyond"] += one.beyond
        counts["met though beyond"] += one.met and one.beyond and not one.undecided
        counts["met without a note"] += one.met and not one.undecided and not one.noted
        counts["not settled"] += not one.found.search.converged
        counts["free start"] += one.found.start.free
        counts["a parameter missed"] += one.missed
        counts["an input that answers"] += one.answering
        tests = one.found.tests
        counts.update({test.name for test in tests.scores} & {test.name for test in tests.failed})
        counts["level_shift"] += any(test.name == "level_shift" for test in tests.failed)
        counts["directed"] += any(tried.test in tests.failed for tried in tests.directed)
    return counts


def study(fault: str | None, seeds: range) -> Counter[str]:
    """The verdicts on random systems."""
    number = [None, *dict.fromkeys([*FAULTS, *ACTUATORS, LATE, COLOURED, RAMP])].index(fault)
    generators = [np.random.default_rng([seed, number]) for seed in seeds]
    return counted((trial(fault, rng), rng) for rng in generators)


def designed_study(seeds: range, *, wrong: bool) -> Counter[str]:
    """The same of designed records."""
    generators = [(seed, np.random.default_rng([seed, 77 + wrong])) for seed in seeds]
    return counted((designed_trial(seed, wrong=wrong, rng=rng), rng) for seed, rng in generators)


def main() -> None:
    """Print the counts of right models, and of as many wrong ones, a quarter of each kind."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("runs", type=int, nargs="?", default=500)
    parser.add_argument("first", type=int, nargs="?", default=0)
    parser.add_argument("--designed", action="store_true")
    parser.add_argument("--actuators", action="store_true")
    parser.add_argument("--coloured", action="store_true")
    asked = parser.parse_args()
    every = range(asked.first, asked.first + asked.runs)
    if asked.designed:
        for name, wrong in (("right", False), ("wrong", True)):
            print(f"{name} ({asked.runs})", dict(designed_study(every, wrong=wrong)), flush=True)
        return
    if asked.actuators or asked.coloured:
        for kind in (COLOURED, RAMP) if asked.coloured else ACTUATORS:
            print(f"{kind} ({asked.runs})", dict(study(kind, every)), flush=True)
        return
    print(f"right ({asked.runs})", dict(study(None, every)), flush=True)
    wrong_ones: Counter[str] = Counter()
    each = asked.runs // len(FAULTS)
    for fault in (*FAULTS, LATE):
        found = study(fault, every[:each])
        wrong_ones += found
        print(f"{fault} ({each})", dict(found), flush=True)
    print(f"wrong ({each * (1 + len(FAULTS))})", dict(wrong_ones))


if __name__ == "__main__":
    main()
