"""How often right models are called undecided, and wrong ones met: random systems, one record each.

    python benchmarks/verdicts.py [RUNS] [FIRST_SEED]

The admissible error is drawn so that r_u reaches 50 to 100 % of it: every model would be called met if no
test spoke against it. It is a constant, or relative to |G| as far as |G| stays above a tenth of its gain.
Wrong models lack a lag or have another delay, or their data drift or have coloured noise that the model takes
for another kind. Half of the records begin in the middle of things, about a level.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass

import numpy as np
import scipy.signal
import scipy.special

from inputdesign_cli.identification import Estimate, identify
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.plant.polynomial import Array

FAULTS = ("lag", "delay", "drift", "noise")
_FREQUENCIES = np.linspace(1e-3, np.pi, 800)
_BEFORE = 300


@dataclass(frozen=True)
class Trial:
    """One record and the model that is fitted to it."""

    model: PolynomialModel
    u: Array
    y: Array
    true: tuple[Array, Array]  # B and F of the true plant


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
    total = samples + _BEFORE
    u = excitation(total, rng)
    clean = scipy.signal.lfilter(B, F, u)
    noise = scipy.signal.lfilter(top, below, rng.standard_normal(total))
    y = clean + noise * clean.std() / noise.std() * 10 ** rng.uniform(-1.5, -0.3)
    if fault == "drift":
        time = np.linspace(0.0, 1.0, total)
        wander = time if rng.random() < 0.5 else np.sin(np.pi * rng.uniform(0.5, 4.0) * time)
        y = y + (y - clean).std() * rng.uniform(2.0, 20.0) * wander
    if rng.random() < 0.5:
        return Trial(model, u[_BEFORE:], y[_BEFORE:] + rng.uniform(-50.0, 50.0), (B, F))
    u, y = np.where(np.arange(total) < _BEFORE, 0.0, u), y - clean
    y = y + scipy.signal.lfilter(B, F, u)
    return Trial(model, u[_BEFORE:], y[_BEFORE:], (B, F))


def judged(made: Trial, rng: np.random.Generator) -> tuple[Estimate, bool]:
    """The estimate, and whether its true error exceeds the admissible error at some frequency."""
    found = identify(made.model, made.u[:, None], made.y[:, None])
    model = made.model.at(found.theta)
    G = model.plant_at(_FREQUENCIES)[:, 0, 0]
    gradient = model.plant_gradient(_FREQUENCIES)[:, :, 0, 0]
    T = np.stack([gradient.real, gradient.imag], axis=1)
    spread = np.linalg.eigvalsh(T @ found.covariance @ T.swapaxes(1, 2))[:, -1]
    alpha = np.sqrt(2.0 * scipy.special.gammaincinv(0.5 * np.sum(model.in_plant), 0.95))
    relative, size = rng.random() < 0.5, np.abs(G)
    asked = size > 0.1 * size[0] if relative else np.ones(size.size, dtype=bool)
    shape = (size if relative else np.ones(size.size))[asked]
    admissible = np.max(alpha * np.sqrt(spread[asked]) / shape) / rng.uniform(0.5, 1.0) * shape
    _, true = scipy.signal.freqz(*made.true, _FREQUENCIES)
    return found, bool(np.any(np.abs(G - true)[asked] > admissible))


def study(fault: str | None, seeds: range) -> Counter[str]:
    """How many of the runs were called undecided, failed which test, and were met with too large an error."""
    counts: Counter[str] = Counter()
    for seed in seeds:
        rng = np.random.default_rng([seed, 0 if fault is None else 1 + FAULTS.index(fault)])
        found, beyond = judged(trial(fault, rng), rng)
        undecided = bool(found.failed) or not found.converged
        counts["undecided"] += undecided
        counts["beyond"] += beyond
        counts["met though beyond"] += beyond and not undecided
        counts["not settled"] += not found.converged
        counts["free start"] += found.free
        counts.update(test.name for test in found.failed)
    return counts


def main(runs: int = 500, first: int = 0) -> None:
    """Print the counts of right models, and of as many wrong ones, a quarter of each kind."""
    print(f"right ({runs})", dict(study(None, range(first, first + runs))), flush=True)
    wrong: Counter[str] = Counter()
    for fault in FAULTS:
        found = study(fault, range(first, first + runs // len(FAULTS)))
        wrong += found
        print(f"{fault} ({runs // len(FAULTS)})", dict(found), flush=True)
    print(f"wrong ({runs})", dict(wrong))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
